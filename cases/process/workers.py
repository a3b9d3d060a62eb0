"""Independent items of work side by side: in processes of their own, or one on each rank of MPI.

A process is a Python of its own and no fork, in which MPI and PETSc start as where no launcher has
started one. The pool of ``concurrent.futures`` is given up when one of its processes dies, and
knows no end in good order; here a process that dies costs the item that it had, and a signal to
this process ends all others in good order.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, TypeVar

from catenary.base.errors import CatenaryError, InputError, RunBroken
from catenary.base.options import command_line, is_command_line, option
from catenary.base.parallel import NO_MEMORY, launched_by_mpirun, wait_for_all
from catenary.base.process import alone
from catenary.cases.process import interrupts, libraries
from catenary.cases.process.interrupts import StopRequest

T = TypeVar("T")

# Wall time between two looks whether a signal came [s], and how long a process may take to end in
# good order before it is killed [s]: a step, a flush, and what a library does without a look.
_LOOK, _GRACE = 0.1, 30.0
# Variables by which a launcher tells a process that it is a rank.
_OF_LAUNCHERS = ("OMPI_", "PMI_", "PMIX_", "PRTE_", "HYDI_", "MPIR_")
# Of messages between ranks.
_TAG = 4711
_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from catenary.cases.process.workers import serve; serve(*map(int, sys.argv[2:]))"
)


class WorkerLost(RunBroken):
    """The process that had an item ended without a result, as by a signal or a crash."""


class Outcome(NamedTuple):
    """Result of an item.

    Attributes
    ----------
    number : place of the item among all, from 0 on
    value : result of the function, None if it raised an error
    error : the error that it raised, or the loss of its process; None without one
    """

    number: int
    value: Any = None
    error: CatenaryError | None = None

    def get(self) -> Any:
        """The result; raises the error if there is one."""
        if self.error is not None:
            raise self.error
        return self.value


def cores() -> int:
    """Number of cores that this process may use. Not collective."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def at_once(wanted: int, comm: Any) -> int:
    """Number of items that are worked on at the same time. Not collective.

    Parameters
    ----------
    wanted : 0 for as many as there are cores or ranks
    comm : mpi4py communicator

    Raises
    ------
    InputError
        If there are several ranks and ``wanted`` is neither 1 nor their number.
    """
    n_ranks = comm.size
    if n_ranks == 1:
        return wanted or cores()
    if wanted not in (0, 1, n_ranks):
        raise InputError(
            f"{option('-j', 'jobs')} is {wanted} on {n_ranks} ranks; give "
            f"{option(f'-j {n_ranks}', f'jobs={n_ranks}')}, with which each rank makes runs of its "
            f"own, or no {option('-j', 'jobs')}, with which all ranks share each run"
        )
    return wanted or n_ranks


def each(
    function: Callable[[T, Any], Any],
    items: Iterable[T],
    n_at_once: int,
    comm: Any,
    initialise: Callable[[], object] | None = None,
) -> Generator[Outcome, None, None]:
    """Results of ``function(item, comm)`` for all items, as they come. Collective.

    With ``n_at_once`` 1 all ranks together work on each item. With more, that number of processes
    is started, or each of as many ranks takes every n-th item; ``function`` then gets a
    communicator of one rank. Processes draw an item when they begin it, ranks draw all at once. An
    error of the program and a lost process are the outcome of their item. A signal ends the items
    under way and no further item begins: there are fewer outcomes than items. Closing the generator
    does the same, except on other ranks.

    Parameters
    ----------
    function : to be pickled for other processes, once for each, so that it may keep in itself
        what it needs for all items
    items : to be pickled, and so are the results
    n_at_once : of ``at_once``
    comm : mpi4py communicator
    initialise : called once in each further process, before MPI starts there

    Raises
    ------
    RuntimeError
        If ``function`` raised an error that is not foreseen; all processes are ended first.
    """
    if n_at_once == 1:
        for number, item in enumerate(items):
            yield _outcome(number, function, item, comm)
    elif comm.size > 1:
        yield from _on_ranks(function, list(items), comm)
    else:
        with Pool(n_at_once, function, initialise) as pool:
            yield from pool.of(items)


def in_order(outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """Outcomes in the order of their items, each as soon as all before it are there."""
    early: dict[int, Outcome] = {}
    following = 0
    for outcome in outcomes:
        early[outcome.number] = outcome
        while following in early:
            yield early.pop(following)
            following += 1
    for number in sorted(early):  # behind those that a signal has ended
        yield early[number]


def _outcome(number: int, function: Callable[[T, Any], Any], item: T, comm: Any) -> Outcome:
    try:
        return Outcome(number, function(item, comm))
    except CatenaryError as error:
        return Outcome(number, error=error)


def _on_ranks(
    function: Callable[[T, Any], Any], items: Sequence[T], comm: Any
) -> Iterator[Outcome]:
    """Every rank its share. Collective.

    Results come to rank 0 as they are. All else comes when all is there, so that an error, which
    may end a rank, ends them all.
    """
    found: list[Outcome] = []
    with StopRequest() as stop:
        own = _share(function, items, comm, stop)
        if comm.rank == 0:
            for outcome in _gathered(own, comm):
                found.append(outcome)
                if outcome.error is None:
                    yield outcome
        else:
            sent = [comm.isend(outcome, 0, _TAG) for outcome in own]
            sent.append(comm.isend(None, 0, _TAG))
            while not all([request.test()[0] for request in sent]):
                time.sleep(_LOOK)
        wait_for_all(comm)
        found = comm.bcast(found, 0)
    yield from (one for one in found if comm.rank or one.error is not None)


def _share(
    function: Callable[[T, Any], Any], items: Sequence[T], comm: Any, stop: Callable[[], bool]
) -> Iterator[Outcome]:
    """Outcomes of the items of this rank. Not collective."""
    from catenary.base.mpi import MPI

    for number in range(comm.rank, len(items), comm.size):
        if stop():
            return
        yield _outcome(number, function, items[number], MPI.COMM_SELF)


def _gathered(own: Iterator[Outcome], comm: Any) -> Iterator[Outcome]:
    """Outcomes of all items, on rank 0: its own, and between them those that others send."""
    n_working = comm.size - 1
    mine: Outcome | None = next(own, None)
    while mine is not None or n_working:
        if mine is not None:
            yield mine
            mine = next(own, None)
        elif not comm.iprobe(tag=_TAG):
            time.sleep(_LOOK)
        while comm.iprobe(tag=_TAG):
            theirs = comm.recv(tag=_TAG)
            n_working -= theirs is None
            if theirs is not None:
                yield theirs


class Pool(Generic[T]):
    """Processes that last from one series of items to the next. A context manager; not collective.

    Parameters
    ----------
    n : how many there are at most; they start when there is work
    function, initialise : as of ``each``
    """

    def __init__(
        self,
        n: int,
        function: Callable[[T, Any], Any],
        initialise: Callable[[], object] | None = None,
    ) -> None:
        self.n = n
        self._function, self._initialise = function, initialise
        self._idle: list[_Process] = []

    def of(self, items: Iterable[T]) -> Iterator[Outcome]:
        """Results of the function for all items, as of ``each``."""
        left = enumerate(items)
        busy: list[_Process] = []
        gone: list[_Process] = []
        more, stopped_at = True, 0.0
        try:
            with StopRequest() as stop:
                while True:
                    while more and not stop() and len(busy) < self.n:
                        number, item = next(left, (-1, None))
                        more = number >= 0
                        if more:
                            busy.append(self._process())
                            busy[-1].begin(number, item)
                    if not busy:
                        return
                    if stop() and not stopped_at:
                        stopped_at = time.monotonic()
                        for one in busy:
                            one.stop()
                    if stopped_at and time.monotonic() > stopped_at + _GRACE:
                        return
                    ready = wait([one.connection for one in busy], _LOOK)
                    for one in [one for one in busy if one.connection in ready]:
                        outcome = one.received()
                        if outcome is None:  # a line of its log
                            continue
                        busy.remove(one)
                        (self._idle if one.goes_on else gone).append(one)
                        if not (stopped_at and isinstance(outcome.error, WorkerLost)):
                            yield outcome
        finally:
            for one in busy:
                one.stop()
            _end((*busy, *gone), stopped_at)

    def _process(self) -> _Process:
        """Return an idle process, or a new one."""
        self._idle = [one for one in self._idle if one.is_there()]
        return self._idle.pop() if self._idle else _Process(self._initialise, self._function)

    def __enter__(self) -> Pool[T]:
        return self

    def __exit__(self, *error: object) -> None:
        _end(self._idle)


def _end(processes: Sequence[_Process], stopped_at: float = 0.0) -> None:
    """Wait for the end of processes that were stopped at a time of the monotonic clock [s]."""
    last = (stopped_at or time.monotonic()) + _GRACE
    for one in processes:
        one.end(last)


class _Process:
    """A process that works on items, one after the other. Not collective.

    It ends by itself when this process ends, whatever ended it.
    """

    def __init__(
        self, initialise: Callable[[], object] | None, function: Callable[[Any, Any], Any]
    ) -> None:
        self._number = -1
        self.goes_on = True
        self.connection, theirs = Pipe()
        alive, self._life = os.pipe()
        words = [json.dumps(sys.path), str(theirs.fileno()), str(alive)]
        self.process = subprocess.Popen(
            [sys.executable, "-I", "-c", _PROGRAM, *words],
            stdin=subprocess.DEVNULL,
            pass_fds=(theirs.fileno(), alive),
            env=_environment(),
            start_new_session=True,  # Ctrl-C comes to this process alone, which ends the other once
        )
        theirs.close()
        os.close(alive)
        level = logging.getLogger("catenary").getEffectiveLevel()
        self._send((level, is_command_line(), initialise, function))

    def is_there(self) -> bool:
        """Whether it has not ended while it had nothing to do."""
        return self.process.poll() is None

    def begin(self, number: int, item: Any) -> None:
        """Hand it an item."""
        self._number = number
        self._send(item)

    def _send(self, message: Any) -> None:
        with contextlib.suppress(ConnectionError):  # its end is found when its answer is read
            self.connection.send(message)

    def received(self) -> Outcome | None:
        """The outcome of its item, None if a line of its log has come.

        Raises
        ------
        RuntimeError
            If an error came that is not foreseen.
        """
        try:
            kind, what, self.goes_on = self.connection.recv()
        except (EOFError, OSError):  # at once, or in the middle of its answer
            self.goes_on = False
            self.process.wait()
            return Outcome(self._number, error=WorkerLost(self._how_it_ended()))
        if kind == "log":
            logging.getLogger(what.name).handle(what)
            return None
        if kind == "bug":
            raise RuntimeError(f"a process failed with item {self._number}:\n{what}")
        return Outcome(self._number, **{kind: what})

    def _how_it_ended(self) -> str:
        code = self.process.returncode
        if code >= 0:
            return f"its process ended by itself with code {code}"
        memory = ", as where no memory is left" if code == -signal.SIGKILL else ""
        return f"its process was ended by {signal.Signals(-code).name}{memory}"

    def stop(self) -> None:
        """Ask it to end its work in good order."""
        if self._life >= 0:
            os.close(self._life)
            self._life = -1

    def end(self, last: float) -> None:
        """Wait for its end until a time of the monotonic clock [s]; then kill it."""
        self.connection.close()  # an idle one ends by that
        try:
            self.process.wait(max(0.0, last - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.stop()


def _environment() -> dict[str, str]:
    """Variables for a process that is no rank of a launcher that started this one."""
    launched = launched_by_mpirun()
    return {
        name: value
        for name, value in os.environ.items()
        if not (launched and name.startswith(_OF_LAUNCHERS))
    }


# ---- in a further process ----------------------------------------------------------------------


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
        self._interrupted = StopRequest()

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
