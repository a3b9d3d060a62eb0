"""PETSc, started without options files. Every module takes PETSc from here.

PETSc by itself reads ``.petscrc`` and ``petscrc`` in the working directory, which may be the folder
of somebody else's case, and ``~/.petscrc``; an option in there can run a program.
"""

from __future__ import annotations

import sys

import petsc4py

from catenary.base.python_signals import python_signals_kept

with python_signals_kept():
    if "petsc4py.PETSc" not in sys.modules:
        # An argument, as PETSc looks for the files before it reads the variable PETSC_OPTIONS.
        petsc4py.init(["catenary", "-skip_petscrc"])
    from petsc4py import PETSc  # starts PETSc unless it runs

__all__ = ["PETSc"]
