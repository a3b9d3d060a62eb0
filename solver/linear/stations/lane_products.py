"""Products of packed blocks with the unknowns of a station in vector lanes, for Numba's kernels.

Products that are added to each other share two sums, which a processor works on side by side.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types

from catenary.solver.linear.stations.lanes import (
    FUSED,
    Lanes,
    inlined,
    place_of,
)
from catenary.solver.linear.stations.registers import (
    Registers,
    gathered,
    shuffled,
    spread,
    vector_type,
    zeros,
)
from catenary.solver.linear.stations.station_layout import Halves, Layout, Terms, ranges_of

_NUMBERS = types.CPointer(types.float64)


@inlined
def numbers_from(typing_context, array, at):
    """Where ``array[at]`` is in memory; the array is contiguous, and kept alive by others."""

    def generate(context, builder, signature, arguments):
        array, at = arguments
        data = place_of(context, builder, signature.args[0], array)
        place = builder.gep(data, [at])
        # Unknown to the compiler, which else computes the address anew for each number.
        unchanged = ir.FunctionType(place.type, [place.type])
        return builder.asm(unchanged, "", "=r,0", [place], side_effect=False)

    return _NUMBERS(array, at), generate


@inlined
def sums_from(typing_context, layout, total):
    """Two sums of products with blocks of a layout, to which ``total`` is added."""

    def generate(context, builder, signature, arguments):
        _, total = arguments
        # What adds nothing, not even a sign.
        none = Registers(signature.args[1].registers).all_of(-0.0)
        return context.make_tuple(builder, signature.return_type, [total, none])

    return types.UniTuple(total, 2)(layout, total), generate


@inlined
def total_of(typing_context, layout, sums):
    """What both sums are together."""

    def generate(context, builder, signature, arguments):
        layout = signature.args[0].layout
        first, second = (builder.extract_value(arguments[1], number) for number in range(2))
        registers = Registers(layout.registers)
        result = []
        for one, other in zip(
            registers.apart(builder, first), registers.apart(builder, second), strict=True
        ):
            if layout.turns:
                other = spread(builder, other, [lane ^ 1 for lane in range(other.type.count)])
            result.append(builder.fadd(one, other))
        return registers.together(builder, result)

    return Lanes(layout.layout.registers)(layout, sums), generate


def _product(terms_of: Any, summary: str) -> Any:
    """A function that adds the product of a block of such terms to sums."""

    def product(typing_context, layout, sums, numbers, skipped, x):
        def generate(context, builder, signature, arguments):
            _, sums, numbers, skipped, x = arguments
            data = builder.gep(numbers, [skipped])
            layout = signature.args[0].layout
            both = [builder.extract_value(sums, number) for number in range(2)]
            _add_terms(builder, layout, both, data, x, terms_of(layout))
            return context.make_tuple(builder, signature.return_type, both)

        return sums(layout, sums, numbers, skipped, x), generate

    product.__doc__ = f"""{summary}

    The block stands ``skipped`` numbers after the place of ``numbers``.
    """
    return inlined(product)


add_whole = _product(
    lambda layout: layout.whole_terms, "Add a block that joins all of a plane, times x, to sums."
)
add_own = _product(
    lambda layout: layout.own_terms, "Add a diagonal block of K or C, times x, to sums."
)
add_beside = _product(
    lambda layout: layout.beside_terms,
    "Add a block of K or C that joins a station to one beside it, times x, to sums.",
)


@inlined
def add_symmetric(typing_context, layout, sums, numbers, x):
    """Add a symmetric block, of which one half is stored from the place of ``numbers`` on, times x
    to sums; see ``Layout.halves``."""

    def generate(context, builder, signature, arguments):
        _, sums, data, x = arguments
        layout = signature.args[0].layout
        halves, registers = layout.halves, Registers(layout.registers)
        both = [builder.extract_value(sums, number) for number in range(2)]
        lanes = np.tile(np.arange(layout.n_lanes), (len(halves.sources), 1))
        direct = Terms(halves.sources, lanes, layout.sums_of(len(lanes)))
        _add_terms(builder, layout, both, data, x, direct)
        if halves.mirrored.any():
            other = _mirrored(builder, layout, data, registers.apart(builder, x), halves)
            total = registers.apart(builder, both[0])
            total = [builder.fadd(*pair, flags=FUSED) for pair in zip(total, other, strict=True)]
            both[0] = registers.together(builder, total)
        return context.make_tuple(builder, signature.return_type, both)

    return sums(layout, sums, numbers, x), generate


def _stored(builder: Any, data: Any, at: int, size: int) -> Any:
    """Numbers of a block from ``at`` on."""
    place = builder.gep(data, [ir.Constant(ir.IntType(64), at)])
    return builder.load(builder.bitcast(place, vector_type(size).as_pointer()), align=8)


def _add_terms(
    builder: Any, layout: Layout, sums: list[Any], data: Any, x: Any, terms: Terms
) -> None:
    """Add all terms of a block stored at ``data`` times x to two ``sums``, which are replaced."""
    registers, ranges = Registers(layout.registers), ranges_of(layout.registers)
    begins = layout.order_of(terms.sources).begins
    factors = registers.apart(builder, x)
    parts = [registers.apart(builder, one) for one in sums]
    sources = np.where(terms.sources < 0, terms.targets, terms.sources)
    # Registers of two lanes beside larger ones; alone they are quicker one by one.
    few = 2 if max(layout.registers) > 2 else 0
    for term, number in enumerate(terms.sums.tolist()):
        for register, (first, size) in enumerate(ranges):
            begin, lanes = int(begins[register, term]), sources[:, first : first + size]
            if begin < 0 or (size == few and _is_second(terms, begins[register], term)):
                continue
            if size == few and _is_second(terms, begins[register], term + 1):
                factor = gathered(builder, factors, lanes[term : term + 2].ravel())
                both = parts[0][register], parts[1][register]
                total = shuffled(builder, *both, list(range(2 * size)))
                total = _with_product(builder, total, data, begin, factor)
                for half in range(2):
                    own = list(range(half * size, (half + 1) * size))
                    parts[half][register] = spread(builder, total, own)
                continue
            factor = gathered(builder, factors, lanes[term])
            total = _with_product(builder, parts[number][register], data, begin, factor)
            parts[number][register] = total
    sums[:] = [registers.together(builder, part) for part in parts]


def _is_second(terms: Terms, begins: np.ndarray, term: int) -> bool:
    """Whether a term of a register of two lanes is multiplied with the one before it, as four lanes
    at once: half as many loads. The two belong to different sums."""
    if term % 2 == 0 or term >= begins.size or begins[term] < 0:
        return False
    follows = begins[term - 1] >= 0 and begins[term] == begins[term - 1] + 2
    return bool(follows and terms.sums[term - 1] == 0 and terms.sums[term] == 1)


def _with_product(builder: Any, total: Any, data: Any, begin: int, factor: Any) -> Any:
    """A sum and the product of a factor with the numbers of a block from ``begin`` on."""
    stored = _stored(builder, data, begin, factor.type.count)
    return builder.fadd(total, builder.fmul(stored, factor, flags=FUSED), flags=FUSED)


def _mirrored(
    builder: Any, layout: Layout, data: Any, factors: list[Any], halves: Halves
) -> list[Any]:
    """What the half of a symmetric block that is not stored makes of ``factors``, by registers."""
    ranges = ranges_of(layout.registers)
    begins = layout.order_of(halves.sources).begins
    total: list[Any] = []
    for term in np.flatnonzero(halves.mirrored):
        products = []
        for factor, (_, size), begin in zip(factors, ranges, begins[:, term], strict=True):
            stored = zeros(size)
            if begin >= 0:
                stored = _stored(builder, data, int(begin), size)
            products.append(builder.fmul(stored, factor, flags=FUSED))
        lanes = halves.back[term]
        back = [gathered(builder, products, lanes[first : first + size]) for first, size in ranges]
        if total:
            back = [builder.fadd(*pair, flags=FUSED) for pair in zip(total, back, strict=True)]
        total = back
    return total
