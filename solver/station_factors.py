"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. What elimination carries from span to span is forgotten within the reach of
A^-1, so that the factors of alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from catenary.solver import station_blocks
from catenary.solver.fours import add_product, load, store, zero
from catenary.solver.kernels import compiled
from catenary.solver.station_blocks import BLOCK, SIZE


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    n_stations, n_kinds : in the matrix, and how many have different factors

    Parameters
    ----------
    kinds : (n,) kind of each station
    factors : of each kind S^-1, -S^-1 times its block towards the end of the line that elimination
        starts from, and -S^-1 times that towards the middle, each by columns; S is its diagonal
        block after elimination
    """

    def __init__(self, kinds: np.ndarray, factors: np.ndarray) -> None:
        self._kinds, self._factors = kinds, factors
        self.n_stations, self.n_kinds = kinds.size, factors.size // SIZE

    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Make ``answer`` that to ``right``, both (4 n,)."""
        solve(self._kinds, self._factors, right, answer)

    def apply(self, pc: PETSc.PC, right: PETSc.Vec, answer: PETSc.Vec) -> None:
        """Called by PETSc."""
        self.solve(right.getArray(readonly=True).copy(), answer.getArray())

    def view(self, pc: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Called by PETSc for -march_ksp_view."""
        viewer.printfASCII(
            f"    exact factors of {self.n_stations} stations, of {self.n_kinds} kinds, from both "
            "ends to the middle\n"
        )


def station_factors(matrix: sparse.bsr_matrix) -> StationFactors | None:
    """Factors of a positive definite matrix in sorted blocks.

    None if it is not block tridiagonal by stations, or hardly repeats, so that PETSc's factors are
    faster, being smaller. A matrix that is not positive definite gives wrong answers or none that
    are numbers.
    """
    blocks = station_blocks.neighbours(matrix)
    if blocks is None:
        return None
    factors = np.zeros((blocks.shape[1], 3, BLOCK, BLOCK))
    factorise(blocks, factors)
    kinds = station_blocks.by_kinds(factors)
    return None if kinds is None else StationFactors(*kinds)


@compiled
def factorise(blocks, factors):
    """Fill ``factors`` (n, 3, 4, 4), by rows, of ``blocks`` (3, n, 4, 4); see ``StationFactors``
    and ``station_blocks.neighbours``."""
    to_start, own, to_end = blocks[0], blocks[1], blocks[2]
    n = own.shape[0]
    middle = n // 2
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
_SIZE, _BLOCK = np.uint64(SIZE), np.uint64(BLOCK)
_OUTWARD, _INWARD = np.uint64(BLOCK**2), np.uint64(2 * BLOCK**2)


@compiled
def eliminate(kinds, factors, right, station, outward):
    """What is left of a station's unknowns after those ``outward`` of it."""
    at = _SIZE * np.uint64(kinds[station])
    own = add_product(zero(), factors, at, load(right, _BLOCK * np.uint64(station)))
    return add_product(own, factors, at + _OUTWARD, outward)


@compiled
def substitute(kinds, factors, answer, station, inward):
    """Unknowns of a station from what is left of them and those ``inward`` of it."""
    at = _SIZE * np.uint64(kinds[station]) + _INWARD
    return add_product(load(answer, _BLOCK * np.uint64(station)), factors, at, inward)


@compiled
def solve(kinds, factors, right, answer):
    """Fill ``answer`` from ``right``; see ``StationFactors``."""
    n = kinds.size
    middle = n // 2
    x, y = zero(), zero()
    for i in range(middle):
        x = eliminate(kinds, factors, right, i, x)
        store(answer, _BLOCK * np.uint64(i), x)
        j = n - 1 - i
        if j > middle:
            y = eliminate(kinds, factors, right, j, y)
            store(answer, _BLOCK * np.uint64(j), y)
    x = eliminate(kinds, factors, right, middle, x)
    store(answer, _BLOCK * np.uint64(middle), x)
    x = substitute(kinds, factors, answer, middle, y)
    store(answer, _BLOCK * np.uint64(middle), x)
    y = x
    for k in range(1, middle + 1):
        i, j = middle - k, middle + k
        x = substitute(kinds, factors, answer, i, x)
        store(answer, _BLOCK * np.uint64(i), x)
        if j < n:
            y = substitute(kinds, factors, answer, j, y)
            store(answer, _BLOCK * np.uint64(j), y)


def warm_up() -> None:
    """Compile the kernels, or load them from Numba's cache, before the clock of a march starts."""
    factorise(np.ones((3, 1, BLOCK, BLOCK)), np.zeros((1, 3, BLOCK, BLOCK)))
    station = np.zeros(BLOCK)
    solve(np.zeros(1, dtype=np.int32), np.zeros(SIZE), station, station)
