"""Programs that call: their processes, folders that pass, and what they are shown."""

from __future__ import annotations

import logging
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.base.lone_process import alone, world
from catenary.base.parallel import launched_by_mpirun, on_root

_PROGRESS = "catenary.progress"


def communicator(comm: Any) -> Any:
    """The communicator that is given, else of all processes under mpirun, else of this one."""
    if comm is not None:
        return comm
    return world() if launched_by_mpirun() else alone()


@contextmanager
def temporary_folder(comm: Any, what: str) -> Iterator[Path]:
    """A folder of rank 0 that all know, removed at the end. Collective."""
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
    if not isinstance(jobs, int) or jobs < 0:
        raise InputError(
            f"jobs is {jobs!r}; it is a number of processes, or 0 for one on each core"
        )
    return jobs


def listed(names: str | Sequence[str]) -> list[str]:
    """Names of an argument, where a text is one name and not one for each of its letters."""
    return [names] if isinstance(names, str) else list(names)


def say_nothing(text: str) -> None:
    """Say nothing."""


def say_on_error_stream(text: str) -> None:
    """Print a line to standard error."""
    print(text, file=sys.stderr)
