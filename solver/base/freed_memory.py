"""Memory that has been freed, given back to the system."""

from __future__ import annotations

import ctypes
import gc

# Unknowns from which it pays to give memory back.
_LONG = 200_000


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
