"""Events of a step, which PETSc's -log_view lists beside its own.

An event that is not logged costs less than a tenth of a microsecond.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from catenary.base.petsc import PETSc

# Names as -log_view prints them, in the order of a step, and what they hold.
NAMES = {
    "LineColumns": "answers of the line to unit contact forces",
    "LineFree": "prediction, product with K, solve and correction of the line",
    "LineProduct": "product with K where it is on its own, part of LineFree",
    "LineSolve": "solve with A where it is on its own, part of LineFree",
    "ContactShare": "heights, compliances and tensions that this rank owns",
    "ContactReduce": "shares to rank 0, where there are others",
    "ContactInner": "pantographs' predictions and the inner problem, on rank 0",
    "ContactReply": "forces to all ranks, where there are others",
    "LineSuperpose": "answers to the forces",
    "PantoAdvance": "pantographs' steps, on rank 0",
    "Steps": "whole steps in one compiled loop, where none of the others is looked at",
    "Show": "observers: recorder, fields, progress",
}


class Event(NamedTuple):
    """Begins and ends an event."""

    begin: Callable[[], None]
    end: Callable[[], None]


def event(name: str) -> Event:
    """The event of a name of ``NAMES``; one event for each name. Not collective."""
    logged = PETSc.Log.Event(name)
    return Event(logged.begin, logged.end)
