"""The program ``catenary``: all verbs, the process around them, exit codes."""

from __future__ import annotations

import logging
import os
import sys
from typing import Any

import typer

from catenary.cases.cli import app as application
from catenary.cases.cli import run  # noqa: F401  (adds its verbs)
from catenary.cases.process import interrupts, libraries
from catenary.cases.terminal import console

# Verbs of ``run``. They take no other file: a user waits for the first step of a run.
_OF_RUN = frozenset({"run", "restart", "submit"})
_OF_HELP = frozenset({"-h", "--help"})


def all_verbs() -> typer.Typer:
    """The application with all verbs."""
    # Each of these files adds its verbs, in this order of --help.
    # isort: off
    from catenary.cases.cli import preparation, results, variants, questions  # noqa: F401
    from catenary.cases.cli import verification, responses, first_steps  # noqa: F401

    # isort: on
    return application.app


def __getattr__(name: str) -> Any:
    """``app``: the application with all verbs, whose files are loaded when it is asked for."""
    if name == "app":
        return all_verbs()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _complain_of_usage(error: Any) -> None:
    """A mistake in the options in one sentence; for a command without any word its help."""
    context = getattr(error, "ctx", None)
    if type(error).__name__ == "NoArgsIsHelpError":
        if console.speaks():
            error.show()
        return
    sentence = error.format_message().rstrip(".")
    if context is not None:
        command = context.command_path
    else:  # an option without its value
        command = " ".join(["catenary", *(word for word in sys.argv[1:2] if word[:1] != "-")])
    sentence = sentence.replace(". Did you mean", "; did you mean")
    console.complain(f"{sentence}{' ' if sentence[-1] == '?' else '; '}see `{command} --help`")


def main() -> None:
    """Entry point. Exit codes: 0 done, 1 the run broke, 2 bad input, 3 not accepted (--strict)."""
    from catenary.base.parallel import launched_by_mpirun

    console.open_closed_streams()
    libraries.choose_settings()
    logging.getLogger("catenary").addHandler(console.LogHandler())
    interrupts.install(several_ranks=launched_by_mpirun())
    libraries.choose_matplotlib_folder()
    libraries.leave_out_matplotlibrc()
    if too_little := libraries.too_little_memory():
        console.complain(too_little)
        sys.exit(console.BAD_INPUT)
    try:
        os.getcwd()
    except OSError:
        console.complain("the working directory is gone; change into one that is there")
        sys.exit(console.BAD_INPUT)
    if launched_by_mpirun():
        # From here on the end of each rank waits for the others', so that a sentence of rank 0
        # is out before the launcher gets the exit code of another.
        if len(set(console.world().allgather(tuple(sys.argv[1:])))) > 1:
            # They would wait for each other without end.
            console.complain("the processes of mpirun have different words: give all the same")
            sys.exit(console.BAD_INPUT)
    is_run = bool(_OF_RUN.intersection(sys.argv[1:2]))
    app = application.app if is_run else all_verbs()
    command: Any = typer.main.get_command(application.narrowed(app, sys.argv[1:]))
    try:
        code = command(prog_name="catenary", standalone_mode=False)
    except interrupts.Stopped as stopped:
        console.complain(f"interrupted by {stopped.name}")
        sys.stdout.flush()
        sys.stderr.flush()
        # Unfinished objects hold some of PETSc, which is not to free them half made.
        os._exit(console.BROKEN)
    except typer.Abort:
        code = console.BROKEN
    except OSError as error:
        # The output of --version, and that of --help by typer.
        if not isinstance(error, console.OutputLost) and not _OF_HELP.intersection(sys.argv):
            raise
        code = console.report_lost_output(error)
    except Exception as error:
        if not hasattr(error, "format_message") or not hasattr(error, "exit_code"):
            raise
        _complain_of_usage(error)
        code = console.BAD_INPUT
    sys.exit(code if isinstance(code, int) else console.DONE)
