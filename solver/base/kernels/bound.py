"""Bind a Numba kernel to its arguments; a call then skips type dispatch.

At each call Numba determines the type of every argument, to choose among what it has compiled. A
loop of a step gets the same arrays each time: with types determined once, a step's seven calls cost
3.5 in place of 5.9 us. ``entry_point`` is not a documented part of Numba; if it is missing, the
dispatcher is called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import typeof

# Types of arguments by what they depend on. Numba builds those of a tuple of arrays anew each time,
# in half a millisecond for what a step takes.
_known: dict[Any, Any] = {}


def bound(kernel: Any, *arguments: Any, later: tuple[Any, ...] = ()) -> Callable[..., Any]:
    """A compiled ``kernel`` as a function of what follows these ``arguments``.

    Arrays are kept by reference; ``later`` are examples of what follows: arrays, or
    numbers, which are converted as need be.
    """
    if not hasattr(kernel, "overloads"):
        return partial(kernel, *arguments)  # NUMBA_DISABLE_JIT
    types = tuple(_type_of(argument) for argument in (*arguments, *later))
    kernel.compile(types)
    chosen = getattr(kernel.overloads.get(types), "entry_point", kernel)
    return partial(chosen, *arguments)


def _type_of(argument: Any) -> Any:
    """As ``typeof``."""
    kind = _kind_of(argument)
    if kind is None:
        return typeof(argument)
    found = _known.get(kind)
    if found is None:
        found = _known[kind] = typeof(argument)
    return found


def _kind_of(argument: Any) -> Any:
    """What the type of arrays and of tuples of them depends on, None for anything else."""
    if type(argument) is np.ndarray:
        flags = argument.flags
        layout = flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
        return argument.dtype, argument.ndim, layout
    if isinstance(argument, tuple):
        parts = tuple(_kind_of(part) for part in argument)
        return None if None in parts else (type(argument), parts)
    if type(argument) in (float, bool) or (type(argument) is int and abs(argument) < 2**62):
        return type(argument)
    return None
