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

import catenary
from catenary import InputError
from catenary.cases.run import runner
from catenary.cases.run.runner import RunOutcome, run_case

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
    return run_case(scene, out, comm, only_summary=True)


def test_a_window_gives_on_ranks_what_it_gives_on_one(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    scene = load_scene("ac_simple", [*SHORT, "window.mode=bounded", *SPANS])
    runner._warn_of_idle.cache_clear()  # it warns once, whatever ran before
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


def test_a_sweep_of_windows_takes_one_rank_for_each_run() -> None:
    """All variants were refused, as their runs had several ranks."""
    scene = catenary.load("ac_simple").replace(
        evaluation={"from_m": 200.0, "to_m": 250.0},
        train={"end_m": 260.0},
        window={"mode": "bounded", "spans_ahead": 2.0, "spans_behind": 2.0},
    )
    table = catenary.sweep(scene, {"train.speed_km_h": [280, 300]}, comm=COMM)
    assert table.outcome.tolist() == ["done", "done"]
    alone = catenary.run(scene.replace(train={"speed_km_h": 300}), comm=MPI.COMM_SELF)
    assert table.std_N[1] == alone.statistics.std_N.iloc[0]
