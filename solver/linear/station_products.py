"""Matrices in blocks of stations: block tridiagonal along the track, each unique one stored once.

A station is a cross-section of the line: the unknowns of a node of each wire at one place. Spans
are alike, so that a line has few unique stations, however long it is. Their numbers then stay in
the caches, where a stored matrix leaves them on a long line, and products and solves wait for
memory. Where no two spans are alike, blocks are read one after the other, as memory likes it best.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.base import aligned_arrays
from catenary.solver.base.bound import bound
from catenary.solver.base.compiled import compiled, in_line
from catenary.solver.linear.lanes import (
    WIDEST,
    Layout,
    add,
    add_product,
    add_product_beside,
    beside_size,
    block_size,
    is_damped,
    load,
    pitch,
    store,
    zero,
)
from catenary.solver.linear.unique_rows import kinds_of


def neighbours(matrix: sparse.bsr_matrix, first: int = 0) -> np.ndarray | None:
    """Blocks of each row towards the start of the line, on the diagonal and towards the end.

    Row i has its diagonal block in column ``first`` + i. Shape (3, n, b, b) with the matrix's size
    of blocks; None if the matrix has blocks further away.
    """
    n, (size, _) = matrix.indptr.size - 1, matrix.blocksize
    if n == 0:
        return None
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    step = matrix.indices - row - first
    if np.abs(step).max(initial=0) > 1:
        return None
    blocks = np.zeros((3, n, size, size))
    blocks[step + 1, row] = matrix.data
    return blocks


def layout_of(operator: np.ndarray, stiffness: np.ndarray) -> Layout | None:
    """Layout of a line by its blocks of A and K, see ``neighbours``.

    None if a plane is wider than kernels are.
    """
    joined = (operator != 0).any(axis=(0, 1)) | (stiffness != 0).any(axis=(0, 1))
    widths = _planes(joined)
    if max(widths) > WIDEST:
        return None
    even = all(width % 2 == 0 for width in widths)
    return Layout(widths, even and _in_pairs((stiffness[0::2] != 0).any(axis=(0, 1))))


def with_damping(layout: Layout, damping: np.ndarray | None) -> Layout:
    """The same for products with C, by its blocks, as well."""
    paired = layout.paired and damping is not None and _in_pairs((damping[0::2] != 0).any((0, 1)))
    return Layout(layout.widths, paired, damped=True)


def _in_pairs(joined: np.ndarray) -> bool:
    """Whether ``joined`` (b, b) joins the unknowns 0 and 1, 2 and 3 and so on at most."""
    rows, columns = np.nonzero(joined)
    return bool((rows // 2 == columns // 2).all())


def _planes(joined: np.ndarray) -> tuple[int, ...]:
    """Widths of the runs of unknowns that ``joined`` (b, b) does not join."""
    size = joined.shape[0]
    reach = np.where(joined | joined.T, np.arange(size), 0).max(axis=1, initial=0)
    ends = np.flatnonzero(np.maximum.accumulate(np.maximum(reach, np.arange(size))) == range(size))
    return tuple(int(width) for width in np.diff(ends, prepend=-1))


def by_kinds(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kind (n,) of each station of whose ``numbers`` (n, m), and those of the kinds in a row."""
    first, kinds = kinds_of(numbers)
    return kinds, aligned_arrays.copy(numbers[first])


class StationProduct:
    """Products with rows of K, and C if the layout is damped. Not collective.

    Attributes
    ----------
    layout : Layout
    kinds : (n,) of its rows
    blocks : of each kind the diagonal block of K, then what joins it to the stations before and
        after it; the same of -C; all as products read them, see ``Layout``
    first : station in the factor of the first row; the factor has one before and one after all
        rows, which is zero where the line ends
    n_kinds : how many rows are different
    """

    def __init__(self, layout: Layout, kinds: np.ndarray, blocks: np.ndarray, first: int) -> None:
        self.layout, self.kinds, self.blocks, self.first = layout, kinds, blocks, first
        size = layout.partners.size + 2 * layout.partners_beside.size
        self.n_kinds = blocks.size // (size * (1 + layout.damped))
        vectors = np.zeros(0), np.zeros(0), np.zeros(0)
        self._multiply = bound(multiply, layout, kinds, blocks, first, later=vectors)

    def multiply(
        self, factor: np.ndarray, result: np.ndarray, velocity: np.ndarray | None = None
    ) -> None:
        """Make ``result`` K ``factor``, less C ``velocity`` if the layout is damped."""
        self._multiply(factor, factor if velocity is None else velocity, result)


def station_product(
    matrix: sparse.bsr_matrix,
    first: int,
    layout: Layout,
    damping: sparse.bsr_matrix | None = None,
) -> StationProduct | None:
    """Products with a matrix in sorted blocks, whose first row is that of column ``first``.

    The factor has a station more at both ends than the matrix has columns. None if the matrix joins
    what the layout does not.
    """
    parts = []
    for rows, sign in ((matrix, 1.0), (damping, -1.0)):
        if rows is None:
            continue
        blocks = neighbours(rows, first)
        if blocks is None:
            return None
        for block, beside in ((blocks[1], False), (blocks[0], True), (blocks[2], True)):
            packed = layout.packed(block, beside)
            if np.count_nonzero(packed) != np.count_nonzero(block):
                return None
            parts.append(sign * packed)
    return StationProduct(layout, *by_kinds(np.concatenate(parts, axis=1)), first + 1)


@in_line
def multiply_row(layout, kinds, blocks, row, factors, velocities):
    """A row of a product with what ``factors`` and ``velocities`` hold before, at and after the
    station; see ``StationProduct``."""
    size, beside = block_size(layout), beside_size(layout)
    before, here, after = factors
    if is_damped(layout):
        at = np.uint64(2) * (size + np.uint64(2) * beside) * np.uint64(kinds[row])
    else:
        at = (size + np.uint64(2) * beside) * np.uint64(kinds[row])
    total = add_product(layout, zero(layout), blocks, at, here)
    total = add_product_beside(layout, total, blocks, at + size, before)
    total = add_product_beside(layout, total, blocks, at + size + beside, after)
    if is_damped(layout):
        before, here, after = velocities
        at += size + np.uint64(2) * beside
        total = add_product(layout, total, blocks, at, here)
        total = add_product_beside(layout, total, blocks, at + size, before)
        total = add_product_beside(layout, total, blocks, at + size + beside, after)
    return total


@in_line
def multiply_rows(multiplied, loads, begin, end, result):
    """Rows from ``begin`` to ``end`` of a product, and of ``loads`` if there are any.

    ``multiplied`` holds layout, kinds, blocks and first of ``StationProduct`` and both factors.
    """
    layout, kinds, blocks, first, factor, velocity = multiplied
    width = pitch(layout)
    # Indices are unsigned, which spares a check for negative ones.
    at = width * np.uint64(first + begin)
    before, here = load(layout, factor, at - width), load(layout, factor, at)
    v_before = v_here = v_after = before
    if is_damped(layout):
        v_before, v_here = load(layout, velocity, at - width), load(layout, velocity, at)
    for i in range(begin, end):
        at = width * np.uint64(first + i + 1)
        after = load(layout, factor, at)
        if is_damped(layout):
            v_after = load(layout, velocity, at)
        factors, velocities = (before, here, after), (v_before, v_here, v_after)
        row = multiply_row(layout, kinds, blocks, i, factors, velocities)
        if loads.size > 0:
            row = add(row, load(layout, loads, width * np.uint64(i)))
        store(layout, result, width * np.uint64(i), row)
        before, here = here, after
        v_before, v_here = v_here, v_after


@compiled
def multiply(layout, kinds, blocks, first, factor, velocity, result):
    """``result`` = K ``factor``, less C ``velocity``; see ``StationProduct``."""
    multiplied = layout, kinds, blocks, first, factor, velocity
    multiply_rows(multiplied, blocks[:0], 0, kinds.size, result)
