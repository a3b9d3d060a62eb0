"""Memory that has been freed, given back to the system."""

from __future__ import annotations

import ctypes


def give_back() -> None:
    """Give back what the C library keeps for later, after large work is done. Not collective.

    Sparse factors and assembly leave gigabytes of a long line with glibc; other libraries keep
    nothing, and have no such function.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(ctypes.c_size_t(0))
