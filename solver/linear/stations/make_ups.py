"""Kernels for stations of several make-ups: each is compiled for every one that a line has.

Between stations lanes are those of a whole cross-section; at a station they are narrowed to what it
has. A line whose stations all have all takes none of this.
"""

from __future__ import annotations

import inspect
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types

from catenary.solver.base.kernels.compiled import inner
from catenary.solver.linear.stations.lanes import LayoutType, inlined, load, widened


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

    Its arguments have no defaults. Where stations are alike nothing is added to it. Numba keeps the
    machine code of each on disk; what it chooses for an ``overload`` each process compiles anew.
    """
    known = inner(kernel)  # Numba's type of it does not keep it alive

    def typed(typing_context, layout, *others):
        of_part = types.Dispatcher(known)
        parts = layout.layout.parts if layout.layout.varies else (layout.layout,)
        kinds = [(LayoutType(part), *others) for part in parts]
        found: list[Any] = [of_part.get_call_type(typing_context, kind, {}) for kind in kinds]

        def generate(context, builder, signature, arguments):
            calls = [context.get_function(of_part, one) for one in found]
            if len(calls) == 1:
                return calls[0](builder, arguments)
            make_up = _entry(builder, builder.extract_value(arguments[1], 1), arguments[2])
            return _chosen(builder, calls, make_up, arguments)

        return found[0].return_type(layout, *others), generate

    names = ", ".join(inspect.signature(kernel).parameters)
    # Numba reads from it how many arguments there are.
    body = f"lambda typing_context, {names}: typed(typing_context, {names})"
    definition = eval(body, {"typed": typed})  # noqa: S307
    definition.__name__, definition.__doc__ = kernel.__name__, kernel.__doc__
    return inlined(definition)


def _chosen(builder: Any, calls: list[Any], number: Any, arguments: Any) -> Any:
    """LLVM's value of what the call of this number returns."""
    end, found = builder.append_basic_block("chosen"), []
    for n, call in enumerate(calls):
        further = None
        if n < len(calls) - 1:
            own, further = builder.append_basic_block(), builder.append_basic_block()
            is_own = builder.icmp_unsigned("==", number, ir.Constant(number.type, n))
            builder.cbranch(is_own, own, further)
            builder.position_at_end(own)
        found.append((call(builder, arguments), builder.block))
        builder.branch(end)
        if further is not None:
            builder.position_at_end(further)
    builder.position_at_end(end)
    value = builder.phi(found[0][0].type)
    for one, block in found:
        value.add_incoming(one, block)
    return value


@by_make_up
def load_at(layout, places, station, array):
    """The unknowns of a station in an array, in lanes of a whole cross-section."""
    return widened(layout, load(layout, array, start_of(layout, places, station)))
