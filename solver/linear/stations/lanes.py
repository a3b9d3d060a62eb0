"""Vector lanes for the unknowns of a station, for Numba's kernels.

Numba leaves arithmetic on a few numbers to one after the other. These functions, for use in
compiled ones only, become vector instructions where the processor has them. How many lanes there
are, and what stands in them, is a ``Layout``: its type holds the numbers, so that a kernel is
compiled, and kept on disk, once for each layout that a line has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import (
    NativeValue,
    intrinsic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from catenary.solver.linear.stations.registers import (
    Registers,
    chosen,
    shuffled,
    spread,
    vector_type,
    zeros,
)
from catenary.solver.linear.stations.station_layout import Layout, ranges_of

# Numba's own annotations know nothing of the calls.
inlined: Any = intrinsic

# A product and a sum may become one instruction, which rounds once instead of twice.
FUSED = ("contract",)


class LayoutType(types.Dummy):
    """Numba's type of a layout, which is all of it."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        super().__init__(name=f"Layout{layout.key}")


class Lanes(types.Type):
    """Numba's type of the numbers in the lanes of a layout."""

    def __init__(self, registers: tuple[int, ...]) -> None:
        self.registers = registers
        super().__init__(name=f"Lanes{registers}")


@register_model(LayoutType)
class _LayoutModel(models.OpaqueModel):
    """Nothing: the type says it all."""


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    """Numbers as LLVM's vectors."""

    def __init__(self, manager: Any, front_end_type: Lanes) -> None:
        super().__init__(manager, front_end_type, Registers(front_end_type.registers).type)


@typeof_impl.register(Layout)
def _type_of(layout: Layout, context: Any) -> LayoutType:
    return LayoutType(layout)


@unbox(LayoutType)
def _unbox(kind: LayoutType, layout: Any, context: Any) -> NativeValue:
    return NativeValue(context.context.get_dummy_value())


def _constant(value_of: Any, summary: str) -> Any:
    """A function of a layout, that is a constant in compiled code."""

    def constant(typing_context, layout):
        number = int(value_of(layout.layout))

        def generate(context, builder, signature, arguments):
            return ir.Constant(ir.IntType(64), number)

        return types.uint64(layout), generate

    constant.__doc__ = summary
    return inlined(constant)


pitch = _constant(lambda layout: layout.pitch, "Unknowns of a station.")
whole_size = _constant(
    lambda layout: layout.order_of(layout.whole_terms.sources).size,
    "Numbers of a packed block of factors.",
)
half_size = _constant(
    lambda layout: layout.order_of(layout.halves.sources).size,
    "Numbers of a packed symmetric block of factors.",
)
own_size = _constant(
    lambda layout: layout.order_of(layout.own_terms.sources).size,
    "Numbers of a packed diagonal block of K or C.",
)
beside_size = _constant(
    lambda layout: layout.order_of(layout.beside_terms.sources).size,
    "Numbers of a packed block of K or C beside the diagonal.",
)
remembers = _constant(
    lambda layout: layout.remembers, "Whether steps need an acceleration known before."
)
is_by_mass = _constant(
    lambda layout: layout.by_mass, "Whether steps make their right-hand side by M."
)
is_sparse = _constant(
    lambda layout: layout.sparse, "Whether factors keep the matrix's own blocks between stations."
)
is_damped = _constant(lambda layout: layout.damped, "Whether a product with K is one with C too.")


@inlined
def same_part(typing_context, layout, part):
    """The part of ``layout`` for the make-up of ``part``, which is one of another layout."""

    def generate(context, builder, signature, arguments):
        return context.get_dummy_value()

    return LayoutType(layout.layout.parts[part.layout.number])(layout, part), generate


@inlined
def narrowed(typing_context, part, x):
    """Lanes of a whole layout as those of one of its parts."""

    def generate(context, builder, signature, arguments):
        return lanes_narrowed(builder, part.layout, arguments[1])

    return Lanes(part.layout.registers)(part, x), generate


def lanes_narrowed(builder: Any, part: Layout, x: Any) -> Any:
    """LLVM's value of what is ``narrowed``."""
    if part.whole is None:
        return x
    return chosen(builder, part.whole.registers, x, part.registers, part.lanes_of_whole)


@inlined
def widened(typing_context, part, x):
    """Lanes of a part as those of its whole layout, 0 where the part has none."""

    def generate(context, builder, signature, arguments):
        return lanes_widened(builder, part.layout, arguments[1])

    return Lanes((part.layout.whole or part.layout).registers)(part, x), generate


def lanes_widened(builder: Any, part: Layout, x: Any) -> Any:
    """LLVM's value of what is ``widened``."""
    if part.whole is None:
        return x
    lanes, own = np.full(part.whole.n_lanes, -1), part.lanes_of_whole
    lanes[own[own >= 0]] = np.flatnonzero(own >= 0)
    return chosen(builder, part.registers, x, part.whole.registers, lanes)


def place_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Where the numbers of an array are, of which this may be the place already."""
    if isinstance(kind, types.CPointer):
        return array
    return context.make_array(kind)(context, builder, array).data


@inlined
def zero(typing_context, layout):
    """0 in all lanes."""

    def generate(context, builder, signature, arguments):
        return Registers(signature.return_type.registers).zeros()

    return Lanes(layout.layout.registers)(layout), generate


@inlined
def load(typing_context, layout, array, at):
    """The unknowns of a station, from ``array[at]`` on; ``array`` is contiguous, or ``pointed``."""

    def generate(context, builder, signature, arguments):
        _, array, at = arguments
        data = place_of(context, builder, signature.args[1], array)
        layout = signature.args[0].layout
        result = []
        for first, size in ranges_of(layout.registers):
            result.append(_load_some(builder, data, at, layout.unknowns[first : first + size]))
        return Registers(layout.registers).together(builder, result)

    return Lanes(layout.layout.registers)(layout, array, at), generate


@inlined
def store(typing_context, layout, array, at, x):
    """Write the unknowns of a station to ``array[at]`` and on."""

    def generate(context, builder, signature, arguments):
        _, array, at, x = arguments
        data = place_of(context, builder, signature.args[1], array)
        layout = signature.args[0].layout
        parts = Registers(layout.registers).apart(builder, x)
        for part, (first, size) in zip(parts, ranges_of(layout.registers), strict=True):
            _store_some(builder, data, at, layout.unknowns[first : first + size], part)
        return context.get_dummy_value()

    return types.void(layout, array, at, x), generate


@inlined
def add(typing_context, x, y):
    """The sum of two."""

    def generate(context, builder, signature, arguments):
        both = Registers(signature.return_type.registers)
        return both.each(builder, lambda a, b: builder.fadd(a, b), *arguments)

    return x(x, y), generate


@inlined
def add_scaled(typing_context, total, factor, x):
    """``total`` plus the number ``factor`` times x."""

    def generate(context, builder, signature, arguments):
        total, factor, x = arguments

        def sum_of(a, b):
            alone = ir.Constant(b.type, ir.Undefined)
            first = builder.insert_element(alone, factor, ir.Constant(ir.IntType(32), 0))
            product = builder.fmul(spread(builder, first, [0] * b.type.count), b, flags=FUSED)
            return builder.fadd(a, product, flags=FUSED)

        return Registers(signature.return_type.registers).each(builder, sum_of, total, x)

    return total(total, factor, x), generate


def _load_some(builder: Any, data: Any, at: Any, unknowns: np.ndarray) -> Any:
    """A vector with the unknowns of its lanes, 0 where there are none."""
    result = None
    for lane, first, size in _runs(unknowns):
        part = builder.load(_pointer(builder, data, _at(builder, at, first), size), align=8)
        if size == unknowns.size:
            return part
        mask = np.full(unknowns.size, size)  # a lane of zeros
        mask[lane : lane + size] = np.arange(size)
        wide = shuffled(builder, part, zeros(size), mask.tolist())
        if result is None:
            result = wide
        else:
            chosen = np.arange(unknowns.size)
            chosen[lane : lane + size] += unknowns.size
            result = shuffled(builder, result, wide, chosen.tolist())
    return zeros(unknowns.size) if result is None else result


def _store_some(builder: Any, data: Any, at: Any, unknowns: np.ndarray, vector: Any) -> None:
    """Write the lanes of a vector that hold unknowns."""
    for lane, first, size in _runs(unknowns):
        part = vector
        if size < unknowns.size:
            part = spread(builder, vector, list(range(lane, lane + size)))
        builder.store(part, _pointer(builder, data, _at(builder, at, first), size), align=8)


def _runs(unknowns: np.ndarray) -> list[tuple[int, int, int]]:
    """First lane, first unknown and size, a power of two, of runs that stand together in memory."""
    result, lane = [], 0
    while lane < unknowns.size:
        if unknowns[lane] < 0:
            lane += 1
            continue
        size = 1
        while (
            lane + 2 * size <= unknowns.size
            and (unknowns[lane : lane + 2 * size] == unknowns[lane] + np.arange(2 * size)).all()
        ):
            size *= 2
        result.append((lane, int(unknowns[lane]), size))
        lane += size
    return result


def _at(builder: Any, at: Any, step: int) -> Any:
    return builder.add(at, ir.Constant(at.type, step)) if step else at


def _pointer(builder: Any, data: Any, at: Any, size: int) -> Any:
    """Pointer to numbers of an array as a vector."""
    return builder.bitcast(builder.gep(data, [at]), vector_type(size).as_pointer())
