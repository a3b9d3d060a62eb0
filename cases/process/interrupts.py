"""Signals that end a run in good order, in every phase of it.

The first one is remembered while the march goes on, which then ends with its next step. In other
phases it ends the work on one rank at once, and on several when all ranks have come to the same
place, or by aborting all. The second one ends the process, or in another Python program does what
its own handler does.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, TypeVar

from catenary.base.errors import RunBroken

T = TypeVar("T")

# Ctrl-C, kill, a lost connection, what batch systems send before a limit is reached.
NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU")
STOPPING = tuple(getattr(signal, name) for name in NAMES if hasattr(signal, name))
# A terminal that closes and its shell both send a SIGHUP: a signal that is repeated within this
# time is the same wish [s]. Not so Ctrl-C, which a person repeats.
_SAME = 0.5


class Stopped(BaseException):
    """A signal that ends the process. No library takes it for an error of its own."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.name = signal.Signals(number).name


class Interrupted(RunBroken):
    """A signal ended a run before or after its march; the same on all ranks."""


class _Wish(threading.local):
    """The signal that came first, and what the next one is to do.

    Python calls handlers in the main thread alone: runs in other threads neither see its signals
    nor change what they do.
    """

    def __init__(self) -> None:
        self.number = 0
        self.at = 0.0
        self.remembering = 0
        self.installed = False
        self.several_ranks = False
        self.before: dict[int, Any] = {}  # handlers of another program, back after its run


_wish = _Wish()


def install(several_ranks: bool) -> None:
    """Handle signals from here to the end of the process. Not collective.

    ``several_ranks`` says whether other processes may wait for this one: a signal outside of the
    phases of a run then aborts them all. A signal that is ignored, as SIGHUP under nohup or SIGINT
    in the background of a script, stays so.
    """
    _wish.installed, _wish.several_ranks = True, several_ranks
    for number in STOPPING:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _handle)


def _handle(number: int, frame: FrameType | None) -> None:
    if _wish.number:
        repeated = number == _wish.number != signal.SIGINT
        if repeated and time.monotonic() - _wish.at < _SAME:
            return
        signal.signal(number, _wish.before.get(number, signal.SIG_DFL))
        os.kill(os.getpid(), number)
        return
    _wish.number, _wish.at = number, time.monotonic()
    if _wish.remembering:
        return
    if _wish.several_ranks and "mpi4py.MPI" in sys.modules:
        from catenary.base.mpi import MPI
        from catenary.cases.terminal import console

        console.complain(f"interrupted by {signal.Signals(number).name}")
        MPI.COMM_WORLD.Abort(1)
    raise Stopped(number)


@contextlib.contextmanager
def _remembered() -> Iterator[None]:
    _wish.remembering += 1
    try:
        yield
    finally:
        _wish.remembering -= 1


@contextlib.contextmanager
def _raised() -> Iterator[None]:
    before, several = _wish.remembering, _wish.several_ranks
    _wish.remembering, _wish.several_ranks = 0, False
    try:
        yield
    finally:
        _wish.remembering, _wish.several_ranks = before, several


class Phase:
    """A part of a run other than the march, which a signal ends with a sentence.

    A context manager, collective to enter, to leave, and at each ``next``. On one rank a signal
    ends the phase where it is, on several at the next of these places, or where rank 0 works alone
    (``alone``).

    Parameters
    ----------
    comm : mpi4py communicator
    doing : sentence on the first work, as in "the mesh was made"
    left : sentence on the remains of an interruption
    """

    def __init__(self, comm: Any, doing: str, left: str) -> None:
        self._comm = comm
        self._doing = doing
        self._left = left
        self._scope = _raised() if comm.size == 1 else _remembered()

    def next(self, doing: str) -> None:
        """Name what is done from here on. Collective; raises ``Interrupted`` on all ranks."""
        self._agree()
        self._doing = doing

    def alone(self, work: Callable[[], T]) -> Callable[[], T]:
        """``work``, for ``on_root``, which a signal to rank 0 ends where it is."""

        def interruptible() -> T:
            try:
                with _raised():
                    if _wish.number:
                        raise Stopped(_wish.number)
                    return work()
            except Stopped as stopped:
                raise self._interrupted(stopped.name) from None

        return interruptible

    def __enter__(self) -> Phase:
        self._agree()
        self._scope.__enter__()
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._scope.__exit__(None, None, None)
        if isinstance(error, Stopped):
            raise self._interrupted(error.name) from None
        if error is None:
            self._agree()

    def _agree(self) -> None:
        """Raise ``Interrupted`` on all ranks if a signal came to any. Collective."""
        number = _wish.number
        if self._comm.size > 1:
            number = max(self._comm.allgather(number))
        if number:
            raise self._interrupted(signal.Signals(number).name)

    def _interrupted(self, name: str) -> Interrupted:
        return Interrupted(f"interrupted by {name} while {self._doing}; {self._left}")


class StopRequest:
    """While entered, the first signal is remembered and ends nothing by itself.

    Not collective: the march carries the wish to all ranks. Where no handlers are installed, as in
    other Python programs, they are while this is entered, in the one thread that may have some.
    """

    def __init__(self) -> None:
        self._installed = False
        self._scope = _remembered()

    def __call__(self) -> bool:
        """Whether a signal came."""
        return bool(_wish.number)

    def __enter__(self) -> StopRequest:
        self._scope.__enter__()
        if not _wish.installed and threading.current_thread() is threading.main_thread():
            _wish.before = {number: signal.getsignal(number) for number in STOPPING}
            self._installed = True
            install(several_ranks=False)
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self._installed:
            for number, handler in _wish.before.items():
                signal.signal(number, handler)
            _wish.before, _wish.installed, _wish.number = {}, False, 0
        self._scope.__exit__(None, None, None)
