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

from numba import typeof


def bound(kernel: Any, *arguments: Any, later: tuple[Any, ...] = ()) -> Callable[..., Any]:
    """A compiled ``kernel`` as a function of what follows these ``arguments``.

    Arrays are kept by reference; ``later`` are examples of what follows: arrays, or
    numbers, which are converted as need be.
    """
    if not hasattr(kernel, "overloads"):
        return partial(kernel, *arguments)  # NUMBA_DISABLE_JIT
    types = tuple(typeof(argument) for argument in (*arguments, *later))
    kernel.compile(types)
    chosen = getattr(kernel.overloads.get(types), "entry_point", kernel)
    return partial(chosen, *arguments)
