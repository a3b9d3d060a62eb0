"""Reads tables of a result file by blocks of rows, so that no whole table is ever in memory."""

from __future__ import annotations

from collections.abc import Iterator

import h5py
import numpy as np

# Largest size of a block of rows [B].
BLOCK_BYTES = 16e6
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


def column(dataset: h5py.Dataset, part: slice, index: int) -> np.ndarray:
    """One column of some rows of a table, (rows,).

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
