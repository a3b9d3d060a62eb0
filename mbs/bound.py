"""Compiled loops with their arguments found once.

At each call Numba asks every argument for its type, to choose among what it has compiled. A loop
of a step gets the same arrays each time; asked once, it takes its turn a third faster.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from numba import typeof


def bound(kernel: Any, *arguments: Any, later: tuple[float, ...] = ()) -> Callable[..., Any]:
    """A compiled ``kernel`` as a function of what follows these ``arguments``.

    Arrays are kept by reference; ``later`` are examples of what follows: numbers, which are
    converted as need be.
    """
    if not hasattr(kernel, "overloads"):
        return partial(kernel, *arguments)  # Numba was told to compile nothing
    types = tuple(typeof(argument) for argument in (*arguments, *later))
    kernel.compile(types)
    return partial(kernel.overloads[types].entry_point, *arguments)
