"""Posterior of parameters from prior and data, and whether residuals fit a model.

All is linear, with normal distributions. Parameters are counted in standard deviations of their
priors, data in those of their noise. With the Jacobian J of data by parameters the posterior
covariance is (1 + J^T J)^-1. A direction of parameters is an eigenvector of J^T J, its information
the eigenvalue: data say as much of it as the prior where that is 1.

**Residuals.** Before the measurement the data are normal about the prior's prediction with the
covariance S = 1 + J J^T: noise, and what priors leave open. If model, noise and priors are right,
innovations, the differences of each sample from its prediction by all samples before it, are
independent with deviation one. Their sum of squares is the least value of the sum that was
minimised, distributed as chi-square with as many degrees of freedom as there are samples; no
parameter is taken off, as priors count as data do. Their autocorrelations are of order 1/sqrt(n),
judged together by the statistic of Ljung and Box.

Source: A. Tarantola, *Inverse Problem Theory* (2005), sections 3.2 and 7.1; C. D. Rodgers, *Inverse
Methods for Atmospheric Sounding* (2000), section 2.4, for degrees of freedom for signal;
T. Kailath, *IEEE Trans. Automatic Control* 13 (1968) 646, innovations; G. M. Ljung,
G. E. P. Box, *Biometrika* 65 (1978) 297; G. J. Bierman, *Factorization Methods for Discrete
Sequential Estimation* (1977), section II.7, for Potter's update.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats


@dataclass(frozen=True)
class Posterior:
    """Uncertainty of m parameters after a measurement.

    Attributes
    ----------
    covariance : (m, m), in standard deviations of the priors
    information : (m,) of each direction, the largest first
    directions : (m, m), a column each
    """

    covariance: np.ndarray
    information: np.ndarray
    directions: np.ndarray

    @property
    def widths(self) -> np.ndarray:
        """Standard deviations (m,), in those of the priors."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the parameters (m, m)."""
        return self.covariance / np.outer(self.widths, self.widths)

    @property
    def n_found(self) -> float:
        """Number of parameters that the data determine: degrees of freedom for signal."""
        return float((self.information / (1.0 + self.information)).sum())

    @property
    def n_known(self) -> int:
        """Number of directions of which data say more than the prior."""
        return int((self.information > 1.0).sum())

    @property
    def condition(self) -> float:
        """Condition of J: root of the largest information over the least; infinite if data do not
        depend on a direction."""
        least = self.information[-1]
        return float(np.sqrt(self.information[0] / least)) if least > 0.0 else float("inf")


def posterior_of(jacobian: np.ndarray) -> Posterior:
    """The posterior from the Jacobian (n, m) of data by parameters, both in their deviations."""
    _, singular, turned = np.linalg.svd(jacobian, full_matrices=True)
    information = np.zeros(jacobian.shape[1])
    information[: singular.size] = singular**2
    covariance = (turned.T / (1.0 + information)) @ turned
    return Posterior(covariance, information, turned.T)


# Less probable residuals are called wrong.
RARE = 1e-3
# Less probable ones are worth another search.
_DOUBTFUL = 0.05
_MOST_LAGS, _SAMPLES_A_LAG = 12, 5


@dataclass(frozen=True)
class Judged:
    """Residuals of a signal, or of all together.

    Attributes
    ----------
    n : number of samples
    chi_square : sum of squares of the innovations
    probability : that a right model has one as large or larger
    autocorrelation : of the innovations at lags from 1 on; empty for all signals together
    whiteness_probability : that a right model has Ljung and Box's Q as large or larger; 1 for all
        together
    """

    n: int
    chi_square: float
    probability: float
    autocorrelation: np.ndarray
    whiteness_probability: float

    @property
    def reduced(self) -> float:
        """Chi-square per degree of freedom."""
        return self.chi_square / self.n

    @property
    def is_too_large(self) -> bool:
        """Whether the residual is larger than noise and priors let it be."""
        return self.probability < RARE

    @property
    def is_too_small(self) -> bool:
        """Whether the residual is smaller than the noise that was stated."""
        return self.probability > 1.0 - RARE

    @property
    def is_coloured(self) -> bool:
        """Whether the residual is not white."""
        return self.whiteness_probability < RARE


def innovations_of(residual: np.ndarray, jacobian: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Innovations (n,), of a linear model, from what is left at the best parameters.

    Parameters
    ----------
    residual : (n,) measured less modelled data at these, in deviations of the noise
    jacobian : (n, m) of the modelled data by parameters in deviations of their priors
    moved : (m,) the parameters, from the means of their priors, in deviations of these
    """
    before, found = residual + jacobian @ moved, np.empty(residual.size)
    # One sample after the other updates the parameters and a root of their covariance (Potter):
    # without the covariance of all samples, which round-off makes singular if noise is tiny.
    root, mean = np.eye(moved.size), np.zeros(moved.size)
    for i, (value, by) in enumerate(zip(before, jacobian, strict=True)):
        turned = root.T @ by
        size = np.sqrt(1.0 + turned @ turned)
        found[i] = (value - by @ mean) / size
        gain = root @ turned
        mean += gain * (found[i] / size)
        root -= np.outer(gain, turned / (size * (size + 1.0)))
    return found


def judge(innovations: np.ndarray, signals: Mapping[str, slice]) -> dict[str, Judged]:
    """Each signal and, under "all", all of them.

    Parameters
    ----------
    innovations : (n,) of all signals, in the order of time within each
    signals : which samples are those of a signal
    """
    found = {name: _judged(innovations[own], True) for name, own in signals.items()}
    return found | {"all": _judged(innovations, False)}


def is_doubtful(judged: Mapping[str, Judged]) -> bool:
    """Whether residuals, of all together by size and of each signal by colour, are ones that a
    right model leaves in one passage of ten at most: the search may have come to another minimum
    than the least."""
    colours = [one.whiteness_probability for name, one in judged.items() if name != "all"]
    return judged["all"].probability < _DOUBTFUL or min(colours) < _DOUBTFUL / len(colours)


def _judged(own: np.ndarray, is_series: bool) -> Judged:
    n, chi_square = own.size, float(own @ own)
    lags = np.arange(1, min(_MOST_LAGS, n // _SAMPLES_A_LAG) + 1) if is_series else np.arange(0)
    correlation = np.array([own[lag:] @ own[:-lag] for lag in lags]) / chi_square
    whiteness = n * (n + 2) * (correlation**2 / (n - lags)).sum()
    return Judged(
        n,
        chi_square,
        float(stats.chi2.sf(chi_square, n)),
        correlation,
        float(stats.chi2.sf(whiteness, lags.size)) if lags.size else 1.0,
    )
