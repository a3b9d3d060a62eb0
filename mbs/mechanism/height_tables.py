"""Tables over the height of a mechanism as cubic splines.

What `scipy.interpolate.CubicSpline` does by default, to the last bit of the coefficients. Its
package imports `scipy.optimize` and `scipy.special` besides, a twelfth of the way to a first step.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

from catenary.mbs.head.head_arrays import SplineTables


def height_tables(heights: np.ndarray, columns: np.ndarray) -> SplineTables:
    """Cubic splines through points, with the same cubic before and behind the second point and the
    last but one ("not a knot"). Not collective.

    Parameters
    ----------
    heights : ndarray, shape (n,) [m], growing, n >= 4
    columns : ndarray, shape (n, m), what is tabulated

    References
    ----------
    C. de Boor, A practical guide to splines, 1978, chapter IV.
    """
    gaps = np.diff(heights)
    gap = gaps[:, None]
    secants = np.diff(columns, axis=0) / gap
    first, last = heights[2] - heights[0], heights[-1] - heights[-3]
    bands = np.zeros((3, heights.size))
    bands[1, 1:-1] = 2.0 * (gaps[:-1] + gaps[1:])
    bands[0, 2:], bands[2, :-2] = gaps[:-1], gaps[1:]
    bands[1, 0], bands[0, 1] = gaps[1], first
    bands[1, -1], bands[2, -2] = gaps[-2], last
    right = np.empty_like(columns)
    right[1:-1] = 3.0 * (gap[1:] * secants[:-1] + gap[:-1] * secants[1:])
    right[0] = ((gaps[0] + 2.0 * first) * gaps[1] * secants[0] + gaps[0] ** 2 * secants[1]) / first
    right[-1] = (
        gaps[-1] ** 2 * secants[-2] + (2.0 * last + gaps[-1]) * gaps[-2] * secants[-1]
    ) / last
    slopes = solve_banded((1, 1), bands, right, overwrite_ab=True, overwrite_b=True)
    bend = (slopes[:-1] + slopes[1:] - 2.0 * secants) / gap
    cubics = [bend / gap, (secants - slopes[:-1]) / gap - bend, slopes[:-1], columns[:-1]]
    return SplineTables(np.array(heights, dtype=float), np.stack(cubics, axis=-1))
