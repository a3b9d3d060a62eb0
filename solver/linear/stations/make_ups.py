"""Kernels for stations of several make-ups: each is compiled for every one that a line has.

Between stations lanes are those of a whole cross-section; at a station they are narrowed to what it
has. A line whose stations all have all takes none of this.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import overload

from catenary.solver.linear.stations.lanes import inlined, load, part_of, widened
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


@inlined
def start_of(typing_context, layout, places, station):
    """First unknown of a station in vectors; ``places`` are ``pointed``."""

    def generate(context, builder, signature, arguments):
        _, places, station = arguments
        if signature.args[0].layout.varies:
            return _entry(builder, builder.extract_value(places, 0), station)
        return builder.mul(ir.Constant(station.type, signature.args[0].layout.pitch), station)

    return types.uint64(layout, places, types.uint64), generate


@inlined
def make_up_of(typing_context, layout, places, station):
    """Make-up of a station; ``places`` are ``pointed``."""

    def generate(context, builder, signature, arguments):
        _, places, station = arguments
        if signature.args[0].layout.varies:
            return _entry(builder, builder.extract_value(places, 1), station)
        return ir.Constant(ir.IntType(8), 0)

    return types.uint8(layout, places, types.uint64), generate


@inlined
def block_at(typing_context, layout, kinds, station, size):
    """Where the blocks of a station begin, of ``size`` numbers each; ``kinds``, which are
    ``pointed``, hold that itself, as 64 bits, where make-ups of the line vary."""

    def generate(context, builder, signature, arguments):
        layout, kinds, station, size = arguments
        kind = _entry(builder, kinds, station)
        if signature.args[1].dtype == types.int64:
            return kind
        return builder.mul(size, builder.zext(kind, size.type) if kind.type != size.type else kind)

    return types.uint64(layout, kinds, types.uint64, types.uint64), generate


def _entry(builder: Any, place: Any, number: Any) -> Any:
    """The entry of a number in what is at a place."""
    return builder.load(builder.gep(place, [number]))


def by_make_up(kernel: Any) -> Any:
    """The function ``kernel`` (layout, places, station, ...) with the layout of the station's
    make-up in place of that of the line, for compiled code.

    Its arguments have no defaults. Where stations are alike nothing is added to it.
    """
    names = list(inspect.signature(kernel).parameters)

    def choose(*arguments: Any) -> Any:
        raise NotImplementedError("called in compiled code only")

    def implementation(layout: Any, *others: Any) -> Any:
        return _chain(kernel, names, layout.layout, 0) if layout.layout.varies else kernel

    typed = _function(names, f"implementation({', '.join(names)})", implementation=implementation)
    function = _function(names, "choose()", choose=choose)
    overload(function, jit_options=OPTIONS)(typed)
    return function


OPTIONS: Any = {"forceinline": True, "error_model": "numpy"}


def _chain(kernel: Any, names: list[str], layout: Layout, number: int) -> Callable[..., Any]:
    """A function that chooses among make-ups from ``number`` on."""
    layout_name, places, station, *others = names
    words = ", ".join((places, station, *others))
    known = {"kernel": njit(**OPTIONS)(kernel), "part_of": part_of, "make_up_of": make_up_of}
    this = f"kernel(part_of({layout_name}, {number}), {words})"
    if number == len(layout.parts) - 1:
        return _function(names, this, **known)
    further = njit(**OPTIONS)(_chain(kernel, names, layout, number + 1))
    chosen = f"make_up_of({layout_name}, {places}, {station}) == {number}"
    return _function(
        names, f"{this} if {chosen} else further({', '.join(names)})", further=further, **known
    )


def _function(names: list[str], body: str, **known: Any) -> Any:
    """The function of these arguments that returns ``body``. Numba keeps count of the arrays in a
    tuple of arguments at each call, which takes ten times as long as the call."""
    return eval(f"lambda {', '.join(names)}: {body}", known)  # noqa: S307


@by_make_up
def load_at(layout, places, station, array):
    """The unknowns of a station in an array, in lanes of a whole cross-section."""
    return widened(layout, load(layout, array, start_of(layout, places, station)))
