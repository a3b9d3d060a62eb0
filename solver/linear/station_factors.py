"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. What elimination carries from span to span is forgotten within the reach of
A^-1, so that the factors of alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.base.petsc import PETSc
from catenary.solver.integrators.state_kernels import compiled, in_line
from catenary.solver.linear import station_products
from catenary.solver.linear.lanes import add_product, by_diagonals, load, store, zero
from catenary.solver.linear.station_products import BLOCK


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    kinds : (n,) kind of each station
    blocks : (48 n_kinds,) of each kind S^-1, -S^-1 times its block towards the end of the line that
        elimination starts from, and -S^-1 times that towards the middle, as ``fours.add_product``
        reads them; S is its diagonal block after elimination
    low, high : range of stations in whose middle elimination ends
    n_stations, n_kinds : in the matrix, and how many have different factors
    """

    def __init__(self, kinds: np.ndarray, blocks: np.ndarray, low: int, high: int) -> None:
        self.kinds, self.blocks, self.low, self.high = kinds, blocks, low, high
        self.n_stations, self.n_kinds = kinds.size, blocks.size // (3 * BLOCK**2)

    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Make ``answer`` that to ``right``, both (4 n,), perhaps the same array."""
        solve(self.kinds, self.blocks, self.low, self.high, right, answer)

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
    matrix: sparse.bsr_matrix, low: int = 0, high: int | None = None
) -> StationFactors | None:
    """Factors of a positive definite matrix in sorted blocks, eliminated towards the middle of the
    stations from ``low`` to ``high``, all by default.

    None if it is not block tridiagonal by stations, or hardly repeats, so that PETSc's factors are
    faster, being smaller. A matrix that is not positive definite gives wrong answers or none that
    are numbers.
    """
    blocks = station_products.neighbours(matrix)
    if blocks is None:
        return None
    n = blocks.shape[1]
    high = n if high is None else high
    factors = np.zeros((n, 3, BLOCK, BLOCK))
    factorise(blocks, (low + high) // 2, factors)
    kinds = station_products.by_kinds(by_diagonals(factors).reshape(n, -1))
    return None if kinds is None else StationFactors(*kinds, low, high)


@compiled
def factorise(blocks, middle, factors):
    """Fill ``factors`` (n, 3, 4, 4), by rows, of ``blocks`` (3, n, 4, 4); see ``StationFactors``
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
    """Factors (3, 4, 4) of a station from its pivot S and its blocks to both sides."""
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


# Indices are unsigned, so that none is asked whether it counts from the end.
_SIZE, _BLOCK = np.uint64(3 * BLOCK**2), np.uint64(BLOCK)
_OUTWARD, _INWARD = np.uint64(BLOCK**2), np.uint64(2 * BLOCK**2)


@in_line
def eliminate(kinds, blocks, right, station, outward, answer):
    """Leave in ``answer`` what is left of a station's unknowns after those ``outward`` of it."""
    at, here = _SIZE * np.uint64(kinds[station]), _BLOCK * np.uint64(station)
    own = add_product(zero(), blocks, at, load(right, here))
    own = add_product(own, blocks, at + _OUTWARD, outward)
    store(answer, here, own)
    return own


@in_line
def substitute(kinds, blocks, station, inward, answer):
    """Unknowns of a station from what ``answer`` holds of them and those ``inward`` of it."""
    at, here = _SIZE * np.uint64(kinds[station]) + _INWARD, _BLOCK * np.uint64(station)
    own = add_product(load(answer, here), blocks, at, inward)
    store(answer, here, own)
    return own


@compiled
def solve(kinds, blocks, low, high, right, answer):
    """Fill ``answer`` from ``right``; see ``StationFactors``."""
    middle, pairs = (low + high) // 2, (high - low - 1) // 2
    x, y = zero(), zero()
    for i in range(low):
        x = eliminate(kinds, blocks, right, i, x, answer)
    for j in range(kinds.size - 1, high - 1, -1):
        y = eliminate(kinds, blocks, right, j, y, answer)
    for k in range(pairs):
        x = eliminate(kinds, blocks, right, low + k, x, answer)
        y = eliminate(kinds, blocks, right, high - 1 - k, y, answer)
    # One more towards the start of the line, if there is an even number of them.
    for i in range(low + pairs, middle + 1):
        x = eliminate(kinds, blocks, right, i, x, answer)
    x = y = substitute(kinds, blocks, middle, y, answer)
    for k in range(1, pairs + 1):
        x = substitute(kinds, blocks, middle - k, x, answer)
        y = substitute(kinds, blocks, middle + k, y, answer)
    substitute_outside(kinds, blocks, middle - pairs, high, x, y, answer)


@in_line
def substitute_outside(kinds, blocks, low, high, x, y, answer):
    """Unknowns of stations before ``low`` and from ``high`` on, from those beside these, x and
    y."""
    for i in range(low - 1, -1, -1):
        x = substitute(kinds, blocks, i, x, answer)
    for j in range(high, kinds.size):
        y = substitute(kinds, blocks, j, y, answer)


def warm_up() -> None:
    """Compile the kernels, or load them from Numba's cache, before the clock of a march starts."""
    factorise(np.ones((3, 1, BLOCK, BLOCK)), 0, np.zeros((1, 3, BLOCK, BLOCK)))
    kinds, blocks, station = np.zeros(1, dtype=np.int32), np.zeros(3 * BLOCK**2), np.zeros(BLOCK)
    solve(kinds, blocks, 0, 1, station, station)
