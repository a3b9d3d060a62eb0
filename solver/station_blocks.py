"""Matrices in blocks of stations: block tridiagonal along the track, each kind of station once.

A station is a node of each of two wires at one place: four unknowns. Spans are alike, so that a
line has few kinds of stations, however long it is. Numbers of each kind then stay in the caches,
where a stored matrix leaves them on a long line, and products and solves wait for memory.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver import aligned
from catenary.solver.fours import add_product, load, store, zero
from catenary.solver.kernels import compiled
from catenary.solver.repeated_rows import kinds_of

# Unknowns of a station that the kernels are written for, and numbers of its three blocks.
BLOCK = 4
SIZE = 3 * BLOCK**2
# Kinds of stations whose blocks stay in the caches next to a processor, 1.5 MB.
MOST_KINDS = 4096


def neighbours(matrix: sparse.bsr_matrix, first: int = 0) -> np.ndarray | None:
    """Blocks of each row towards the start of the line, on the diagonal and towards the end.

    Row i has its diagonal block in column ``first`` + i. Shape (3, n, 4, 4); None if the matrix
    has others, or blocks of another size.
    """
    n = matrix.indptr.size - 1
    if matrix.blocksize != (BLOCK, BLOCK) or n == 0:
        return None
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    step = matrix.indices - row - first
    if np.abs(step).max(initial=0) > 1:
        return None
    blocks = np.zeros((3, n, BLOCK, BLOCK))
    blocks[step + 1, row] = matrix.data
    return blocks


def by_kinds(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Kind (n,) of each of ``blocks`` (n, 3, 4, 4), and the kinds' blocks as kernels read them.

    Those are by columns, one after the other. None if there are too many kinds.
    """
    numbers = blocks.transpose(0, 1, 3, 2).reshape(-1, SIZE)
    first, kinds = kinds_of(numbers)
    return None if first.size > MOST_KINDS else (kinds, aligned.copy(numbers[first]))


class StationProduct:
    """Products with rows of a matrix.

    Parameters
    ----------
    kinds, blocks : what ``by_kinds`` returned
    first : station in the factor of the first row
    """

    def __init__(self, kinds: np.ndarray, blocks: np.ndarray, first: int) -> None:
        self._parts = kinds, blocks, first

    def multiply(self, factor: np.ndarray, result: np.ndarray) -> None:
        """Make ``result`` the product with ``factor``. Not collective."""
        multiply(*self._parts, factor, result)


def station_product(matrix: sparse.bsr_matrix, first: int) -> StationProduct | None:
    """Products with a matrix in sorted blocks; None if it is not of the kind, or hardly repeats."""
    blocks = neighbours(matrix, first)
    kinds = None if blocks is None else by_kinds(blocks.transpose(1, 0, 2, 3))
    return None if kinds is None else StationProduct(*kinds, first)


# Indices are unsigned, so that none is asked whether it counts from the end.
_SIZE, _BLOCK = np.uint64(SIZE), np.uint64(BLOCK)
OWN, TO_END = np.uint64(BLOCK**2), np.uint64(2 * BLOCK**2)


@compiled
def multiply(kinds, blocks, first, factor, result):
    """``result`` = matrix times ``factor``; see ``StationProduct``."""
    n_read = factor.size // BLOCK
    before, here = zero(), load(factor, np.uint64(BLOCK * first))
    if first > 0:
        before = load(factor, np.uint64(BLOCK * (first - 1)))
    for i in range(kinds.size):
        after = zero()
        if first + i + 1 < n_read:
            after = load(factor, np.uint64(BLOCK * (first + i + 1)))
        at = _SIZE * np.uint64(kinds[i])
        total = add_product(zero(), blocks, at, before)
        total = add_product(total, blocks, at + OWN, here)
        store(result, _BLOCK * np.uint64(i), add_product(total, blocks, at + TO_END, after))
        before, here = here, after


def warm_up() -> None:
    """Compile the kernel, or load it from Numba's cache, before the clock of a march starts."""
    station = np.zeros(BLOCK)
    multiply(np.zeros(1, dtype=np.int32), np.zeros(SIZE), 0, station, station)
