"""Ranks started amiss: tasks of SLURM that MPI sees as single processes, more ranks than cores."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from mpi4py import MPI
from program import MPIRUN, catenary, short_run

from catenary.cases.cli.app import crowded, lone_task

NAMES = ("SLURM_NTASKS", "SLURM_STEP_NUM_TASKS", "SLURM_PROCID")


@pytest.mark.parametrize(
    ("variables", "n_ranks", "told"),
    [
        ({}, 1, False),
        ({"SLURM_NTASKS": "3"}, 1, True),
        ({"SLURM_NTASKS": "3", "SLURM_STEP_NUM_TASKS": "3", "SLURM_PROCID": "0"}, 1, True),
        # Once for all tasks; under MPI; one step of one task; one task; what is no number.
        ({"SLURM_NTASKS": "3", "SLURM_STEP_NUM_TASKS": "3", "SLURM_PROCID": "2"}, 1, False),
        ({"SLURM_NTASKS": "3", "SLURM_STEP_NUM_TASKS": "3", "SLURM_PROCID": "0"}, 3, False),
        ({"SLURM_NTASKS": "3", "SLURM_STEP_NUM_TASKS": "1"}, 1, False),
        ({"SLURM_NTASKS": "1"}, 1, False),
        ({"SLURM_NTASKS": "²"}, 1, False),
    ],
)
def test_single_processes_of_several_tasks_are_told(
    variables: dict[str, str], n_ranks: int, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    sentence = lone_task(n_ranks)
    assert bool(sentence) is told
    assert not told or ("3 tasks" in sentence and "srun --mpi=pmix" in sentence)


@pytest.mark.process
@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_ranks_that_share_a_core_are_told_once(tmp_path: Path) -> None:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})  # which mpirun and its ranks take over
    try:
        words = [*short_run(tmp_path / "out"), "--", "-march_ts_max_steps", "20"]
        done = catenary(*words, cwd=tmp_path, ranks=2)
    finally:
        os.sched_setaffinity(0, before)
    assert done.code == 1, "the run was interrupted"
    assert done.stderr.count("2 ranks share 1 core of this machine") == 1


def test_ranks_with_a_core_each_are_not_told() -> None:
    class OnNode:
        """Four ranks of which two, with a core each, are on this machine."""

        size = 4

        def Split_type(self, kind: int) -> Node:
            return Node()

    class Node:
        size = 2

        def allgather(self, own: set[int]) -> list[set[int]]:
            return [{0}, {1}]

        def Free(self) -> None:
            pass

    assert crowded(OnNode()) == ""
    assert crowded(MPI.COMM_SELF) == ""
