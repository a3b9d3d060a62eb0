"""Vector lanes for the unknowns of a station, for Numba's kernels.

Numba leaves arithmetic on a few numbers to one after the other. These functions, for use in
compiled ones only, become vector instructions where the processor has them. How many lanes there
are, and what stands in them, is a ``Layout``: its type holds the numbers, so that a kernel is
compiled, and kept on disk, once for each layout that a line has.
"""

from __future__ import annotations

from functools import cached_property
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

# Numba's own annotations know nothing of the calls.
inlined: Any = intrinsic

# Lanes that a plane may take: the least of these that holds its unknowns.
LANES = (2, 4, 8, 12, 16)
# Unknowns of a plane that kernels take.
WIDEST = LANES[-1]
# Lanes of an LLVM vector; more are held in several.
_REGISTER = 8
# A product and a sum may become one instruction, which rounds once instead of twice.
_FUSED = ("contract",)


class Layout:
    """How the unknowns of a station stand in lanes, and which of them matrices join.

    Planes are sets of unknowns that no matrix joins. They stand side by side, so that one
    instruction works on all of them. A block of a matrix is kept by terms: in term number d each
    lane is multiplied with its partner d, another lane of its plane.

    Parameters
    ----------
    widths : unknowns of a station in each plane, as they follow each other in vectors
    paired : whether K and C join a station to those beside it in pairs of unknowns only: 0 and 1,
        2 and 3 and so on, as a beam's deflection and slope
    damped : whether a product with K is one with C as well
    remembers : whether steps need an acceleration known before, as the generalized-alpha method's

    Attributes
    ----------
    pitch : unknowns of a station
    n_lanes : lanes that they take, those without an unknown included
    """

    def __init__(
        self,
        widths: tuple[int, ...],
        paired: bool = False,
        damped: bool = False,
        remembers: bool = False,
    ) -> None:
        self.widths, self.paired = tuple(widths), bool(paired)
        self.damped, self.remembers = bool(damped), bool(remembers)
        self.pitch = sum(self.widths)
        self._plane = min(lanes for lanes in LANES if lanes >= max(self.widths))
        self.n_lanes = self._plane * len(self.widths)

    @cached_property
    def unknowns(self) -> np.ndarray:
        """Unknown of each lane, -1 in one that has none, shape (n_lanes,)."""
        result = np.full((len(self.widths), self._plane), -1)
        first = 0
        for row, width in zip(result, self.widths, strict=True):
            row[:width] = np.arange(first, first + width)
            first += width
        return result.ravel()

    @cached_property
    def partners(self) -> np.ndarray:
        """Partner of each lane in each term of a block, shape (n_terms, n_lanes).

        By exclusive or, so that the first term takes a factor as it stands; but by columns where
        there are fewer of these.
        """
        lane = np.arange(self.n_lanes)
        widest = max(self.widths)
        if self._plane <= _REGISTER and widest > self._plane - 2:
            return lane ^ np.arange(self._plane)[:, None]
        return lane - lane % self._plane + np.arange(widest)[:, None]

    @cached_property
    def partners_beside(self) -> np.ndarray:
        """The same for blocks of K and C that join a station to those beside it."""
        lane = np.arange(self.n_lanes)
        return lane ^ np.arange(2)[:, None] if self.paired else self.partners

    def packed(self, blocks: np.ndarray, beside: bool = False) -> np.ndarray:
        """Blocks (..., pitch, pitch) as products read them, shape (..., n_terms n_lanes)."""
        partners = self.partners_beside if beside else self.partners
        row, column = np.broadcast_arrays(self.unknowns, self.unknowns[partners])
        there = (row >= 0) & (column >= 0)
        terms = np.where(there, blocks[..., row, column], 0.0)
        return terms.reshape(*blocks.shape[:-2], partners.size)


class LayoutType(types.Type):
    """Numba's type of a layout, which is all of it."""

    def __init__(
        self, widths: tuple[int, ...], paired: bool, damped: bool, remembers: bool
    ) -> None:
        self.layout = Layout(widths, paired, damped, remembers)
        super().__init__(name=f"Layout({widths}, {paired}, {damped}, {remembers})")


class Lanes(types.Type):
    """Numba's type of the numbers in the lanes of a layout."""

    def __init__(self, n_lanes: int) -> None:
        self.n_lanes = n_lanes
        super().__init__(name=f"Lanes({n_lanes})")


@register_model(LayoutType)
class _LayoutModel(models.OpaqueModel):
    """Nothing: the type says it all."""


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    """Numbers as LLVM's vectors."""

    def __init__(self, manager: Any, front_end_type: Lanes) -> None:
        super().__init__(manager, front_end_type, _Registers(front_end_type.n_lanes).type)


@typeof_impl.register(Layout)
def _type_of(layout: Layout, context: Any) -> LayoutType:
    return LayoutType(layout.widths, layout.paired, layout.damped, layout.remembers)


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
block_size = _constant(lambda layout: layout.partners.size, "Numbers of a packed block.")
beside_size = _constant(
    lambda layout: layout.partners_beside.size, "Numbers of a packed block beside that of K or C."
)
remembers = _constant(
    lambda layout: layout.remembers, "Whether steps need an acceleration known before."
)
is_damped = _constant(lambda layout: layout.damped, "Whether a product with K is one with C too.")


@inlined
def zero(typing_context, layout):
    """0 in all lanes."""

    def generate(context, builder, signature, arguments):
        return _Registers(signature.return_type.n_lanes).zeros(builder)

    return Lanes(layout.layout.n_lanes)(layout), generate


@inlined
def load(typing_context, layout, array, at):
    """The unknowns of a station, from ``array[at]`` on; ``array`` is contiguous."""

    def generate(context, builder, signature, arguments):
        _, array, at = arguments
        data = context.make_array(signature.args[1])(context, builder, array).data
        unknowns = signature.args[0].layout.unknowns
        result = []
        for first, size in _registers(unknowns.size):
            result.append(_load_some(builder, data, at, unknowns[first : first + size]))
        return _Registers(unknowns.size).together(builder, result)

    return Lanes(layout.layout.n_lanes)(layout, array, at), generate


@inlined
def store(typing_context, layout, array, at, x):
    """Write the unknowns of a station to ``array[at]`` and on."""

    def generate(context, builder, signature, arguments):
        _, array, at, x = arguments
        data = context.make_array(signature.args[1])(context, builder, array).data
        unknowns = signature.args[0].layout.unknowns
        parts = _Registers(unknowns.size).apart(builder, x)
        for part, (first, size) in zip(parts, _registers(unknowns.size), strict=True):
            _store_some(builder, data, at, unknowns[first : first + size], part)
        return context.get_dummy_value()

    return types.void(layout, array, at, x), generate


@inlined
def add(typing_context, x, y):
    """The sum of two."""

    def generate(context, builder, signature, arguments):
        both = _Registers(signature.return_type.n_lanes)
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
            product = builder.fmul(_spread(builder, first, [0] * b.type.count), b, flags=_FUSED)
            return builder.fadd(a, product, flags=_FUSED)

        return _Registers(signature.return_type.n_lanes).each(builder, sum_of, total, x)

    return total(total, factor, x), generate


@inlined
def add_product(typing_context, layout, total, array, at, x):
    """``total`` plus a block times x; the block is stored from ``at`` on."""

    def generate(context, builder, signature, arguments):
        _, total, array, at, x = arguments
        data = context.make_array(signature.args[2])(context, builder, array).data
        return _add_terms(builder, total, data, at, x, signature.args[0].layout.partners)

    return total(layout, total, array, at, x), generate


@inlined
def add_product_beside(typing_context, layout, total, array, at, x):
    """As ``add_product`` with a block of K or C that joins a station to one beside it."""

    def generate(context, builder, signature, arguments):
        _, total, array, at, x = arguments
        data = context.make_array(signature.args[2])(context, builder, array).data
        return _add_terms(builder, total, data, at, x, signature.args[0].layout.partners_beside)

    return total(layout, total, array, at, x), generate


class _Registers:
    """LLVM's vectors of at most eight numbers that arithmetic on lanes is done with.

    Between operations lanes are one vector: a struct of several would be kept in memory.
    """

    def __init__(self, n_lanes: int) -> None:
        self._ranges, self.type = _registers(n_lanes), _vector(n_lanes)

    def zeros(self, builder: Any) -> Any:
        return _zeros(self.type.count)

    def together(self, builder: Any, vectors: list[Any]) -> Any:
        result = vectors[0]
        for (first, size), vector in zip(self._ranges[1:], vectors[1:], strict=True):
            result = _shuffled(
                builder,
                _widened(builder, result, max(first, size)),
                _widened(builder, vector, max(first, size)),
                list(range(first + size)),
            )
        return result

    def apart(self, builder: Any, lanes: Any) -> list[Any]:
        if len(self._ranges) == 1:
            return [lanes]
        return [_spread(builder, lanes, list(range(a, a + size))) for a, size in self._ranges]

    def each(self, builder: Any, function: Any, *lanes: Any) -> Any:
        parts = zip(*(self.apart(builder, one) for one in lanes), strict=True)
        return self.together(builder, [function(*part) for part in parts])


def _registers(n_lanes: int) -> list[tuple[int, int]]:
    """First lane and number of lanes of each vector that holds some of them."""
    firsts = range(0, n_lanes, _REGISTER)
    return [(first, min(_REGISTER, n_lanes - first)) for first in firsts]


def _add_terms(builder: Any, total: Any, data: Any, at: Any, x: Any, partners: np.ndarray) -> Any:
    """``total`` plus all terms of a block stored from ``at`` on times x."""
    n_terms, n_lanes = partners.shape
    registers = _Registers(n_lanes)
    totals, factors = registers.apart(builder, total), registers.apart(builder, x)
    result = []
    for number, (first, size) in enumerate(_registers(n_lanes)):
        # In two sums, of which the second need not wait for ``total``.
        sums: list[Any] = [totals[number], None]
        for term in range(n_terms):
            place = _at(builder, at, term * n_lanes + first)
            factor = _gathered(builder, factors, partners[term, first : first + size])
            numbers = builder.load(_pointer(builder, data, place, size), align=8)
            product = builder.fmul(numbers, factor, flags=_FUSED)
            half = int(n_terms > 2 and 2 * term >= n_terms)
            before = sums[half]
            sums[half] = product if before is None else builder.fadd(before, product, flags=_FUSED)
        result.append(sums[0] if sums[1] is None else builder.fadd(*sums))
    return registers.together(builder, result)


def _gathered(builder: Any, vectors: list[Any], lanes: np.ndarray) -> Any:
    """Numbers by their lanes in ``vectors``, of which they come from two at most."""
    source = lanes // _REGISTER
    first, last = int(source.min()), int(source.max())
    one, other = vectors[first], vectors[last]
    if first == last:
        places = lanes - first * _REGISTER
        if np.array_equal(places, np.arange(one.type.count)):
            return one
        return _spread(builder, one, places.tolist())
    places = lanes % _REGISTER + np.where(source == last, _REGISTER, 0)
    one, other = _widened(builder, one, _REGISTER), _widened(builder, other, _REGISTER)
    return _shuffled(builder, one, other, places.tolist())


def _load_some(builder: Any, data: Any, at: Any, unknowns: np.ndarray) -> Any:
    """A vector with the unknowns of its lanes, 0 where there are none."""
    result = None
    for lane, first, size in _runs(unknowns):
        part = builder.load(_pointer(builder, data, _at(builder, at, first), size), align=8)
        if size == unknowns.size:
            return part
        mask = np.full(unknowns.size, size)  # a lane of zeros
        mask[lane : lane + size] = np.arange(size)
        wide = _shuffled(builder, part, _zeros(size), mask.tolist())
        if result is None:
            result = wide
        else:
            chosen = np.arange(unknowns.size)
            chosen[lane : lane + size] += unknowns.size
            result = _shuffled(builder, result, wide, chosen.tolist())
    return _zeros(unknowns.size) if result is None else result


def _store_some(builder: Any, data: Any, at: Any, unknowns: np.ndarray, vector: Any) -> None:
    """Write the lanes of a vector that hold unknowns."""
    for lane, first, size in _runs(unknowns):
        part = vector
        if size < unknowns.size:
            part = _spread(builder, vector, list(range(lane, lane + size)))
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


def _vector(size: int) -> ir.VectorType:
    return ir.VectorType(ir.DoubleType(), size)


def _zeros(size: int) -> ir.Constant:
    return ir.Constant(_vector(size), [0.0] * size)


def _spread(builder: Any, x: Any, lanes: list[int]) -> Any:
    """Numbers of x by their lanes."""
    return _shuffled(builder, x, ir.Constant(x.type, ir.Undefined), lanes)


def _widened(builder: Any, x: Any, size: int) -> Any:
    """x with lanes that are not defined at its end."""
    if x.type.count == size:
        return x
    return _spread(builder, x, [min(lane, x.type.count - 1) for lane in range(size)])


def _shuffled(builder: Any, x: Any, y: Any, lanes: list[int]) -> Any:
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), lanes)
    return builder.shuffle_vector(x, y, mask)


def _at(builder: Any, at: Any, step: int) -> Any:
    return builder.add(at, ir.Constant(at.type, step)) if step else at


def _pointer(builder: Any, data: Any, at: Any, size: int) -> Any:
    """Pointer to numbers of an array as a vector."""
    return builder.bitcast(builder.gep(data, [at]), _vector(size).as_pointer())
