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
from catenary.solver.base.pointers import borrowed
from catenary.solver.linear.lane_products import (
    add_beside,
    add_own,
    numbers_from,
    sums_from,
    total_of,
)
from catenary.solver.linear.lanes import beside_size, is_damped, load, own_size, pitch, store, zero
from catenary.solver.linear.station_layout import WIDEST, Layout
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
    widths = _planes((operator != 0).any(axis=(0, 1)) | (stiffness != 0).any(axis=(0, 1)))
    if max(widths) > WIDEST:
        return None
    return _joining(Layout(widths, (), ()), stiffness)


def with_damping(layout: Layout, damping: np.ndarray | None) -> Layout:
    """The same for products with C, by its blocks, as well."""
    found = layout if damping is None else _joining(layout, damping)
    return Layout(found.widths, found.own, found.beside, damped=True)


def _joining(layout: Layout, blocks: np.ndarray) -> Layout:
    """A layout for a matrix of these blocks, see ``neighbours``, too."""
    joined = (blocks != 0).any(axis=1)
    own = layout.differences(joined[1])
    beside = layout.differences(joined[0] | joined[2])
    return Layout(
        layout.widths,
        tuple(sorted({*layout.own, *own})),
        tuple(sorted({*layout.beside, *beside})),
    )


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
        size = layout.own_terms.sources.size + 2 * layout.beside_terms.sources.size
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
    parts, beside = [], layout.beside_terms
    for rows, sign in ((matrix, 1.0), (damping, -1.0)):
        if rows is None:
            continue
        blocks = neighbours(rows, first)
        if blocks is None:
            return None
        for place, terms in ((1, layout.own_terms), (0, beside), (2, beside)):
            block = blocks[place]
            packed = layout.packed(block, terms)
            if np.count_nonzero(packed) != np.count_nonzero(block):
                return None
            parts.append(sign * packed)
    return StationProduct(layout, *by_kinds(np.concatenate(parts, axis=1)), first + 1)


@in_line
def row_sums(multiplied, row, positions, velocities):
    """Sums of a row of a product, with what the factor and the velocity hold before, at and after
    its station.

    ``multiplied`` holds layout, kinds, blocks and first of ``StationProduct`` and both vectors.
    """
    layout, kinds, blocks, _, _, _ = multiplied
    size, beside = own_size(layout), beside_size(layout)
    stored = size + np.uint64(2) * beside
    if is_damped(layout):
        numbers = numbers_from(blocks, np.uint64(2) * stored * np.uint64(kinds[np.uint64(row)]))
    else:
        numbers = numbers_from(blocks, stored * np.uint64(kinds[np.uint64(row)]))
    sums = sums_from(layout, zero(layout))
    sums = add_own(layout, sums, numbers, np.uint64(0), positions[1])
    sums = add_beside(layout, sums, numbers, size, positions[0])
    sums = add_beside(layout, sums, numbers, size + beside, positions[2])
    if is_damped(layout):
        sums = add_own(layout, sums, numbers, stored, velocities[1])
        sums = add_beside(layout, sums, numbers, stored + size, velocities[0])
        sums = add_beside(layout, sums, numbers, stored + size + beside, velocities[2])
    return sums


@in_line
def read_station(multiplied, row):
    """What the factor and the velocity hold at the station of a row, which may be one before or
    after all rows."""
    layout, _, _, first, factor, velocity = multiplied
    # Indices are unsigned, which spares a check for negative ones.
    at = pitch(layout) * np.uint64(first + row)
    position = load(layout, factor, at)
    if is_damped(layout):
        return position, load(layout, velocity, at)
    return position, position


@compiled
def multiply(layout, kinds, blocks, first, factor, velocity, result):
    """``result`` = K ``factor``, less C ``velocity``; see ``StationProduct``."""
    multiplied = borrowed((layout, kinds, blocks, first, factor, velocity))
    result = borrowed(result)
    before, here = read_station(multiplied, -1), read_station(multiplied, 0)
    for i in range(np.uint64(kinds.size)):
        after = read_station(multiplied, np.int64(i) + 1)
        positions, velocities = (before[0], here[0], after[0]), (before[1], here[1], after[1])
        row = total_of(layout, row_sums(multiplied, i, positions, velocities))
        store(layout, result, pitch(layout) * i, row)
        before, here = here, after
