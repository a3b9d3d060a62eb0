"""PETSc options of a scene and of the command line, handed to PETSc before its first use."""

from __future__ import annotations

import contextlib
import ctypes
import itertools
import re
import shlex
import sys
import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.keys.keys import nearest
from catenary.postproc.files.disk_errors import reason

# Options that PETSc looks up when the process ends, after `idle_options` was called.
_LOOKED_UP_LAST = frozenset(
    {"citations", "get_total_flops", "malloc_view_threshold", "options_left", "options_view"}
)
# Options outside of a scene's table that a misspelt one may stand for.
_OTHER_OPTIONS = (
    "march_ts_max_steps", "march_ts_max_time", "march_ts_monitor", "march_ts_monitor_solution",
    "march_ts_view", "march_ksp_view",
    "march_ksp_monitor", "march_ksp_converged_reason", "log_view", "log_view_memory", "log_trace",
    "options_left", "options_view", "malloc_debug", "malloc_dump", "malloc_view", "memory_view",
)  # fmt: skip

# PETSc is a module before it has started: another thread that asked for options crashed.
_starting = threading.Lock()
# Kinds of output that PETSc has at the end of a run, when no error can be refused any more.
_VIEWERS = {
    "-log_view": ("", "ascii"),
    "-march_ts_view": ("", "ascii", "binary", "draw", "hdf5", "socket", "string", "vtk"),
}


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


def refuse_unwritable(arguments: Sequence[str]) -> None:
    """Refuse output of PETSc that it would find impossible when the run is made. Not collective.

    Its viewers are named KIND:FILE:FORMAT, each of which may be left out.

    Raises
    ------
    InputError
        If a file cannot be written, or if there is no output of such a kind.
    """
    for name, value in itertools.pairwise(arguments):
        kind, colon, rest = value.partition(":")
        if not name.startswith("-") or value.startswith("-"):
            continue
        if kind not in _VIEWERS.get(name, (kind,)):
            raise InputError(f"{name} {shown(value)[1:-1]} names no file; write {name} :FILE")
        path = Path(rest.partition(":")[0])
        if not colon or path == Path() or not re.search("_(view|monitor)", name):
            continue
        is_new = not path.exists()
        try:
            path.open("ab").close()
        except OSError as error:
            raise InputError(f"{name} cannot write {path}: {reason(error)}") from error
        if is_new:
            path.unlink()


def start_petsc(arguments: Sequence[str]) -> None:
    """Start PETSc with these options and without options files of its own. Collective.

    If PETSc runs already, which happens only inside other Python programs, they are added.

    Raises
    ------
    InputError
        On all ranks, if an option keeps PETSc from starting.
    """
    import petsc4py

    from catenary.base.process import mpi_settings, python_signals_kept

    running = "petsc4py.PETSc" in sys.modules
    try:
        with python_signals_kept(), mpi_settings():
            petsc4py.init(["catenary", "-skip_petscrc", *arguments])
    except RuntimeError as error:  # an error of PETSc, which prints its cause by itself
        raise InputError(
            "PETSc does not start with its options, those after -- and in PETSC_OPTIONS: its "
            f"message above names the fault ({error})"
        ) from error
    from catenary.base.petsc import PETSc

    if running and arguments:
        PETSc.Options().insertString(shlex.join(arguments))


@contextlib.contextmanager
def options_of(table: Mapping[str, Any]) -> Iterator[list[str]]:
    """PETSc with the options of a scene's table, as words, while entered. Collective.

    For programs that run several scenes: what the table changed is as before afterwards.
    """
    before = {}
    with _starting:
        if "petsc4py.PETSc" in sys.modules:
            from catenary.base.petsc import PETSc

            before = PETSc.Options().getAll()
        arguments = as_arguments(table)
        start_petsc(arguments)
    try:
        yield arguments
    finally:
        from catenary.base.petsc import PETSc

        for name in table:
            PETSc.Options().delValue(name)
            if name in before:
                PETSc.Options().setValue(name, before[name])


def idle_names() -> set[str]:
    """The options that PETSc holds and never looked up. Not collective.

    PetscOptionsUsed is public in ``petscoptions.h``, and called through ctypes: petsc4py 3.18 lacks
    ``Options.used``, which newer versions have.
    """
    from catenary.base.petsc import PETSc

    library = ctypes.CDLL(PETSc.__file__)
    names = set()
    for name in PETSc.Options().getAll().keys() - _LOOKED_UP_LAST:
        used = ctypes.c_int(0)  # a PetscBool: an int, or one byte in newer versions
        library.PetscOptionsUsed(None, name.encode(), ctypes.byref(used))
        if not used.value:
            names.add(name)
    return names


def look_up_all_but(idle: Collection[str]) -> None:
    """Mark options that another process has used as used in PETSc. Not collective."""
    from catenary.base.petsc import PETSc

    for name in PETSc.Options().getAll().keys() - set(idle):
        PETSc.Options().hasName(name)


def idle_options(of_scene: Collection[str]) -> list[str]:
    """A sentence for each option that PETSc holds and never looked up, such as a misspelt one.

    Not collective.

    Parameters
    ----------
    of_scene : names of the scene's ``[petsc]`` table, which has correct names alone; no sentence
        is made of them
    """
    from catenary.cases.scene.run.numerics import PetscTable

    known = [*PetscTable.model_fields, *_OTHER_OPTIONS]
    sentences = []
    for name in sorted(idle_names() - set(of_scene)):
        near = None if name in known else nearest(name, known)
        hint = f"; did you mean -{near}?" if near else ""
        sentences.append(f"the option -{name} had no effect: PETSc never looked it up{hint}")
    return sentences
