"""PETSc, started without options files, and its events. Every module takes PETSc from here.

PETSc by itself reads ``.petscrc`` and ``petscrc`` in the working directory, which may be the folder
of somebody else's case, and ``~/.petscrc``; an option in there can run a program.
"""

from __future__ import annotations

import sys

import petsc4py

from catenary.base.process import mpi_settings, python_signals_kept

with python_signals_kept(), mpi_settings():  # PETSc starts MPI unless it runs
    if "petsc4py.PETSc" not in sys.modules:
        # An argument, as PETSc looks for the files before it reads the variable PETSC_OPTIONS.
        petsc4py.init(["catenary", "-skip_petscrc"])
    from petsc4py import PETSc  # starts PETSc unless it runs

__all__ = ["EVENTS", "PETSc", "event"]

# Events of a step, names as -log_view prints them, in the order of a step, and what they hold.
EVENTS = {
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


def event(name: str) -> PETSc.LogEvent:
    """The event of a name of ``EVENTS``; one event for each name. Not collective.

    An event that is not logged costs less than a tenth of a microsecond.
    """
    return PETSc.Log.Event(name)
