"""Thins a curve for a picture so that every peak stays visible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Curves of fewer points are drawn as they are; of others two points a bin, the smallest and the
# largest value: several bins for each dot of a picture.
MOST_POINTS, _BINS = 20_000, 5_000


def thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A curve as it looks with few points, both arrays of the same length.

    Parameters
    ----------
    x, y : (n,) in order; values of ``y`` that are NaN leave a gap where all of a bin are
    """
    if x.size <= MOST_POINTS:
        return x, y
    size = -(-x.size // _BINS)
    n_whole = x.size // size
    places = np.empty((n_whole, 2), dtype=np.int64)
    blocks = y[: n_whole * size].reshape(n_whole, size)
    first = size * np.arange(n_whole)
    places[:, 0] = first + _place(blocks, np.argmin, np.inf)
    places[:, 1] = first + _place(blocks, np.argmax, -np.inf)
    places.sort(axis=1)
    chosen = np.concatenate([[0], places.ravel(), np.arange(n_whole * size, x.size)])
    chosen = np.unique(np.append(chosen, x.size - 1))
    return x[chosen], y[chosen]


def _place(
    blocks: np.ndarray, which: Callable[[np.ndarray], np.intp], instead: float
) -> np.ndarray:
    """Where in each block the extreme is; the first place where all of them are NaN."""
    found = np.empty(blocks.shape[0], dtype=np.int64)
    for number, block in enumerate(blocks):
        gaps = np.isnan(block)
        found[number] = which(np.where(gaps, instead, block) if gaps.any() else block)
    return found
