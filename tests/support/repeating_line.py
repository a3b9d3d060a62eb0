"""A matrix like a line's: block tridiagonal, and the same from span to span."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import sparse

from catenary.solver.linear import station_factors as factored
from catenary.solver.linear import station_products as multiplied
from catenary.solver.linear.station_factors import StationFactors
from catenary.solver.linear.station_products import Layout, StationProduct, layout_of
from catenary.solver.linear.station_rows import Sections, StationRows, places_of

# Unknowns of stations, plane by plane, whose loops shipped cases need in any case. Loops of others
# take some seconds each to compile, and are left to whole studies.
SHIPPED_WIDTHS = ((4,), (6,), (4, 4))
# Which unknowns of a station the matrices of a line join, by the exclusive or of their places in a
# plane: of two wires deflections and slopes with each other, of three as in a compound line.
# Matrices like these have the loops of real lines, which are compiled once.
_JOINED = {4: (0, 1, 2), 6: (0, 1, 2, 6)}


def widths_of(*widths: tuple[int, ...]) -> list[Any]:
    """Parameters of a test over widths; those that no shipped case has are marked ``study``."""
    return [
        pytest.param(those, marks=() if those in SHIPPED_WIDTHS else pytest.mark.study)
        for those in widths
    ]


def line(
    n_stations: int,
    period: int = 7,
    widths: tuple[int, ...] = (4,),
    joined: bool = False,
    wire: np.ndarray | None = None,
    full: bool = False,
) -> sparse.bsr_matrix:
    """A positive definite block tridiagonal matrix that repeats but at its ends.

    Stations have planes of ``widths`` unknowns, and are joined by pairs of unknowns, unless all of
    a plane is ``joined`` between them; with a ``wire`` (size,) of each only those of one wire are.
    Within a station unknowns are joined as in a line, or all of a plane if it is ``full`` or
    ``joined``.
    """
    rng = np.random.default_rng(7)
    size = sum(widths)
    plane = np.repeat(np.arange(len(widths)), widths)
    together = plane[:, None] == plane
    own = rng.standard_normal((period, size, size)) * together
    own = own @ own.transpose(0, 2, 1) + 8.0 * size * np.eye(size)
    if not (full or joined):
        own *= _joins(widths)
    beside = rng.standard_normal((period, size, size)) * together
    if not joined:
        pair = np.arange(size) // 2
        beside *= pair[:, None] == pair
    if wire is not None:
        beside *= wire[:, None] == wire
    data, indices, indptr = [], [], [0]
    for i in range(n_stations):
        if i > 0:
            data.append(beside[(i - 1) % period].T)
            indices.append(i - 1)
        data.append(own[i % period])
        indices.append(i)
        if i + 1 < n_stations:
            data.append(beside[i % period])
            indices.append(i + 1)
        indptr.append(len(indices))
    shape = (size * n_stations, size * n_stations)
    return sparse.bsr_matrix((np.array(data), indices, indptr), shape=shape)


def _joins(widths: tuple[int, ...]) -> np.ndarray:
    """Which pairs of unknowns (size, size) a station of a line may join."""
    place = np.concatenate([np.arange(width) for width in widths])
    wide = np.repeat(widths, widths)
    apart = place[:, None] ^ place
    known = [np.isin(apart, terms) | (wide != width) for width, terms in _JOINED.items()]
    return np.logical_and.reduce(known)


def layout(matrix: sparse.bsr_matrix) -> Layout:
    """Layout for products with a matrix and for its factors."""
    blocks = neighbours(matrix)
    assert blocks is not None
    found = layout_of(blocks, blocks)
    assert found is not None
    return found


def sections_of(present: np.ndarray) -> Sections:
    """Stations that have the places ``present`` (n_stations, width) of a cross-section."""
    rows, station_type = np.unique(present, axis=0, return_inverse=True)
    station_types = tuple(tuple(map(int, np.flatnonzero(row))) for row in rows)
    starts = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
    return Sections(starts, station_type, station_types, present.shape[1])


def lacking(matrix: sparse.bsr_matrix, present: np.ndarray) -> sparse.bsr_matrix:
    """A matrix without the rows and columns that stations lack, in blocks of one."""
    kept = np.flatnonzero(present.ravel())
    part = matrix.tocsr()[kept][:, kept].tobsr((1, 1))
    part.sort_indices()
    return part


def holding(matrix: sparse.bsr_matrix, held: np.ndarray) -> sparse.bsr_matrix:
    """A matrix whose unknowns ``held`` (n_stations, width) are joined to nothing."""
    free = sparse.diags((~held.ravel()).astype(float))
    return (free @ matrix @ free + sparse.diags(held.ravel().astype(float))).tobsr(matrix.blocksize)


def alike(n: int, width: int) -> Sections:
    """Stations that have all places."""
    return Sections(
        width * np.arange(n + 1), np.zeros(n, dtype=np.int64), (tuple(range(width)),), width
    )


def neighbours(
    matrix: sparse.bsr_matrix, first: int = 0, columns: Sections | None = None
) -> np.ndarray | None:
    """Blocks of each row towards the start of the line, on the diagonal and towards the end.

    Row i has its diagonal block in column ``first`` + i. Shape (3, n, b, b); None if the matrix has
    blocks further away. ``columns`` are the stations of the columns; a matrix without has one block
    for each.
    """
    if columns is not None and columns.varies:
        return _of_varying(matrix, first, columns)
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


def _of_varying(matrix: sparse.bsr_matrix, first: int, columns: Sections) -> np.ndarray | None:
    """``neighbours`` of a matrix in blocks of any size."""
    entries = matrix.tocoo()
    n = int(np.searchsorted(columns.starts, columns.starts[first] + matrix.shape[0])) - first
    rows, row_place = places_of(entries.row + columns.starts[first], columns)
    others, place = places_of(entries.col, columns)
    rows -= first
    step = others - rows - first
    there = entries.data != 0
    if n == 0 or np.abs(step[there]).max(initial=0) > 1:
        return None
    blocks = np.zeros((3, n, columns.width, columns.width))
    blocks[step[there] + 1, rows[there], row_place[there], place[there]] = entries.data[there]
    return blocks


def rows_of(
    matrix: sparse.bsr_matrix, first: int = 0, columns: Sections | None = None
) -> StationRows | None:
    """Rows of a matrix in sorted blocks, each a kind of its own; ``first`` and ``columns`` as in
    ``neighbours``."""
    blocks = neighbours(matrix, first, columns)
    if blocks is None:
        return None
    every = np.arange(blocks.shape[1])
    return StationRows(every.astype(np.int32), every, blocks)


def station_product(
    matrix: sparse.bsr_matrix,
    first: int,
    layout: Layout,
    damping: sparse.bsr_matrix | None = None,
    columns: Sections | None = None,
) -> StationProduct | None:
    """Products with a matrix in sorted blocks, of stations that are alike if no columns are given;
    None if they cannot be made."""
    rows = rows_of(matrix, first, columns)
    damped = None if damping is None else rows_of(damping, first, columns)
    if rows is None:
        return None
    columns = columns or alike(first + rows.kinds.size + 1, layout.pitch)
    return multiplied.station_product(rows, first, layout, columns, damped)


def station_factors(
    matrix: sparse.bsr_matrix,
    layout: Layout,
    low: int = 0,
    high: int | None = None,
    stations: Sections | None = None,
    turns: bool = False,
) -> StationFactors | None:
    """Factors of a matrix in sorted blocks, of stations that are alike if none are given."""
    rows = rows_of(matrix, 0, stations)
    if rows is None:
        return None
    stations = stations or alike(rows.kinds.size, layout.pitch)
    return factored.station_factors(rows, layout, stations, low, high, turns)
