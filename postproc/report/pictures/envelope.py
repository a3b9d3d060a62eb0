"""Thins a curve for a picture so that every peak stays visible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Curves of fewer points are drawn as they are; of others two points a bin, the smallest and the
# largest value: several bins for each dot of a picture.
MOST_POINTS, _BINS = 20_000, 5_000


def thinned(y: np.ndarray) -> np.ndarray | slice:
    """Points of a curve that are drawn, as an index for ``x`` and ``y``.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Values of the curve in order; NaN leaves a gap where all values of a bin are NaN.
    """
    return slice(None) if y.size <= MOST_POINTS else _extremes(y)


def thinned_ranges(low: np.ndarray, high: np.ndarray) -> np.ndarray | slice:
    """Likewise of ranges, from ``low`` to ``high`` (n,): the extremes of both ends are drawn."""
    if low.size <= MOST_POINTS:
        return slice(None)
    return np.union1d(_extremes(low), _extremes(high))


def _extremes(y: np.ndarray) -> np.ndarray:
    """Indices of the smallest and the largest value of each bin."""
    size = -(-y.size // _BINS)
    n_whole = y.size // size
    blocks = y[: n_whole * size].reshape(n_whole, size)
    first = size * np.arange(n_whole)
    lowest, highest = _place(blocks, np.argmin, np.inf), _place(blocks, np.argmax, -np.inf)
    ends = [0, y.size - 1]
    return np.unique(
        np.concatenate([ends, first + lowest, first + highest, np.arange(n_whole * size, y.size)])
    )


def _place(
    blocks: np.ndarray, which: Callable[[np.ndarray], np.intp], instead: float
) -> np.ndarray:
    """Index of the extreme in each block; 0 if all values are NaN."""
    found = np.empty(blocks.shape[0], dtype=np.int64)
    for number, block in enumerate(blocks):
        gaps = np.isnan(block)
        found[number] = which(np.where(gaps, instead, block) if gaps.any() else block)
    return found
