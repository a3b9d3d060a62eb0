"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. What elimination carries from span to span is forgotten within the reach of
A^-1, so that the factors of alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.base.bound import bound
from catenary.solver.base.compiled import compiled, in_line
from catenary.solver.base.petsc import PETSc
from catenary.solver.base.pointers import borrowed
from catenary.solver.linear import station_products
from catenary.solver.linear.lane_products import (
    add_transposed,
    add_whole,
    numbers_from,
    sums_from,
    total_of,
)
from catenary.solver.linear.lanes import load, pitch, shares, store, whole_size, zero
from catenary.solver.linear.station_layout import Layout

# Bytes of factors from which on they share blocks: more would leave no room for the state in a
# cache next to a processor, of 1 to 2 MB; a product with a transpose waits some longer.
LARGE = 2**19


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    layout : Layout
    kinds : (n,) kind of each station
    blocks : of each kind S^-1, -S^-1 B with its block B towards the middle, and, unless the
        layout shares these, the transpose of the second of the station before it in elimination,
        which that multiplies with; packed by the layout. S is a diagonal block after elimination.
        In the middle the second is for elimination from the other end
    low, high : range of stations in whose middle elimination ends
    n_stations, n_kinds : in the matrix, and how many have different factors
    """

    def __init__(
        self, layout: Layout, kinds: np.ndarray, blocks: np.ndarray, low: int, high: int
    ) -> None:
        self.layout, self.kinds, self.blocks = layout, kinds, blocks
        self.low, self.high = low, high
        self.n_stations, self.n_kinds = (
            kinds.size,
            blocks.size // (3 * layout.whole_terms.sources.size),
        )
        factored, vectors = (layout, kinds, blocks, low, high), (np.zeros(0), np.zeros(0))
        self._solve = bound(solve, factored, later=vectors)

    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Make ``answer`` that to ``right``, both (n pitch,), perhaps the same array."""
        self._solve(right, answer)

    def apply(self, pc: PETSc.PC, right: PETSc.Vec, answer: PETSc.Vec) -> None:
        """Called by PETSc."""
        self.solve(right.getArray(readonly=True).copy(), answer.getArray())

    def view(self, pc: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Called by PETSc for -march_ksp_view."""
        viewer.printfASCII(
            f"    exact factors of {self.n_stations} stations, of {self.n_kinds} kinds, from both "
            "ends to the middle\n"
        )


def station_factors(
    matrix: sparse.bsr_matrix, layout: Layout, low: int = 0, high: int | None = None
) -> StationFactors | None:
    """Factors of a positive definite matrix in sorted blocks, eliminated towards the middle of the
    stations from ``low`` to ``high``, all by default.

    None if it is not block tridiagonal by stations. A matrix that is not positive definite gives
    wrong answers or NaN.
    """
    blocks = station_products.neighbours(matrix)
    if blocks is None:
        return None
    n = blocks.shape[1]
    high = n if high is None else high
    factors = np.zeros((n, 3, layout.pitch, layout.pitch))
    factorise(blocks, (low + high) // 2, factors)
    packed = layout.packed(factors, layout.whole_terms)
    kinds, numbers = station_products.by_kinds(packed.reshape(n, -1))
    if numbers.nbytes > LARGE and layout.turns:
        layout = layout.sharing()
        kinds, numbers = station_products.by_kinds(packed[:, :2].reshape(n, -1))
    return StationFactors(layout, kinds, numbers, low, high)


@compiled
def factorise(blocks, middle, factors):
    """Fill ``factors`` (n, 3, b, b), by rows, of ``blocks`` (3, n, b, b); see ``StationFactors``
    and ``station_products.neighbours``."""
    to_start, own, to_end = blocks[0], blocks[1], blocks[2]
    n = own.shape[0]
    for i in range(middle):
        pivot = own[i].copy()
        if i > 0:
            factors[i, 2] = factors[i - 1, 1].T
            pivot += to_start[i] @ factors[i - 1, 1]
        invert(pivot, factors[i, 0])
        factors[i, 1] = -(factors[i, 0] @ to_end[i])
    for i in range(n - 1, middle, -1):
        pivot = own[i].copy()
        if i < n - 1:
            factors[i, 2] = factors[i + 1, 1].T
            pivot += to_end[i] @ factors[i + 1, 1]
        invert(pivot, factors[i, 0])
        factors[i, 1] = -(factors[i, 0] @ to_start[i])
    pivot = own[middle].copy()
    if middle > 0:
        factors[middle, 2] = factors[middle - 1, 1].T
        pivot += to_start[middle] @ factors[middle - 1, 1]
    if middle < n - 1:
        factors[middle, 1] = factors[middle + 1, 1].T
        pivot += to_end[middle] @ factors[middle + 1, 1]
    invert(pivot, factors[middle, 0])


@compiled
def invert(pivot, inverse):
    """Fill in the inverse of a positive definite block, which is overwritten."""
    inverse[:] = np.eye(pivot.shape[0])
    # A positive definite block needs no exchange of rows.
    for i in range(pivot.shape[0]):
        scale = 1.0 / pivot[i, i]
        pivot[i] *= scale
        inverse[i] *= scale
        for j in range(pivot.shape[0]):
            if j != i:
                share = pivot[j, i]
                pivot[j] -= share * pivot[i]
                inverse[j] -= share * inverse[i]


@in_line
def factors_of(factored, station):
    """Where the blocks of a station are."""
    layout, kinds, blocks, _, _ = factored
    # Indices are unsigned, which spares a check for negative ones.
    kind = np.uint64(kinds[np.uint64(station)])
    n_blocks = np.uint64(2) if shares(layout) else np.uint64(3)
    return numbers_from(blocks, n_blocks * whole_size(layout) * kind)


@in_line
def eliminate(factored, sums, station, before, outward, answer):
    """Leave in ``answer`` what the right-hand side of a station, as ``sums``, is after those
    ``outward`` of it are eliminated, of which ``before`` is the last."""
    layout = factored[0]
    if shares(layout):
        numbers, total = factors_of(factored, before), total_of(layout, sums)
        left = add_transposed(layout, total, numbers, whole_size(layout), outward)
    else:
        numbers, skipped = factors_of(factored, station), np.uint64(2) * whole_size(layout)
        left = total_of(layout, add_whole(layout, sums, numbers, skipped, outward))
    store(layout, answer, pitch(layout) * np.uint64(station), left)
    return left


@in_line
def meet(factored, middle, towards_end, answer):
    """Unknowns of the middle station from what ``answer`` holds of it and what is left of the one
    beside it, ``towards_end`` of the line."""
    layout, kinds = factored[0], factored[1]
    here = pitch(layout) * np.uint64(middle)
    numbers, left = factors_of(factored, middle), load(layout, answer, here)
    if shares(layout):
        beyond = factors_of(factored, min(middle + 1, kinds.size - 1))
        left = add_transposed(layout, left, beyond, whole_size(layout), towards_end)
    else:
        sums = sums_from(layout, left)
        left = total_of(layout, add_whole(layout, sums, numbers, whole_size(layout), towards_end))
    own = total_of(
        layout, add_whole(layout, sums_from(layout, zero(layout)), numbers, np.uint64(0), left)
    )
    store(layout, answer, here, own)
    return own


@in_line
def substitute(factored, station, inward, answer):
    """Unknowns of a station from what ``answer`` holds of it and the unknowns ``inward`` of it."""
    layout = factored[0]
    numbers = factors_of(factored, station)
    left = load(layout, answer, pitch(layout) * np.uint64(station))
    sums = add_whole(layout, sums_from(layout, zero(layout)), numbers, np.uint64(0), left)
    return total_of(layout, add_whole(layout, sums, numbers, whole_size(layout), inward))


@in_line
def right_side(factored, right, station):
    """The right-hand side of a station as sums."""
    layout = factored[0]
    return sums_from(layout, load(layout, right, pitch(layout) * np.uint64(station)))


@in_line
def substitute_into(factored, station, inward, answer):
    """``substitute`` that leaves the unknowns in ``answer``, too."""
    own = substitute(factored, station, inward, answer)
    store(factored[0], answer, pitch(factored[0]) * np.uint64(station), own)
    return own


@compiled
def solve(factored, right, answer):
    """Fill ``answer`` from ``right``; ``factored`` are layout, kinds, blocks, low and high of
    ``StationFactors``."""
    factored, right, answer = borrowed((factored, right, answer))
    layout, kinds, _, low, high = factored
    n, middle = kinds.size, (low + high) // 2
    pairs = min(middle, n - 1 - middle)
    x, y = zero(layout), zero(layout)
    for i in range(pairs):
        j = n - 1 - i
        x = eliminate(factored, right_side(factored, right, i), i, max(i - 1, 0), x, answer)
        y = eliminate(factored, right_side(factored, right, j), j, min(j + 1, n - 1), y, answer)
    for i in range(pairs, middle + 1):
        x = eliminate(factored, right_side(factored, right, i), i, max(i - 1, 0), x, answer)
    for j in range(n - 1 - pairs, middle, -1):
        y = eliminate(factored, right_side(factored, right, j), j, min(j + 1, n - 1), y, answer)
    x = y = meet(factored, middle, y, answer)
    for k in range(1, pairs + 1):
        x = substitute_into(factored, middle - k, x, answer)
        y = substitute_into(factored, middle + k, y, answer)
    for i in range(middle - pairs - 1, -1, -1):
        x = substitute_into(factored, i, x, answer)
    for j in range(middle + pairs + 1, n):
        y = substitute_into(factored, j, y, answer)
