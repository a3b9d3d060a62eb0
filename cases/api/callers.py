"""Programs that call: their processes, folders that pass, and what they are shown."""

from __future__ import annotations

import errno
import logging
import operator
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.base.parallel import launched_by_mpirun, on_root
from catenary.base.process import alone, world
from catenary.cases.scene.input.faults import shown

_PROGRESS = "catenary.progress"


def communicator(comm: Any) -> Any:
    """The communicator that is given, else of all processes under mpirun, else of this one.

    Raises InputError if it is none.
    """
    if comm is not None:
        if not isinstance(getattr(comm, "rank", None), int):
            raise InputError(f"comm is {shown(comm)}; it must be a communicator of mpi4py")
        return comm
    return world() if launched_by_mpirun() else alone()


def refuse_different(comm: Any, *given: object) -> None:
    """Raise InputError on all processes unless all give the same to what they do together.

    Collective. ``given`` has texts that tell of its values. Different scenes would wait for each
    other without end, or mix.
    """
    if comm.size == 1:
        return
    own = blake2b(repr(given).encode(errors="replace")).digest()
    if len(set(comm.allgather(own))) > 1:
        raise InputError(
            "the processes of mpirun do this together, but differ in scene, values or folder: "
            "give all the same, or comm=MPI.COMM_SELF for one of each process's own"
        )


@contextmanager
def given_or_temporary(folder: Path | None, comm: Any, what: str) -> Iterator[Path]:
    """A folder, or else one of rank 0 that all know, removed at the end. Collective."""
    if folder is not None:
        yield folder
        return
    with ExitStack() as stack:

        def make() -> str:
            return stack.enter_context(tempfile.TemporaryDirectory(prefix=f"catenary_{what}_"))

        yield Path(on_root(comm, make))


@contextmanager
def progress_shown(progress: bool, comm: Any) -> Iterator[None]:
    """While entered, progress is shown on standard error on rank 0, or nowhere. Not collective."""
    logger = logging.getLogger(_PROGRESS)
    before, passed_on = logger.level, logger.propagate
    handler: logging.Handler = logging.NullHandler()
    if progress and comm.rank == 0:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO if progress else logging.WARNING)
    logger.propagate = not progress
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)
        logger.propagate = passed_on


@contextmanager
def ending_as_python() -> Iterator[None]:
    """While entered, a signal that ends a study is a KeyboardInterrupt. Not collective."""
    from catenary.cases.process.interrupts import Interrupted

    try:
        yield
    except Interrupted as stopped:
        raise KeyboardInterrupt from stopped


def n_at_once(jobs: Any) -> int:
    """The argument ``jobs`` of a function. Raises InputError if it is no number of processes."""
    with suppress(TypeError):
        if not is_truth(jobs) and (n := operator.index(jobs)) >= 0:
            return n
    raise InputError(
        f"jobs is {shown(jobs)}; it is a number of processes, or 0 for one on each core"
    )


def listed(names: str | Iterable[str], argument: str) -> list[str]:
    """Names of an argument, where a text is one name and not one for each of its letters.

    Raises InputError if it holds no names.
    """
    if isinstance(names, str):
        return [names]
    if isinstance(names, Iterable):
        found = list(names)
        if all(isinstance(name, str) for name in found):
            return found
    raise InputError(f"{argument} is {shown(names)}; it must be a name, or a list of names")


def number_of(value: Any, argument: str) -> float:
    """The number of an argument. Raises InputError if it is none, as a text is not."""
    with suppress(TypeError, ValueError):
        if not is_truth(value) and not _is_text(value):
            return float(value)
    raise InputError(f"{argument} is {shown(value)}; it must be a number")


def _is_text(value: Any) -> bool:
    return isinstance(value, str | bytes | bytearray)


def is_truth(value: Any) -> bool:
    """Whether a value, or one of a list, is true or false, which Python takes for 1 or 0."""
    if isinstance(value, list | tuple):
        return any(map(is_truth, value))
    return isinstance(value, bool) or str(getattr(value, "dtype", "")) == "bool"


def numbers_of(value: Any, argument: str) -> np.ndarray:
    """A number, shape (), or numbers. Raises InputError if they are none."""
    with suppress(TypeError, ValueError):
        given = np.asarray(value)
        # Texts such as "5", dates and truths would pass for numbers.
        is_number = given.dtype.kind in "iuf" and not is_truth(value)
        if is_number or (given.dtype.kind == "O" and not any(map(_is_text, given.flat))):
            return given.astype(float)
    raise InputError(f"{argument} is {shown(value)}; it must be a number or numbers")


def path_of(path: Any, argument: str, wanted: str = "a path") -> Path:
    """The path of an argument, where ~ is the home folder, as in a shell.

    Raises InputError if it is none; ``wanted`` says what the argument may be.
    """
    if isinstance(path, str | os.PathLike):
        text = os.fspath(path)
        if isinstance(text, str) and text:
            with suppress(RuntimeError, ValueError):  # a user whom nobody knows; null bytes, halves
                found = Path(text).expanduser()
                if _can_be(found):
                    return found
    raise InputError(f"{argument} is {shown(path)}; it must be {wanted}")


def _can_be(path: Path) -> bool:
    """Whether a file may have this name, be it there or not; ValueError if no file ever has."""
    try:
        path.lstat()
    except OSError as error:
        return error.errno != errno.ENAMETOOLONG
    return True


def folder_of(out: Any) -> Path | None:
    """The folder ``out`` of a function, None if nothing is to be written. InputError as above."""
    return None if out is None else path_of(out, "out")


def saying(progress: bool) -> Callable[[str], None]:
    """Prints lines to standard error, or none without ``progress``."""
    return lambda text: print(text, file=sys.stderr) if progress else None
