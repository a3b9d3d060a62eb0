"""Kernels for stations of several make-ups: each is compiled for every one that a line has.

Between stations lanes are those of a whole cross-section; at a station they are narrowed to what it
has. A line whose stations all have all takes none of this.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numba.extending import overload

from catenary.solver.base.kernels.compiled import inner
from catenary.solver.linear.stations.lanes import load, part_of, pitch, varies, widened
from catenary.solver.linear.stations.station_layout import Layout


class Places(NamedTuple):
    """Where stations stand in vectors, as kernels read it: arrays without entries if all are alike.

    Attributes
    ----------
    starts : (n,) first unknown of each
    make_up : (n,) of each
    """

    starts: np.ndarray
    make_up: np.ndarray


ALIKE = Places(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.uint8))


@inner
def start_of(layout, places, station):
    """First unknown of a station in vectors."""
    # Indices are unsigned, which spares a check for negative ones.
    if varies(layout):
        return np.uint64(places[0][np.uint64(station)])
    return pitch(layout) * np.uint64(station)


@inner
def make_up_of(layout, places, station):
    """Make-up of a station."""
    if varies(layout):
        return places[1][np.uint64(station)]
    return np.uint8(0)


def by_make_up(kernel: Any) -> Any:
    """The function (layout, make_up, ...) that calls ``kernel`` with the layout of a make-up, and
    the other arguments, in compiled code."""
    names = list(inspect.signature(kernel.py_func).parameters)[1:]

    def choose(*arguments: Any) -> Any:
        raise NotImplementedError("called in compiled code only")

    def implementation(layout: Any, *others: Any) -> Any:
        return _chain(kernel, names, layout.layout, 0)

    typed = _function(names, "implementation(layout, make_up)", implementation=implementation)
    function = _function(names, "choose()", choose=choose)
    overload(function, jit_options=_OPTIONS)(typed)
    return function


_OPTIONS: Any = {"forceinline": True, "error_model": "numpy"}


def _chain(kernel: Any, names: list[str], layout: Layout, number: int) -> Callable[..., Any]:
    """A function that chooses among make-ups from ``number`` on."""
    others = ", ".join(names)
    if not layout.varies:
        return _function(names, f"kernel(layout, {others})", kernel=kernel)
    this = f"kernel(part_of(layout, {number}), {others})"
    if number == len(layout.parts) - 1:
        return _function(names, this, kernel=kernel, part_of=part_of)
    further = njit(**_OPTIONS)(_chain(kernel, names, layout, number + 1))
    return _function(
        names,
        f"{this} if make_up == {number} else further(layout, make_up, {others})",
        kernel=kernel,
        part_of=part_of,
        further=further,
    )


def _function(names: list[str], body: str, **known: Any) -> Any:
    """The function (layout, make_up, ...) that returns ``body``. Numba keeps count of the arrays in
    a tuple of arguments at each call, which takes ten times as long as the call."""
    return eval(f"lambda layout, make_up, {', '.join(names)}: {body}", known)  # noqa: S307


@inner
def block_at(layout, kinds, station, size):
    """Where the blocks of a station begin, of ``size`` numbers each; ``kinds`` holds that itself
    where make-ups vary."""
    if varies(layout):
        return np.uint64(kinds[np.uint64(station)])
    return size * np.uint64(kinds[np.uint64(station)])


@inner
def _load(part, array, at):
    return widened(part, load(part, array, at))


# The unknowns of a station, from ``array[at]`` on, in lanes of a whole cross-section.
load_at = by_make_up(_load)
