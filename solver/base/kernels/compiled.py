"""Decorators for the loops of a time step, compiled by Numba and kept between runs.

Cancellation-free arithmetic matters more than the last per cent: no fastmath, same answer as the
formulas and on every rank.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numba
from numba import cfunc, njit, types

from catenary.solver.base.kernels import loop_cache

# Without an entry at a plain address.
_NO_ADDRESS = {"no_cfunc_wrapper": True}
_NO_ENTRY = {"no_cpython_wrapper": True, **_NO_ADDRESS}
_settings: Any = numba.config  # Numba makes its attributes while it is imported


def compiled(function: Any) -> Any:
    """A compiled ``function``, its machine code kept in ``loop_cache.folder()`` if there is one."""
    return _compile(function, **_NO_ADDRESS)


def addressed(function: Any) -> Any:
    """A function of a place in memory that compiled loops call, see ``pointers.HeldCall``.

    ``compiled_at`` compiles it. It has no entry from Python: one for many arguments takes as long
    to compile as their loop.
    """
    return function


@functools.cache
def compiled_at(function: Any, place: Any) -> Any:
    """What is ``addressed``, compiled for a place of this type: its ``address`` is to be called."""
    signature = types.void(place)
    return _kept(lambda keep: cfunc(signature, cache=keep, error_model="numpy")(function))


def in_line(function: Any) -> Any:
    """Likewise, for what a loop is made of: no call is left of it.

    A call copies seven numbers for each array among its arguments, in records and tuples as well,
    and counts references to it: many a kernel takes less time than that.
    """
    return _compile(function, forceinline=True, **_NO_ADDRESS)


def called(function: Any) -> Any:
    """As ``compiled``, for what only compiled code calls.

    No entry from Python is made, which takes as long as compiling a few lines; a call from there
    would end the process.
    """
    return _compile(function, **_NO_ENTRY)


def inner(function: Any) -> Any:
    """As ``in_line``, for lines that only compiled code calls."""
    return _compile(function, forceinline=True, **_NO_ENTRY)


def _compile(function: Any, **options: Any) -> Any:
    return _kept(lambda keep: njit(cache=keep, error_model="numpy", **options)(function))


def _kept(compiler: Callable[[bool], Any]) -> Any:
    """What a compiler makes that is told whether to keep its machine code."""
    folder = loop_cache.folder(numba.__version__)
    before = _settings.CACHE_DIR
    try:
        # Numba looks for its folder here, once for each function; other users' loops keep theirs.
        _settings.CACHE_DIR = str(folder or "")
        return compiler(folder is not None)
    finally:
        _settings.CACHE_DIR = before
