"""Tasks of SLURM that MPI sees as single processes."""

from __future__ import annotations

import pytest

from catenary.cases.cli.app import lone_task

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
