"""Memory that has been freed, given back to the system."""

from __future__ import annotations

import ctypes
import gc

# Unknowns from which it pays to search a line's arrays for cycles of references.
_LONG = 200_000


def give_back_long_line(n_unknowns: int) -> None:
    """Give back memory freed by work on a line of ``n_unknowns``, if it is long. Not collective.

    The search for cycles of references takes a tenth of a second, too long for a short line.
    """
    if n_unknowns >= _LONG:
        gc.collect()
        give_back()


def give_back() -> None:
    """Return freed memory that the C library still holds to the system. Not collective.

    After factorisation and assembly of a long line glibc holds gigabytes; other C libraries hold
    nothing and have no ``malloc_trim``.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(ctypes.c_size_t(0))
