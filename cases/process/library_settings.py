"""Settings of libraries before they are loaded, and the check that memory suffices to load them.

Not for other people's Python programs.
"""

from __future__ import annotations

import atexit
import gc
import os
import resource
import sys


def choose() -> None:
    """Set what Python and libraries read when they are loaded. Not collective."""
    # Modules, tables and pictures make many objects and little garbage: a short run ends before the
    # first collection, which takes 0.15 s of it otherwise. A long series of runs has some.
    gc.set_threshold(500_000, 3, 10)
    # The end of the process frees all memory at once: Python need not look through it for garbage
    # several times before, which takes a fifth of a whole run.
    atexit.register(gc.freeze)
    # Functions of libraries are looked up when they are first called: of all that PETSc, MPI and
    # SciPy have a run calls few.
    sys.setdlopenflags(os.RTLD_LAZY)
    # One thread a process unless the user says otherwise, before a library reads it: matrices are
    # small here, and MPI is what runs in parallel.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # No package checks scenes but Pydantic itself: it need not look through all that are installed.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # A crash ends the process: Open MPI's handler, which prints a trace, may wait for ever.
    os.environ.setdefault("OMPI_MCA_opal_signal", "")


# Address space that program and libraries take before any data, with a margin; a report of a short
# run was written within 0.7 GB, and OpenBLAS tries for ever to get memory within 0.45 GB [B].
LEAST = 700_000_000


def too_little_memory() -> str:
    """Sentence if this process's limit leaves too little memory, else "". Not collective."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= LEAST:
        return ""
    return (
        f"this process may take {limit / 1e6:.0f} MB of memory (ulimit -v), and the program with "
        f"its libraries needs {LEAST / 1e6:.0f} MB before any data; raise the limit"
    )
