"""Zeros of continuous maps without derivatives: Merrill's path of simplices.

O. H. Merrill, Applications and extensions of an algorithm that computes fixed points of certain
upper semi-continuous point to set mappings, dissertation, University of Michigan (1972); E. L.
Allgower and K. Georg, Numerical continuation methods, Springer (1990), chapters 12 and 13.

The space and a level between 0 and 1 are cut into simplices (Freudenthal's triangulation), all with
their corners on the two levels. On level 0 stands z - start, on level 1 the map, between them what
is linear in each simplex. Its zeros are a path that starts at the one on level 0. It cannot come
back there, so it arrives at level 1 where the map points away from a point on a large sphere
around it. Finer grids from there on, each with a path of its own, leave a zero as exact as wanted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Corners of the first simplex lie so around the start that no face of a grid holds a zero of a map
# with whole numbers in it, which would make two steps of a path equally good.
_SKEW = (np.sqrt(5.0) - 1.0) / 2.0
# Each grid is so much finer than the one before.
_FINER = 0.25
# No grid is finer than round-off of the places in it.
_FINEST = 1e-14
# A column that enters takes this much of another, or none.
_NOTHING = 1e-12
# Simplices of one path; it has some n^2 of them on a grid as wide as the way to go.
_MOST_SIMPLICES = 20_000


def find_zero(
    of: Callable[[np.ndarray], np.ndarray], start: np.ndarray, width: float, small: float
) -> tuple[np.ndarray, bool]:
    """Find a zero of a continuous map of R^n to itself.

    Parameters
    ----------
    of : the map, (n,) to (n,), known to less than ``small``, with (z - start) . of(z) > 0 for all z
        that are far from the start
    start : (n,) where to begin; the better, the shorter the path
    width : of the first grid, in units of z
    small : the largest component of the map that counts as zero

    Returns
    -------
    z : (n,) the last place looked at
    found : whether it is a zero; False if the path is too long, or the map is no number on it
    """
    at = start
    while width > _FINEST:
        value = of(at)
        if np.abs(value).max() <= small:
            return at, True
        try:
            arrived = _path(of, at, width)
        except np.linalg.LinAlgError:  # of a map that does not point back from afar
            arrived = None
        if arrived is None:
            return at, False
        at, width = arrived, width * _FINER
    return at, bool(np.abs(of(at)).max() <= small)


def _path(
    of: Callable[[np.ndarray], np.ndarray], start: np.ndarray, width: float
) -> np.ndarray | None:
    """(n,) The zero on level 1 of what is linear between the corners of a grid."""
    n = start.size
    # Shares of the start in the n + 1 corners of the first simplex, all positive.
    shares = 1.0 + _SKEW ** np.arange(1, n + 2)
    shares /= shares.sum()
    # Steps from corner to corner go along the axes in this order; the last axis is the level.
    order = np.arange(n + 1)
    first = np.zeros(n + 1, dtype=int)
    origin = start - width * np.cumsum(shares[::-1])[::-1][1:]

    def column(corner: np.ndarray) -> np.ndarray:
        at = origin + width * corner[:-1]
        value = of(at) if corner[-1] else at - start
        return np.append(value / width, 1.0)  # of like size in all rows, however fine the grid

    def corners() -> np.ndarray:
        steps = np.zeros((n + 2, n + 1), dtype=int)
        steps[np.arange(1, n + 2), order] = 1
        return first + np.cumsum(steps, axis=0)

    columns = np.stack([column(corner) for corner in corners()[:-1]], axis=1)
    zero = np.append(np.zeros(n), 1.0)
    held, enters = list(range(n + 1)), n + 1  # corners whose columns are the basis, and the new one
    for _ in range(_MOST_SIMPLICES):
        new = column(corners()[enters])
        if not np.isfinite(new).all():
            return None
        weights, change = np.linalg.solve(columns, np.stack([zero, new], axis=1)).T
        growing = change > _NOTHING
        ratios = np.full(n + 1, np.inf)
        ratios[growing] = weights[growing] / change[growing]
        leaves = int(np.argmin(ratios))
        if not np.isfinite(ratios[leaves]):
            return None
        gone, held[leaves] = held[leaves], enters
        columns[:, leaves] = new
        kept = corners()[held]
        if kept[:, -1].all():
            return np.linalg.solve(columns, zero) @ (origin + width * kept[:, :-1])
        # The simplex behind the face opposite to the corner that is gone.
        if gone == 0:
            first = first + np.eye(n + 1, dtype=int)[order[0]]
            order, enters = np.roll(order, -1), n + 1
            held = [number - 1 for number in held]
        elif gone == n + 1:
            first = first - np.eye(n + 1, dtype=int)[order[-1]]
            order, enters = np.roll(order, 1), 0
            held = [number + 1 for number in held]
        else:
            order[[gone - 1, gone]] = order[[gone, gone - 1]]
            enters = gone
    return None
