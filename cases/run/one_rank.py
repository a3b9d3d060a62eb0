"""Runs with a window, in which only one rank computes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import StopRequest
from catenary.cases.scene.scene import Scene
from catenary.solver.problem.window import OFF

logger = logging.getLogger("catenary.runner")

T = TypeVar("T")


def on_as_many(scene: Scene, comm: Any, run: Callable[[Any], T]) -> T:
    """What ``run`` returns for the ranks that a scene needs. Collective.

    A window is some tens of spans, which one rank steps in less time than two can agree on: rank 0
    runs alone, as if the others were not there, and these sleep until it is done. A signal to
    them changes nothing; an MPI launcher hands it to rank 0 as well.
    """
    if comm.size == 1 or scene.window.mode == OFF:
        return run(comm)
    from mpi4py import MPI

    if comm.rank == 0:
        logger.warning(
            "window.mode is %s: what moves is so short that one rank steps it; the other %d wait "
            "and make nothing faster, start it without mpirun",
            scene.window.mode,
            comm.size - 1,
        )
        return on_root(comm, lambda: run(MPI.COMM_SELF), takes_long=True)
    with StopRequest():
        return on_root(comm, lambda: run(MPI.COMM_SELF), takes_long=True)
