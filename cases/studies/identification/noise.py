"""Noise of a filtered measurement: how its samples are correlated, and made independent."""

from __future__ import annotations

import numpy as np
from scipy import linalg
from scipy.integrate import trapezoid

from catenary.postproc.evaluate.filters import power_kept

# The slowest pole decays with sin(pi/12) 2 pi fc, so that 1e-8 is left after so many periods.
_REMEMBERED = 12.0


def correlation(lags: np.ndarray, cut_off: float, dt: float | None = None) -> np.ndarray:
    """Correlation (n,) of white noise that passed the filter of `filters.low_pass`.

    The filter runs both ways, so that its gain is G(f) = 1 / (1 + (f/fc)^12) and the power of the
    noise G^2. The first value of lags [s] zero is one.

    Parameters
    ----------
    lags : (n,) between two samples [s]
    cut_off : fc [Hz]
    dt : time between the samples that were filtered [s]; None if they were very dense
    """
    frequency, gain_squared = power_kept(cut_off, dt)
    found = np.zeros(np.shape(lags))
    near = np.abs(lags) * cut_off < _REMEMBERED
    waves = np.cos(2.0 * np.pi * np.multiply.outer(lags[near], frequency))
    found[near] = trapezoid(waves * gain_squared, axis=-1) / trapezoid(gain_squared)
    return found


class Whitening:
    """Makes samples of a signal independent, with deviation one.

    Parameters
    ----------
    lags : (n,) times of equidistant samples since the first one [s]
    deviation : standard deviation of each sample
    cut_off, dt : as for ``correlation``
    """

    def __init__(
        self, lags: np.ndarray, deviation: float, cut_off: float, dt: float | None
    ) -> None:
        covariance = linalg.toeplitz(correlation(lags, cut_off, dt))
        self._factor = deviation * np.linalg.cholesky(covariance)

    def of(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, m), divided by the square root of their covariance."""
        return np.asarray(linalg.solve_triangular(self._factor, values, lower=True))
