"""Tasks of a batch system that do not find each other as ranks of MPI."""

from __future__ import annotations

import os


def lone_task(n_ranks: int) -> str:
    """The sentence for a process that SLURM started as one of several and MPI as a single one.

    "" for all others, and for tasks but the first, so that it is told once. Not collective.

    Parameters
    ----------
    n_ranks : ranks that MPI sees
    """
    # A step of one task within a larger job is meant so.
    told = os.environ.get("SLURM_STEP_NUM_TASKS") or os.environ.get("SLURM_NTASKS", "")
    n_tasks = int(told) if told.isascii() and told.isdigit() else 1
    if n_ranks > 1 or n_tasks == 1 or os.environ.get("SLURM_PROCID", "0") != "0":
        return ""
    return (
        f"SLURM has {n_tasks} tasks here and MPI sees one rank: each task simulates the whole line "
        "by itself; start ranks with `srun --mpi=pmix`, or as `srun --mpi=list` and your site say, "
        "or with mpirun"
    )
