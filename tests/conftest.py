"""Lets tests import what they share, the modules of ``tests/support``, by their plain names."""

from __future__ import annotations

import contextlib
import gc
import getpass
import io
import logging
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import settings

# Files to begin with, as cores become free: those that take longest, so that none is left to one
# core at the end.
FIRST = (
    "regression/test_documents.py",
    "regression/test_petsc_options.py",
    "regression/test_interruption.py",
    "regression/test_hostile_results.py",
    "regression/test_signals.py",
    "unit/test_full_report.py",
    "unit/test_optimise.py",
    "regression/test_sampled_sweeps.py",
    "regression/test_fuzz_damage.py",
    "unit/postproc/test_film.py",
)

# Hypothesis draws the same examples for everybody: what fails in one place fails in all. Others are
# drawn by `make fuzz`.
settings.register_profile("same", derandomize=True)
settings.register_profile("others", derandomize=False)
settings.load_profile("same")

sys.path.insert(0, str(Path(__file__).with_name("support")))

# The linear algebra of tests is small: threads would wait for each other.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")


# Ranks of one job end at the same time, and each clears what earlier runs of pytest left: in a
# shared folder, one would fail over what another has just removed.
if "mpi4py.run" in sys.modules:
    from mpi4py import MPI

    ranks_own = f"pytest-rank-{MPI.COMM_WORLD.rank}-of-{getpass.getuser()}"
    os.environ["PYTEST_DEBUG_TEMPROOT"] = os.path.join(tempfile.gettempdir(), ranks_own)
    os.makedirs(os.environ["PYTEST_DEBUG_TEMPROOT"], mode=0o700, exist_ok=True)


# A signal that is ignored, as under nohup or in the background of a script, is ignored by every
# process that is started here too, and by the program's handlers. One with a handler, if it does
# nothing, comes to them as to processes of a terminal; and still ends no test.
for number in (signal.SIGHUP, signal.SIGINT):
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, lambda *_: None)


# Libraries, the program and what is collected of tests are hundreds of thousands of objects that
# stay. To look through them for garbage as often as Python does takes a fourteenth of all tests.
gc.set_threshold(100_000, 20, 100)


def pytest_collection_finish() -> None:
    """Leave what is there before the first test to no collection."""
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put ``FIRST`` first; the others keep their order."""
    first = [Path(__file__).parent / name for name in FIRST]
    items.sort(key=lambda item: first.index(item.path) if item.path in first else len(first))


@pytest.fixture(autouse=True)
def _log_without_handlers() -> None:
    """Verbs that tests and their fixtures call in this process send the program's log elsewhere."""
    log = logging.getLogger("catenary")
    log.handlers.clear()
    log.propagate = True
    log.setLevel(logging.NOTSET)


@contextlib.contextmanager
def _examined_here() -> Iterator[None]:
    """Examine results and snapshots in this process and not in one of its own."""
    from catenary.postproc.read import guard

    child = guard._child

    def walked(path: str) -> int:
        """Exit code of the program that opens all tables of a file."""
        try:
            with mock.patch.object(sys, "argv", ["-c", path]), redirect_stdout(io.StringIO()):
                exec(guard._WALK, {})
        except SystemExit:  # refused: that is told by who opens it next
            return 0
        except Exception:
            return 1
        return 0

    def answer(words: list[str], limit: float) -> subprocess.CompletedProcess[bytes]:
        if words[:2] == ["-m", guard.__name__]:
            said = guard.examine(Path(words[2])).encode()
            return subprocess.CompletedProcess(words, 0, said, b"")
        if words[:2] == ["-c", guard._WALK]:
            return subprocess.CompletedProcess(words, walked(words[2]), b"", b"")
        return child(words, limit)

    with mock.patch.object(guard, "_child", answer):
        yield


@contextlib.contextmanager
def _quick_reports() -> Iterator[None]:
    """Draw pictures and paint none; examine results in this process."""
    from pixels import FIGURES, PAINTERS

    with mock.patch.multiple(FIGURES, **PAINTERS), _examined_here():
        yield


@pytest.fixture(scope="module")
def examined_here() -> Iterator[None]:
    """For a file of tests that damages no file so that HDF5 may crash."""
    with _examined_here():
        yield


@pytest.fixture(scope="module")
def quick_reports() -> Iterator[None]:
    """For a file of tests that looks at no picture and damages no result, which HDF5 may crash."""
    with _quick_reports():
        yield


@pytest.fixture
def quick_report() -> Iterator[None]:
    """For a single test."""
    with _quick_reports():
        yield
