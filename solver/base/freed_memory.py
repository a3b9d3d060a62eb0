"""Memory that has been freed, given back to the system."""

from __future__ import annotations

import ctypes
import gc

# Unknowns from which it pays to search a line's arrays for cycles of references.
_LONG = 200_000


def give_back_long_line(n_unknowns: int) -> None:
    """Give back what work on a line of so many unknowns has left, of a long one. Not collective.

    A search for what only refers to itself takes a tenth of a second, which a short line is not
    worth.
    """
    if n_unknowns >= _LONG:
        gc.collect()
        give_back()


def give_back() -> None:
    """Give back what the C library keeps for later, after large work is done. Not collective.

    Sparse factors and assembly leave gigabytes of a long line with glibc; other libraries keep
    nothing, and have no such function.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(ctypes.c_size_t(0))
