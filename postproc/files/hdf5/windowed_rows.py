"""Writes rows of a table as far as their columns are within a window that moves with the train."""

from __future__ import annotations

import h5py
import numpy as np


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
    values : the first of the columns that are given, and these (rows, columns); they reach over
        the window of each row
    x : (columns,) where the columns are [m]
    edges : from and to of the window at each row, (rows,) each [m]
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
