"""Rows of growing tables: appended, written where a window reaches, cut, and read in blocks.

Not collective.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import h5py
import numpy as np
from h5py import h5s

from catenary.postproc.files.hdf5.checked import HDF5_ERRORS

_NO_FILTER = 0xFFFFFFFF


def append_rows(dataset: h5py.Dataset, start: int, rows: np.ndarray) -> None:
    """Write ``rows`` (n, ...) behind the first ``start`` of a growing dataset, which ends there."""
    grow((dataset,), start + rows.shape[0])
    if not rows.size:
        return
    block = np.ascontiguousarray(rows, dtype=np.float64)
    there = dataset.id.get_space()
    there.select_hyperslab((start,) + (0,) * (block.ndim - 1), block.shape)
    dataset.id.write(h5s.create_simple(block.shape), there, block)


def grow(datasets: Iterable[h5py.Dataset], rows: int) -> None:
    """Resize growing datasets to so many rows, which read as NaN until they are written."""
    for dataset in datasets:
        dataset.id.set_extent((rows, *dataset.id.shape[1:]))


def write_window(
    dataset: h5py.Dataset,
    start: int,
    values: tuple[int, np.ndarray],
    x: np.ndarray,
    edges: tuple[np.ndarray, np.ndarray],
) -> None:
    """Write rows from ``start`` on, NaN outside of a window. Not collective.

    Chunks without a value in the window are not touched: they take no room in the file.

    Parameters
    ----------
    dataset : h5py.Dataset
        Table with chunks.
    start : int
        First row to be written.
    values : tuple
        Number of the first column that is given, and the columns (rows, columns), which
        reach over the window of each row.
    x : ndarray, shape (columns,)
        Places of the columns [m].
    edges : tuple of ndarray
        First and last place of the window at each row, (rows,) each [m].
    """
    rows, columns = dataset.chunks
    low, high = edges
    given, numbers = values
    end = start + numbers.shape[0]
    for first in range(start - start % rows, end, rows):
        part = slice(max(first, start), min(first + rows, end))
        own = slice(part.start - start, part.stop - start)
        near = np.flatnonzero((x >= low[own].min()) & (x <= high[own].max()))
        for block in np.unique(near // columns):
            across = slice(block * columns, min((block + 1) * columns, x.size))
            at = x[across]
            inside = (at >= low[own, None]) & (at <= high[own, None])
            if inside.any():
                kept = slice(max(across.start, given), min(across.stop, given + numbers.shape[1]))
                shown = np.full(inside.shape, np.nan)
                there = slice(kept.start - across.start, kept.stop - across.start)
                shown[:, there] = numbers[own, kept.start - given : kept.stop - given]
                dataset[part, across] = np.where(inside, shown, np.nan)


class DamagedClock(Exception):
    """A table of times cannot be read; the message is a clause."""


def rows_before(clock: h5py.Dataset, n: int, time: float) -> int:
    """Number of the first ``n`` times of a ``clock``, a table of ascending times, before ``time``
    [s]; `DamagedClock` if they cannot be read."""
    try:
        return int(np.searchsorted(clock[:n], time))
    except OSError as error:
        raise DamagedClock(f"{clock.name[1:]} is damaged") from error


def shorten(file: h5py.File, path: str, rows: int) -> int:
    """Cut a growing table to ``rows``; returns how many of them were found lost at its end.

    HDF5 reads the last chunk that stays in part, and refuses to cut it or to append to it if its
    checksum is wrong. Such a chunk is replaced by one of NaN. The table must not be open elsewhere.
    """
    lost = _mend_end(file[path], rows)
    # Opened anew: an open table remembers the chunk that it has read last, filters included.
    table = file[path]
    table.resize(min(rows, table.shape[0]), axis=0)
    return lost


def _mend_end(table: h5py.Dataset, rows: int) -> int:
    """Replace damaged chunks of the last ``rows`` that stay; returns how many rows are lost."""
    lost = 0
    rows = min(rows, table.shape[0])
    begin = rows - rows % table.chunks[0]
    width = table.chunks[1] if table.ndim > 1 else 1
    for first in range(0, table.shape[1] if table.ndim > 1 else 1, width):
        part = (slice(begin, rows), slice(first, first + width))[: table.ndim]
        try:
            table[part]
        except OSError:
            empty = np.full(table.chunks, np.nan, dtype=table.dtype)
            table.id.write_direct_chunk((begin, first)[: table.ndim], empty.tobytes(), _NO_FILTER)
            lost = rows - begin
    return lost


# Largest size of a block of rows [B].
BLOCK_BYTES = 16e6
# Columns of a wide table that are read at once.
COLUMNS_AT_ONCE = 256
# Rows of a column that are read at once.
_SLICE = 1 << 18


def row_blocks(n_rows: int, n_columns: int, step: int = 1) -> Iterator[slice]:
    """Rows 0 to ``n_rows`` in order, in slices that start at multiples of ``step``.

    Parameters
    ----------
    n_rows : int
        Rows of the table.
    n_columns : int
        Columns that are read, 8 bytes each.
    step : int, optional
        Rows of a chunk.
    """
    rows = max(1, int(BLOCK_BYTES / (8 * max(n_columns, 1))))
    rows = max(step, rows - rows % step)
    for start in range(0, n_rows, rows):
        yield slice(start, min(start + rows, n_rows))


def unwritten(dataset: h5py.Dataset, part: slice, columns: slice) -> bool:
    """Whether part of a table reads as NaN because none of its chunks was ever written.

    With a window those are most of a long line, and HDF5 takes longer to fill them than it marched.
    """
    if not dataset.chunks or not np.isnan(dataset.fillvalue):
        return False
    down, across = dataset.chunks
    last = min(columns.stop, dataset.shape[1])
    return not any(
        _is_written(dataset, (row, column))
        for row in range(part.start - part.start % down, part.stop, down)
        for column in range(columns.start - columns.start % across, last, across)
    )


def _is_written(dataset: h5py.Dataset, corner: tuple[int, int]) -> bool:
    """Whether the chunk at a corner is in the file; of one that cannot be read that is supposed."""
    try:
        return len(dataset.id.read_direct_chunk(corner)[1]) > 0
    except HDF5_ERRORS as error:
        return "not allocated" not in str(error)


def column(dataset: h5py.Dataset, part: slice, index: int) -> np.ndarray:
    """Column number ``index`` of the rows ``part`` of a table, (rows,).

    In slices: of all chunks that it reads at once HDF5 makes tables, and keeps their memory.
    """
    values = np.empty(part.stop - part.start)
    for start in range(0, values.size, _SLICE):
        own = slice(start, min(start + _SLICE, values.size))
        rows = np.s_[part.start + own.start : part.start + own.stop, index]
        dataset.read_direct(values[own], rows)
    return values


def extremes(dataset: h5py.Dataset, n_rows: int) -> np.ndarray:
    """Smallest and largest value of each column, (2, columns); NaN if there are no rows."""
    n_columns = dataset.shape[1]
    found = np.full((2, n_columns), np.nan)
    rows = dataset.chunks[0] if dataset.chunks else 1
    for part in row_blocks(n_rows, n_columns, rows):
        block = dataset[part]
        low, high = block.min(axis=0), block.max(axis=0)
        if part.start == 0:
            found[:] = low, high
        np.minimum(found[0], low, out=found[0])
        np.maximum(found[1], high, out=found[1])
    return found
