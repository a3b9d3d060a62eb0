"""Products with a matrix whose rows repeat: each kind of row is stored once.

Spans of a line are alike, so that its stiffness has few kinds of rows, however long it is: a
product then reads little more than the vector, where a stored matrix leaves the caches on a long
line and the product waits for memory.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.base.compiled import compiled

# Rows for each kind below which a stored matrix is no slower, and unknowns of a node that the
# kernel is written for.
_REPEATED, _BLOCK = 8, 2
# Blocks of a row that are multiplied without asking whether they exist: a node's own, and those of
# the next on either side along its wire.
_ALWAYS = 3


class RepeatedRows:
    """A matrix in blocks of two by its kinds of rows.

    Parameters
    ----------
    kinds : (n,) kind of each row of blocks
    blocks : (m, 4 width) the blocks of each kind, row by row, filled up with zeros
    steps : (m, width) columns of its blocks, counted in blocks from the row's own number
    counts : (m,) how many blocks a kind has, ``_ALWAYS`` at least
    """

    def __init__(
        self, kinds: np.ndarray, blocks: np.ndarray, steps: np.ndarray, counts: np.ndarray
    ) -> None:
        self._parts = (kinds, blocks, steps, counts)

    def multiply(self, factor: np.ndarray, result: np.ndarray) -> None:
        """Make ``result`` the product with ``factor``. Not collective."""
        multiply(*self._parts, factor, result)


def repeated_rows(matrix: sparse.bsr_matrix) -> RepeatedRows | None:
    """The same matrix by its kinds of rows; None if they do not repeat often enough to be worth it.

    ``matrix`` has sorted indices. Rows are of one kind if all their numbers are the same bits.
    """
    count, n = np.diff(matrix.indptr), matrix.indptr.size - 1
    if matrix.blocksize != (_BLOCK, _BLOCK) or n == 0 or count.min() == 0:
        return None
    width = max(_ALWAYS, int(count.max()))
    row = np.repeat(np.arange(n), count)
    place = np.arange(row.size) - matrix.indptr[row]
    # Where there is no block, a zero one stands at the row's first, which exists.
    steps = np.repeat((matrix.indices[matrix.indptr[:-1]] - np.arange(n))[:, None], width, axis=1)
    steps[row, place] = matrix.indices - row
    blocks = np.zeros((n, width, 4))
    blocks[row, place] = matrix.data.reshape(-1, 4)
    blocks = blocks.reshape(n, 4 * width)
    first, kinds = kinds_of(np.hstack([blocks, steps]))
    if first.size * _REPEATED > n:
        return None
    counts = np.maximum(count[first], _ALWAYS)
    return RepeatedRows(kinds, blocks[first], steps[first], counts)


def kinds_of(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each kind of ``rows`` (n, k) is met first, and the kind of each row (n,).

    Kinds are numbered as they are met, so that rows read theirs from memory mostly in order.
    """
    _, first, kinds = np.unique(_digests(rows), return_index=True, return_inverse=True)
    order = np.argsort(first)
    first, kinds = first[order], np.argsort(order)[kinds]
    if not (rows == rows[first][kinds]).all():
        # Two different rows of one digest, as good as impossible, or what is no number.
        return np.arange(rows.shape[0]), np.arange(rows.shape[0], dtype=np.int32)
    return first, kinds.astype(np.int32)


def _digests(rows: np.ndarray) -> np.ndarray:
    """A number for each row, the same for the same rows, shape (n,)."""
    factors = np.random.default_rng(0).integers(0, 2**63, 64, dtype=np.uint64) * np.uint64(2) + 1
    result = np.zeros(rows.shape[0], dtype=np.uint64)
    for number, column in enumerate((rows + 0.0).view(np.uint64).T):
        result = (result + column * factors[number % 64]) * factors[(7 * number + 1) % 64]
        result ^= result >> np.uint64(29)
    return result


@compiled
def multiply(kinds, blocks, steps, counts, factor, result):
    """``result`` = matrix times ``factor``; see ``RepeatedRows``."""
    one = np.uint64(1)
    for i in range(kinds.size):
        # Unsigned, so that no index is asked whether it counts from the end.
        k = np.uint64(kinds[i])
        a = np.uint64(2 * (i + steps[k, 0]))
        b = np.uint64(2 * (i + steps[k, 1]))
        c = np.uint64(2 * (i + steps[k, 2]))
        w = blocks[k, 0] * factor[a] + blocks[k, 1] * factor[a + one]
        t = blocks[k, 2] * factor[a] + blocks[k, 3] * factor[a + one]
        w += blocks[k, 4] * factor[b] + blocks[k, 5] * factor[b + one]
        t += blocks[k, 6] * factor[b] + blocks[k, 7] * factor[b + one]
        w += blocks[k, 8] * factor[c] + blocks[k, 9] * factor[c + one]
        t += blocks[k, 10] * factor[c] + blocks[k, 11] * factor[c + one]
        for q in range(_ALWAYS, counts[k]):
            j = np.uint64(2 * (i + steps[k, q]))
            w += blocks[k, 4 * q] * factor[j] + blocks[k, 4 * q + 1] * factor[j + one]
            t += blocks[k, 4 * q + 2] * factor[j] + blocks[k, 4 * q + 3] * factor[j + one]
        result[2 * i] = w
        result[2 * i + 1] = t


def warm_up() -> None:
    """Compile the kernel, or load it from Numba's cache, before the clock of a march starts."""
    kinds = np.zeros(1, dtype=np.int32)
    one, three = np.zeros(1, dtype=np.int64), np.zeros((1, 3), dtype=np.int64)
    multiply(kinds, np.zeros((1, 12)), three, one, np.zeros(2), np.zeros(2))
