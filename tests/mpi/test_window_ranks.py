"""A run with a window on several ranks: one of them takes its steps, and all have its outcome.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi/test_window_ranks.py``.
"""

from __future__ import annotations

import logging
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from scenes import Scene, load_scene

from catenary import InputError
from catenary.cases.run.runner import RunOutcome, on_as_many, run_case

COMM = MPI.COMM_WORLD
SPANS = ("window.spans_ahead=2", "window.spans_behind=2")
SHORT = ("evaluation.from_m=200", "evaluation.to_m=250", "train.end_m=260")


@pytest.fixture
def folder() -> Iterator[Path]:
    """The same folder on all ranks."""
    path = COMM.bcast(tempfile.mkdtemp() if COMM.rank == 0 else None)
    yield Path(path)
    COMM.Barrier()
    if COMM.rank == 0:
        shutil.rmtree(path)


def run(scene: Scene, out: Path, comm: MPI.Comm) -> RunOutcome:
    return on_as_many(
        scene, comm, lambda ranks: run_case(scene, out, ranks, only_summary=True, force=False)
    )


def test_a_window_gives_on_ranks_what_it_gives_on_one(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    scene = load_scene("ac_simple", [*SHORT, "window.mode=bounded", *SPANS])
    with caplog.at_level(logging.WARNING, "catenary.runner"):
        outcome = run(scene, folder / "ranks", COMM)
    assert outcome.outcome == "done" and outcome.summary
    told = "make nothing faster" in caplog.text
    assert told == (COMM.rank == 0 and COMM.size > 1)
    if COMM.rank == 0:
        run(scene, folder / "one", MPI.COMM_SELF)
        forces = []
        for name in ("ranks", "one"):
            with h5py.File(folder / name / "run.h5") as file:
                forces.append(file["channels/contact_force"][:])
        assert np.array_equal(*forces)


def test_a_refusal_reaches_all_ranks(folder: Path) -> None:
    scene = load_scene("ac_simple", [*SHORT, "window.mode=bounded"])
    run(scene, folder / "twice", COMM)
    with pytest.raises(InputError, match="run.h5"):
        run(scene, folder / "twice", COMM)
