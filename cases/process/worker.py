"""A further process of ``workers``: what runs in it."""

from __future__ import annotations

import logging
import os
import signal
import threading
import traceback
import warnings
from multiprocessing.connection import Connection
from typing import Any

from catenary.base.errors import CatenaryError, RunBroken
from catenary.base.options import command_line
from catenary.base.parallel import NO_MEMORY
from catenary.base.process import alone
from catenary.cases.process import interrupts, libraries


def serve(connection_number: int, life_number: int) -> None:
    """Work on the items that come until there are no more. Not collective.

    Parameters
    ----------
    connection_number, life_number : descriptors of the connection to the process that started this
        one, and of a pipe that it holds open as long as this one is to live
    """
    libraries.choose_settings()
    libraries.choose_matplotlib_folder()
    libraries.leave_out_matplotlibrc()
    # A signal amid the work of Pydantic's serializer is an error to it, of which it warns.
    warnings.filterwarnings("ignore", message="Pydantic serializer warnings")
    interrupts.install(several_ranks=False)
    threading.Thread(target=_end_with, args=(life_number,), daemon=True).start()
    try:
        _work(_Answers(Connection(connection_number)))
    except (EOFError, ConnectionError):
        return
    except interrupts.Stopped:
        os._exit(1)  # objects of PETSc that are half made are not to be freed


def _end_with(life_number: int) -> None:
    """Send this process SIGTERM when the one that started it wants that, or has ended."""
    os.read(life_number, 1)
    os.kill(os.getpid(), signal.SIGTERM)


def _work(answers: _Answers) -> None:
    """Take items and answer each, until a signal has come."""
    connection = answers.connection
    try:
        level, names_options, initialise, function = connection.recv()
        _set_up_logging(answers, level)
        with command_line(names_options):
            if initialise is not None:
                initialise()
            comm = alone()
            while answers.goes_on:
                item = connection.recv()
                try:
                    answers.send("value", function(item, comm))
                except CatenaryError as error:
                    answers.send("error", error)
                except MemoryError:
                    answers.send("error", RunBroken(NO_MEMORY))
    except (EOFError, ConnectionError):
        raise
    except Exception:
        answers.send("bug", traceback.format_exc())


class _Answers(logging.Handler):
    """Results and log records, sent to the process that writes them."""

    def __init__(self, connection: Connection) -> None:
        super().__init__()
        self.connection = connection
        self.goes_on = True
        self._one_at_a_time = threading.Lock()
        self._interrupted = interrupts.StopRequest()

    def send(self, kind: str, what: Any) -> None:
        """Not collective. After a signal, which ended an item in good order, no other is taken."""
        with self._one_at_a_time:
            self.goes_on = not self._interrupted()
            self.connection.send((kind, what, self.goes_on))

    def emit(self, record: logging.LogRecord) -> None:
        """Not collective."""
        record.msg, record.args, record.exc_info = record.getMessage(), None, None
        self.send("log", record)


def _set_up_logging(answers: _Answers, level: int) -> None:
    root = logging.getLogger("catenary")
    root.addHandler(answers)
    root.propagate = False
    root.setLevel(level)
    # Several runs show no bars at once.
    logging.getLogger("catenary.progress").setLevel(max(level, logging.WARNING))
