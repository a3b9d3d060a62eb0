"""Terminal output on rank 0, errors of one sentence, exit codes."""

from __future__ import annotations

import errno
import functools
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import typer

from catenary.base.errors import CatenaryError, InputError
from catenary.base.options import command_line
from catenary.base.parallel import NO_MEMORY, launched_by_mpirun, on_root
from catenary.base.process import alone as alone
from catenary.base.process import world as world
from catenary.cases.scene.input.plain_text import plain, shown
from catenary.postproc.evaluate.wording import folded, terminal_width
from catenary.postproc.files.disk_errors import reason

DONE, BROKEN, BAD_INPUT, NOT_ACCEPTED = 0, 1, 2, 3
_RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")
_quiet = False  # whether the present verb has this option
# Calls at the end of the verb that runs, which print what it has left to say.
_last_words: list[Callable[[], None]] = []


def at_end(print_last: Callable[[], None]) -> None:
    """Call ``print_last`` when the present verb has come to its end without an error.

    Not collective.
    """
    _last_words.append(print_last)


# When this module was loaded, where the system does not say when the process started.
_LOADED = time.perf_counter()


def waited() -> float:
    """Wall time since this process started [s]. Not collective."""
    try:
        # The name of the program, which may hold spaces, stands in brackets.
        fields = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        ticks = os.sysconf("SC_CLK_TCK")
        return time.clock_gettime(time.CLOCK_BOOTTIME) - int(fields[19]) / ticks
    except (AttributeError, IndexError, OSError, ValueError):
        return time.perf_counter() - _LOADED


class OutputLost(OSError):
    """Standard output cannot be written to."""


def speaks() -> bool:
    """Whether this process is the one that prints: rank 0, or the only one. Not collective."""
    return all(os.environ.get(name, "0") == "0" for name in _RANK_VARIABLES)


def is_quiet() -> bool:
    """Whether the verb that runs prints nothing but errors. Not collective."""
    return _quiet


def say(text: str, *, whole: bool = False) -> None:
    """Print to standard output on rank 0, unless the verb is to be quiet. Not collective.

    Titles and names out of files of strangers do not steer the terminal: what would is escaped.
    Sentences are folded at the width of a terminal, but not of text that is to stay ``whole``.
    """
    if speaks() and not _quiet:
        print_as_is(folded(shown(text), None if whole else terminal_width()) + "\n")


def print_as_is(text: str) -> None:
    """Print to standard output what the user is to get to the letter. Not collective.

    Raises
    ------
    OutputLost
        If it cannot be written to, as on a full disk or where the reader of a pipe has gone.
    """
    try:
        typer.echo(text, nl=False)
    except OSError as error:
        raise OutputLost(error.errno, error.strerror) from error


def complain(sentence: str) -> None:
    """Print one sentence to standard error on rank 0. Not collective."""
    if speaks():
        _print_error("catenary: ", sentence)


def warn(sentence: str) -> None:
    """Print a warning to standard error on rank 0, unless quiet. Not collective."""
    if speaks() and not _quiet:
        _print_error("WARNING ", sentence)


def _print_error(head: str, sentence: str) -> None:
    """Print a sentence to standard error; where that cannot be written to nobody hears it."""
    line = head + plain(" ".join(sentence.split()))
    try:
        typer.echo(folded(line, terminal_width(sys.stderr)), err=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Redirect a stream that fails to the null device: Python tries again at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """While entered, a terminal shows what is made, in a line that goes. Not collective."""
    is_shown = speaks() and not _quiet and sys.stderr.isatty()
    try:
        if is_shown:
            print(f"\r{what} ...\x1b[K", end="", file=sys.stderr, flush=True)
        yield
    finally:
        if is_shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def open_closed_streams() -> None:
    """Redirect closed standard streams to the null device. Not collective.

    The next file that is opened, such as a result file, would get the number of a closed one, and
    what libraries print would be written into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)  # the lowest number that is free, so this one
            os.set_inheritable(nowhere, True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115


def report_lost_output(error: OSError) -> int:
    """Say that standard output cannot be written to; returns the exit code. Not collective.

    Nothing is written there any more.
    """
    _discard(sys.stdout)
    if error.errno != errno.EPIPE:  # the reader of a pipe, as of `| head`, has seen enough
        complain(f"the output cannot be printed ({reason(error)})")
    return BROKEN


class LogHandler(logging.Handler):
    """Prints what the library logs as sentences on rank 0."""

    def emit(self, record: logging.LogRecord) -> None:
        """Not collective."""
        complain(record.getMessage())


def folder(text: str) -> Path:
    """The folder that an option names. Not collective.

    An empty name, such as that of a shell's variable without a value, is refused: it would stand
    for the working directory.
    """
    if not text.strip():
        raise typer.BadParameter("it is empty; name a folder, the working directory by a dot")
    return Path(text)


def guarded(command: Callable[..., int | None]) -> Callable[..., None]:
    """A command whose foreseen errors end in a sentence and an exit code, not in a traceback.

    The command returns its exit code, None for 0; with ``quiet`` it prints nothing but errors.
    Collective if the command is.
    """

    @functools.wraps(command)
    def wrapped(*args: Any, quiet: bool = False, **kwargs: Any) -> None:
        global _quiet
        _quiet = quiet
        try:
            if quiet and kwargs.get("verbose"):
                raise InputError("--quiet and --verbose exclude each other; give one of them")
            if kwargs.get("force") and kwargs.get("out", True) is None:
                raise InputError("--force replaces results in the folder of -o; give both, or none")
            with command_line():
                code = command(*args, **kwargs)
                for print_last in _last_words:
                    print_last()
        except CatenaryError as error:
            complain(str(error))
            code = error.exit_code
        except MemoryError:
            complain(NO_MEMORY)
            code = BROKEN
        except KeyboardInterrupt:
            complain("interrupted")
            code = BROKEN
        except OutputLost as error:
            code = report_lost_output(error)
        finally:
            # Of this command only: several may be called in one process.
            _quiet = False
            _last_words.clear()
        if code:
            raise typer.Exit(code)

    return wrapped


def serial(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """A command that runs on rank 0 only; under mpirun the others get its result.

    Collective under mpirun. Its error is raised on all ranks.
    """

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> int | None:
        if not launched_by_mpirun():
            return command(*args, **kwargs)
        return on_root(world(), lambda: command(*args, **kwargs), takes_long=True)

    return wrapped
