"""Four numbers at once for Numba's kernels: the unknowns of a station.

Numba leaves arithmetic on a few numbers to one after the other. These functions, for use in
compiled ones only, become single instructions where the processor has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, register_model

# Numba's own annotations know nothing of the calls.
inlined: Any = intrinsic

_VECTOR = ir.VectorType(ir.DoubleType(), 4)
_LANES = ir.VectorType(ir.IntType(32), 4)
# A product and a sum may become one instruction, which rounds once instead of twice.
_FUSED = ("contract",)


class Four(types.Type):
    """Numba's type of four numbers."""

    def __init__(self) -> None:
        super().__init__(name="Four")


@register_model(Four)
class FourModel(models.PrimitiveModel):
    """Four numbers as LLVM's vector."""

    def __init__(self, manager: Any, front_end_type: types.Type) -> None:
        super().__init__(manager, front_end_type, _VECTOR)


_four = Four()


@inlined
def zero(typing_context):
    """0, 0, 0, 0."""

    def generate(context, builder, signature, arguments):
        return ir.Constant(_VECTOR, [0.0] * 4)

    return _four(), generate


@inlined
def load(typing_context, array, at):
    """``array[at]`` to ``array[at + 3]``, ``array`` being contiguous."""

    def generate(context, builder, signature, arguments):
        place = _place(context, builder, signature.args[0], *arguments)
        return builder.load(place, align=8)

    return _four(array, at), generate


@inlined
def store(typing_context, array, at, x):
    """Write x to ``array[at]`` and on."""

    def generate(context, builder, signature, arguments):
        place = _place(context, builder, signature.args[0], *arguments[:2])
        builder.store(arguments[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, at, x), generate


@inlined
def add_scaled(typing_context, total, factor, x):
    """``total`` plus the number ``factor`` times x."""

    def generate(context, builder, signature, arguments):
        total, factor, x = arguments
        undefined = ir.Constant(_VECTOR, ir.Undefined)
        first = builder.insert_element(undefined, factor, ir.Constant(ir.IntType(32), 0))
        product = builder.fmul(_spread(builder, first, (0, 0, 0, 0)), x, flags=_FUSED)
        return builder.fadd(total, product, flags=_FUSED)

    return _four(total, factor, x), generate


@inlined
def add_product(typing_context, total, array, at, x):
    """``total`` plus a 4 x 4 block times x; the block is stored from ``at`` on.

    A block stands by four diagonals: number i of diagonal d is that of row i and column i ^ d, so
    that x itself, unmoved, is what the first one takes.
    """

    def generate(context, builder, signature, arguments):
        total, array, at, x = arguments
        diagonals = [(context, builder, signature.args[1], array, at, x, d) for d in range(4)]
        # In two sums, of which the second need not wait for ``total``.
        one = _add_diagonal(total, *diagonals[0])
        two = _add_diagonal(None, *diagonals[2])
        return builder.fadd(_add_diagonal(one, *diagonals[1]), _add_diagonal(two, *diagonals[3]))

    return _four(total, array, at, x), generate


@inlined
def add_pairs(typing_context, total, array, at, x):
    """As ``add_product`` with a block that joins the first two of x, and the last two, only.

    Its first two diagonals are stored, the others being zero.
    """

    def generate(context, builder, signature, arguments):
        total, array, at, x = arguments
        for d in range(2):
            total = _add_diagonal(total, context, builder, signature.args[1], array, at, x, d)
        return total

    return _four(total, array, at, x), generate


def by_diagonals(blocks: np.ndarray) -> np.ndarray:
    """Blocks (..., 4, 4) as products read them, (..., 16)."""
    rows = np.arange(4)
    diagonals = [blocks[..., rows, rows ^ d] for d in range(4)]
    return np.concatenate(diagonals, axis=-1)


def _add_diagonal(
    total: Any, context: Any, builder: Any, kind: types.Type, array: Any, at: Any, x: Any, d: int
) -> Any:
    """``total``, if there is one, plus diagonal d of a block stored from ``at`` on times x."""
    place = _place(context, builder, kind, array, builder.add(at, ir.Constant(at.type, 4 * d)))
    factor = _spread(builder, x, (d, 1 ^ d, 2 ^ d, 3 ^ d)) if d else x
    product = builder.fmul(builder.load(place, align=8), factor, flags=_FUSED)
    return product if total is None else builder.fadd(total, product, flags=_FUSED)


def _spread(builder: Any, x: Any, lanes: tuple[int, ...]) -> Any:
    """Numbers of x by their places in it."""
    return builder.shuffle_vector(x, ir.Constant(_VECTOR, ir.Undefined), ir.Constant(_LANES, lanes))


def _place(context: Any, builder: Any, kind: types.Type, array: Any, at: Any) -> Any:
    """Pointer to four numbers of an array."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), _VECTOR.as_pointer())
