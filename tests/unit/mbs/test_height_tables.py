"""Tables over the height of a mechanism against SciPy's cubic splines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from catenary.mbs.mechanism.height_tables import height_tables


@pytest.mark.parametrize("n", [4, 5, 60])
def test_tables_are_the_splines_of_scipy(n: int) -> None:
    random = np.random.default_rng(n)
    heights = 0.5 + np.cumsum(random.uniform(1e-3, 0.05, n))
    columns = random.normal(size=(n, 3)) * [20.0, 150.0, 5.0]
    tables, spline = height_tables(heights, columns), CubicSpline(heights, columns)
    # The same formulas in the same order: round-off of the solution alone.
    size = np.abs(spline.c).max(axis=(1, 2))
    apart = np.abs(tables.coefficients - spline.c.transpose(1, 2, 0)).max(axis=(0, 1))
    assert np.all(apart <= 1e-12 * size)
    for height in random.uniform(heights[0], heights[-1], 20):
        values, slopes = tables.at(height)
        np.testing.assert_allclose(values, spline(height), rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(slopes, spline(height, 1), rtol=1e-9, atol=1e-7)


def test_a_cubic_is_kept() -> None:
    heights = np.array([0.0, 0.3, 0.4, 1.0, 1.2])
    tables = height_tables(heights, (2.0 * heights**3 - heights)[:, None])
    values, slopes = tables.at(0.75)
    assert values[0] == pytest.approx(2.0 * 0.75**3 - 0.75, rel=1e-13)
    assert slopes[0] == pytest.approx(6.0 * 0.75**2 - 1.0, rel=1e-12)
