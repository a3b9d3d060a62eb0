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
from catenary.solver.linear import station_products
from catenary.solver.linear.lanes import Layout, add_product, block_size, load, pitch, store, zero


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    layout : Layout
    kinds : (n,) kind of each station
    blocks : of each kind S^-1, -S^-1 times its block towards the end of the line that
        elimination starts from, and -S^-1 times that towards the middle, packed by the layout; S
        is its diagonal block after elimination
    low, high : range of stations in whose middle elimination ends
    n_stations, n_kinds : in the matrix, and how many have different factors
    """

    def __init__(
        self, layout: Layout, kinds: np.ndarray, blocks: np.ndarray, low: int, high: int
    ) -> None:
        self.layout, self.kinds, self.blocks = layout, kinds, blocks
        self.low, self.high = low, high
        self.n_stations, self.n_kinds = kinds.size, blocks.size // (3 * layout.partners.size)
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
    kinds, numbers = station_products.by_kinds(layout.packed(factors).reshape(n, -1))
    return StationFactors(layout, kinds, numbers, low, high)


@compiled
def factorise(blocks, middle, factors):
    """Fill ``factors`` (n, 3, b, b), by rows, of ``blocks`` (3, n, b, b); see ``StationFactors``
    and ``station_blocks.neighbours``."""
    to_start, own, to_end = blocks[0], blocks[1], blocks[2]
    n = own.shape[0]
    for i in range(middle):
        pivot = own[i].copy()
        if i > 0:
            pivot += to_start[i] @ factors[i - 1, 2]
        put_factors(pivot, to_start[i], to_end[i], factors[i])
    for i in range(n - 1, middle, -1):
        pivot = own[i].copy()
        if i < n - 1:
            pivot += to_end[i] @ factors[i + 1, 2]
        put_factors(pivot, to_end[i], to_start[i], factors[i])
    pivot = own[middle].copy()
    if middle > 0:
        pivot += to_start[middle] @ factors[middle - 1, 2]
    if middle < n - 1:
        pivot += to_end[middle] @ factors[middle + 1, 2]
    put_factors(pivot, to_start[middle], to_end[middle], factors[middle])


@compiled
def put_factors(pivot, outward, inward, factors):
    """Factors (3, b, b) of a station from its pivot S and its blocks to both sides."""
    inverse = factors[0]
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
    factors[1] = -(inverse @ outward)
    factors[2] = -(inverse @ inward)


@in_line
def eliminate(factored, right, station, outward, answer):
    """Leave in ``answer`` what is left of a station's unknowns after those ``outward`` of it."""
    layout, kinds, blocks, _, _ = factored
    # Indices are unsigned, which spares a check for negative ones.
    size, here = block_size(layout), pitch(layout) * np.uint64(station)
    at = np.uint64(3) * size * np.uint64(kinds[station])
    own = add_product(layout, zero(layout), blocks, at, load(layout, right, here))
    own = add_product(layout, own, blocks, at + size, outward)
    store(layout, answer, here, own)
    return own


@in_line
def substitute(factored, station, inward, answer):
    """Unknowns of a station from what ``answer`` holds of them and those ``inward`` of it."""
    layout, kinds, blocks, _, _ = factored
    size, here = block_size(layout), pitch(layout) * np.uint64(station)
    at = np.uint64(3) * size * np.uint64(kinds[station]) + np.uint64(2) * size
    own = add_product(layout, load(layout, answer, here), blocks, at, inward)
    store(layout, answer, here, own)
    return own


@compiled
def solve(factored, right, answer):
    """Fill ``answer`` from ``right``; ``factored`` are layout, kinds, blocks, low and high of
    ``StationFactors``."""
    layout, kinds, _, low, high = factored
    middle, pairs = (low + high) // 2, (high - low - 1) // 2
    x, y = zero(layout), zero(layout)
    for i in range(low):
        x = eliminate(factored, right, i, x, answer)
    for j in range(kinds.size - 1, high - 1, -1):
        y = eliminate(factored, right, j, y, answer)
    for k in range(pairs):
        x = eliminate(factored, right, low + k, x, answer)
        y = eliminate(factored, right, high - 1 - k, y, answer)
    # One more towards the start of the line, if there is an even number of them.
    for i in range(low + pairs, middle + 1):
        x = eliminate(factored, right, i, x, answer)
    x = y = substitute(factored, middle, y, answer)
    for k in range(1, pairs + 1):
        x = substitute(factored, middle - k, x, answer)
        y = substitute(factored, middle + k, y, answer)
    substitute_outside(factored, middle - pairs, high, x, y, answer)


@in_line
def substitute_outside(factored, low, high, x, y, answer):
    """Unknowns of stations before ``low`` and from ``high`` on, from those beside these, x and
    y."""
    _, kinds, _, _, _ = factored
    for i in range(low - 1, -1, -1):
        x = substitute(factored, i, x, answer)
    for j in range(high, kinds.size):
        y = substitute(factored, j, y, answer)
