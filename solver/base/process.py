"""What libraries do to this process, and what keeps them from it: MPI, PETSc, Gmsh, malloc.

MPI in a process that no launcher has started goes without what reaches other processes. PETSc takes
nearly all signals when it starts; Gmsh, which is linked with a PETSc of its own, sets them back to
the system's, under which SIGTERM and SIGHUP end the process without a word. Memory that has been
freed is given back to the system.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from catenary.base.parallel import launched_by_mpirun

# Open MPI's daemon for processes that this one might start, its networks, and the search for them
# take 0.3 s at the start. hwloc, with which it looks for processors, would call at each display and
# each driver of a graphics card. Its folder for what processes of a job share has one name for all
# that no launcher has started: one that ends would take it from another that starts. Other
# implementations do not read these variables.
MPI_SETTINGS = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "HWLOC_PLUGINS_BLACKLIST": "hwloc_gl.so,hwloc_opencl.so",
}
# What Open MPI 4 leaves in the environment of a process that no launcher has started, with which no
# launcher starts from there.
_LEFT = ("OMPI_MCA_ess", "OMPI_MCA_pmix")
# Unknowns from which it pays to give memory back.
_LONG = 200_000


@contextmanager
def mpi_settings() -> Iterator[None]:
    """Within the context MPI starts as a single process, unless mpirun started it. Not collective.

    Variables that the environment already sets keep their values. Those set here, and what MPI adds
    of its own, are removed afterwards: a process started later may be a launcher.
    """
    if launched_by_mpirun():
        yield
        return
    added = {name: value for name, value in MPI_SETTINGS.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
        for name in _LEFT:
            if name not in os.environ:
                os.unsetenv(name)  # which the process's own environment has, unlike os.environ


def world() -> Any:
    """The communicator of all processes; starts MPI. Not collective."""
    with mpi_settings():
        from mpi4py import MPI

    return MPI.COMM_WORLD


def alone() -> Any:
    """The communicator of this process alone; starts MPI. Not collective."""
    world()
    from mpi4py import MPI

    return MPI.COMM_SELF


@contextmanager
def python_signals_kept() -> Iterator[None]:
    """A context after which signals are handled as Python has it. Not collective.

    Signals that come meanwhile are handled at the end. Only the main thread can do so.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    kept = {}
    for number in signal.valid_signals():
        handler = signal.getsignal(number)
        if callable(handler) or handler == signal.SIG_IGN:
            kept[number] = handler
    before = signal.pthread_sigmask(signal.SIG_BLOCK, kept)
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def give_back(n_unknowns: int) -> None:
    """Return memory freed by work on a line of ``n_unknowns`` to the system, if it is long. Not
    collective.

    After factorisation and assembly of a long line glibc holds gigabytes; other C libraries hold
    nothing and have no ``malloc_trim``. Both that and the search for cycles of references take too
    long for a short line.
    """
    if n_unknowns < _LONG:
        return
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(ctypes.c_size_t(0))
