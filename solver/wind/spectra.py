"""Spectra of gusts: variance between frequencies, in closed form.

One-sided over the frequency n [Hz]; u* is the friction velocity, U the mean speed, z the height.

Along the mean wind, A. G. Davenport (1961): n S / u*^2 = 4 x^2 / (1 + x^2)^(4/3), x = 1200 n / U10;
or T. von Karman (1948): n S / s^2 = 4 y / (1 + 70.8 y^2)^(5/6), y = n L / U, s^2 = 6 u*^2.
Upward, H. A. Panofsky and R. A. McCormick (1960): n S / u*^2 = 6 f / (1 + 4 f)^2, f = n z / U.
Across it, J. C. Kaimal et al. (1972): n S / u*^2 = 15 f / (1 + 9.5 f)^(5/3).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.solver.problem.wind import Wind

# A gust that is hardly exceeded in ten minutes, in standard deviations.
PEAK = 3.5
# Parts of a gust: along the mean wind, across it to the left, upward.
ALONG, ACROSS, UPWARD = range(3)


def variance_below(wind: Wind, part: int) -> Callable[[np.ndarray], np.ndarray]:
    """Variance [m2/s2] of a part of the gusts below frequencies [Hz], as a function of these."""
    gusts = wind.gusts
    assert gusts is not None
    square, mean, height = gusts.friction_velocity**2, wind.mean, wind.height
    if part == UPWARD:

        def upward(n: np.ndarray) -> np.ndarray:
            return np.asarray(1.5 * square * (1.0 - 1.0 / (1.0 + 4.0 * n * height / mean)))

        return upward
    if part == ACROSS:

        def across(n: np.ndarray) -> np.ndarray:
            left = (1.0 + 9.5 * n * height / mean) ** (-2.0 / 3.0)
            return np.asarray(22.5 / 9.5 * square * (1.0 - left))

        return across
    if gusts.spectrum == "von_karman":
        from scipy.special import hyp2f1  # not loaded for air without gusts

        def karman(n: np.ndarray) -> np.ndarray:
            y = n * gusts.length_scale / mean
            return np.asarray(24.0 * square * y * hyp2f1(0.5, 5.0 / 6.0, 1.5, -70.8 * y**2))

        return karman
    at_ten = float(wind.speed * wind.profile.growth(10.0, wind.reference_height))

    def davenport(n: np.ndarray) -> np.ndarray:
        x = 1200.0 * n / at_ten
        return np.asarray(6.0 * square * (1.0 - (1.0 + x**2) ** (-1.0 / 3.0)))

    return davenport
