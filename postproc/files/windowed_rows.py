"""Writes rows of a table as far as their columns are within a window that moves with the train."""

from __future__ import annotations

import h5py
import numpy as np


def write_window(
    dataset: h5py.Dataset,
    start: int,
    values: np.ndarray,
    x: np.ndarray,
    edges: tuple[np.ndarray, np.ndarray],
) -> None:
    """Write rows from ``start`` on, NaN outside of a window. Not collective.

    Chunks without a value in the window are not touched: they take no room in the file.

    Parameters
    ----------
    values : (rows, columns)
    x : (columns,) where the columns are [m]
    edges : from and to of the window at each row, (rows,) each [m]
    """
    rows, columns = dataset.chunks
    low, high = edges
    end = start + values.shape[0]
    for first in range(start - start % rows, end, rows):
        part = slice(max(first, start), min(first + rows, end))
        own = slice(part.start - start, part.stop - start)
        near = np.flatnonzero((x >= low[own].min()) & (x <= high[own].max()))
        for block in np.unique(near // columns):
            across = slice(block * columns, min((block + 1) * columns, x.size))
            at = x[across]
            inside = (at >= low[own, None]) & (at <= high[own, None])
            if inside.any():
                dataset[part, across] = np.where(inside, values[own, across], np.nan)
