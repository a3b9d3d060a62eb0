"""PETSc options of a scene and of the command line, handed to PETSc before its first use."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from catenary.cases.scene.input.origin import shown
from catenary.solver.base.errors import InputError


def split_extras(extras: Sequence[str]) -> tuple[list[str], list[str]]:
    """Further ``key=value`` assignments and the PETSc options among trailing arguments.

    Several assignments may follow one ``--set``; everything from the first word with a dash on is
    PETSc's.

    Raises
    ------
    InputError
        If a word is neither.
    """
    first_option = next((i for i, word in enumerate(extras) if word.startswith("-")), len(extras))
    assignments, options = list(extras[:first_option]), list(extras[first_option:])
    for word in assignments:
        if "=" not in word:
            raise InputError(
                f"{shown(word)} on the command line is neither key=value nor a PETSc option "
                "after -- (which begins with a dash)"
            )
    return assignments, options


def as_arguments(table: Mapping[str, Any], command_line: Sequence[str] = ()) -> list[str]:
    """The words of all PETSc options: the scene's ``[petsc]`` table, then the command line's.

    PETSc lets the later one win. ``true`` stands for an option without a value.
    """
    words: list[str] = []
    for name, value in table.items():
        words.append(f"-{name}")
        if value is False:
            words.append("false")
        elif value is not True:
            words.append(str(value))
    return words + list(command_line)


def start_petsc(arguments: Sequence[str]) -> None:
    """Start PETSc with these options and without options files. Collective.

    If PETSc runs already, which happens only inside other Python programs, they are added.
    """
    import petsc4py

    from catenary.solver.base.python_signals import python_signals_kept

    running = "petsc4py.PETSc" in sys.modules
    with python_signals_kept():
        petsc4py.init(["catenary", "-skip_petscrc", *arguments])
    from catenary.solver.base.petsc import PETSc

    if running and arguments:
        PETSc.Options().insertString(shlex.join(arguments))
