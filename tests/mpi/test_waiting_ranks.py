"""Ranks that wait for work of one of them."""

from __future__ import annotations

import threading
import time

import pytest
from mpi4py import MPI

from catenary import InputError
from catenary.base.parallel import on_root

COMM = MPI.COMM_WORLD


def test_ranks_sleep_while_one_works_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """MPI's own waiting keeps a core busy for as long as the work takes."""
    naps: list[float] = []
    sleep = time.sleep
    monkeypatch.setattr(time, "sleep", lambda duration: (naps.append(duration), sleep(duration)))

    def work() -> str:
        threading.Event().wait(0.3)
        return "done"

    COMM.Barrier()
    assert on_root(COMM, work, takes_long=True) == "done"
    assert COMM.rank == 0 or sum(naps) > 0.05


def test_an_error_of_long_work_reaches_all() -> None:
    def refuse() -> None:
        raise InputError("it cannot be")

    with pytest.raises(InputError, match="it cannot be"):
        on_root(COMM, refuse, takes_long=True)
