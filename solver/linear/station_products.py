"""Matrices in blocks of stations: block tridiagonal along the track, each kind of station once.

A station is a node of each of two wires at one place: four unknowns. Spans are alike, so that a
line has few kinds of stations, however long it is. Numbers of each kind then stay in the caches,
where a stored matrix leaves them on a long line, and products and solves wait for memory.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.base import aligned_arrays
from catenary.solver.integrators.state_kernels import compiled, in_line
from catenary.solver.linear.lanes import add_pairs, add_product, by_diagonals, load, store, zero
from catenary.solver.linear.unique_rows import kinds_of

# Unknowns of a station that the kernels are written for.
BLOCK = 4
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


def by_kinds(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Kind (n,) of each station of whose ``numbers`` (n, m), and those of the kinds in a row.

    None if there are too many kinds.
    """
    first, kinds = kinds_of(numbers)
    return None if first.size > MOST_KINDS else (kinds, aligned_arrays.copy(numbers[first]))


class StationProduct:
    """Products with rows of a matrix.

    Attributes
    ----------
    kinds : (n,) of its rows
    blocks : (32 n_kinds,) of each kind its diagonal block, then what joins it to the stations
        before and after it, wire by wire; all as products read them, see ``fours``
    first : station in the factor of the first row; the factor has one before and one after all
        rows, which is zero where the line ends
    """

    def __init__(self, kinds: np.ndarray, blocks: np.ndarray, first: int) -> None:
        self.kinds, self.blocks, self.first = kinds, blocks, first

    def multiply(self, factor: np.ndarray, result: np.ndarray) -> None:
        """Make ``result`` the product with ``factor``. Not collective."""
        multiply(self.kinds, self.blocks, self.first, factor, result)


def station_product(matrix: sparse.bsr_matrix, first: int) -> StationProduct | None:
    """Products with a matrix in sorted blocks, whose first row is that of column ``first``.

    The factor has a station more at both ends than the matrix has columns. None if a station is
    not joined to its neighbours by each wire for itself, or if the matrix hardly repeats.
    """
    blocks = neighbours(matrix, first)
    if blocks is None or blocks[0::2, :, :2, 2:].any() or blocks[0::2, :, 2:, :2].any():
        return None
    before, own, after = by_diagonals(blocks)
    numbers = [own, before[:, : 2 * BLOCK], after[:, : 2 * BLOCK]]
    kinds = by_kinds(np.concatenate(numbers, axis=1))
    return None if kinds is None else StationProduct(*kinds, first + 1)


# Indices are unsigned, so that none is asked whether it counts from the end.
_BLOCK, _SIZE = np.uint64(BLOCK), np.uint64(2 * BLOCK**2)
_BEFORE, _AFTER = np.uint64(BLOCK**2), np.uint64(BLOCK**2 + 2 * BLOCK)


@in_line
def multiply_row(kinds, blocks, row, before, here, after):
    """A row of a product with what the factor holds there and beside it; see ``StationProduct``."""
    at = _SIZE * np.uint64(kinds[row])
    total = add_product(zero(), blocks, at, here)
    total = add_pairs(total, blocks, at + _BEFORE, before)
    return add_pairs(total, blocks, at + _AFTER, after)


@in_line
def multiply_rows(kinds, blocks, first, factor, begin, end, result):
    """Rows from ``begin`` to ``end`` of a product; see ``StationProduct``."""
    at = _BLOCK * np.uint64(first + begin)
    before, here = load(factor, at - _BLOCK), load(factor, at)
    for i in range(begin, end):
        after = load(factor, _BLOCK * np.uint64(first + i + 1))
        store(result, _BLOCK * np.uint64(i), multiply_row(kinds, blocks, i, before, here, after))
        before, here = here, after


@compiled
def multiply(kinds, blocks, first, factor, result):
    """``result`` = matrix times ``factor``; see ``StationProduct``."""
    multiply_rows(kinds, blocks, first, factor, 0, kinds.size, result)


def warm_up() -> None:
    """Compile the kernel, or load it from Numba's cache, before the clock of a march starts."""
    kinds, blocks = np.zeros(1, dtype=np.int32), np.zeros(2 * BLOCK**2)
    multiply(kinds, blocks, 1, np.zeros(3 * BLOCK), np.zeros(BLOCK))
