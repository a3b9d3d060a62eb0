"""What a run cost: wall time of its phases, and the work of its march."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from catenary.base.petsc import PETSc
from catenary.postproc.record.progress import Progress
from catenary.solver.time_loop.march import Outcome


class Phases:
    """Wall time of the phases of a run [s], each shown while it lasts, and also a PETSc log stage.

    Collective by use.
    """

    def __init__(self, progress: Progress) -> None:
        self.wall: dict[str, float] = {}
        self.progress = progress

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Time what happens inside."""
        begin = time.perf_counter()
        stage = PETSc.Log.Stage(name)
        stage.push()
        try:
            with self.progress.phase(name):
                yield
        finally:
            stage.pop()
            self.wall[name] = time.perf_counter() - begin


def performance(outcome: Outcome, phases: Phases, n_ranks: int) -> dict[str, Any]:
    """What is known at the end; after a restart, of the last part."""
    counted: dict[str, float] = dict(outcome.counters)
    if outcome.traffic is not None:
        # Of the rank that sends most; a whole number unless droppers of other ranks slacken.
        counted["messages_per_step"], counted["message_bytes_per_step"] = (
            round(value, 3) for value in outcome.traffic
        )
    return {
        "n_ranks": n_ranks,
        "march_wall_s": outcome.wall,
        "march_cpu_s": outcome.cpu,
        "records_wall_s": outcome.finishing,
        "phase_wall_s": phases.wall,
        "inner_iterations": counted,
        "detour": outcome.slow_path,
    }
