"""Estimates from samples with confidence bounds: mean, deviation, quantiles, probabilities.

Samples are independent values, shape (n,); a mean and a deviation take two of them.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np

CONFIDENCE = 0.95
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_RESAMPLES = 2000
# Of fewer values there are too few different resamples, and no kurtosis; of more resamples need n^2
# numbers.
_FEWEST, _MOST_RESAMPLED = 10, 1000


class Bounded(NamedTuple):
    """An estimate and the bounds of its confidence interval, NaN where there is none."""

    value: float
    low: float
    high: float


def student(x: np.ndarray) -> Bounded:
    """Mean with the bounds of Student's distribution."""
    from scipy import stats

    n, value = len(x), float(np.mean(x))
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)) * float(np.std(x, ddof=1)) / np.sqrt(n)
    return Bounded(value, value - half, value + half)


def mean(x: np.ndarray) -> Bounded:
    """Mean with bounds by the bootstrap (BCa, Efron 1987), which stay where values can be.

    Of fewer than ``_FEWEST`` values, or more than ``_MOST_RESAMPLED``, by Student's
    distribution.
    """
    if np.ptp(x) == 0.0 or not _FEWEST <= len(x) <= _MOST_RESAMPLED:
        return student(x)
    return _bootstrap(x)


def deviation(x: np.ndarray) -> Bounded:
    """Standard deviation s with n - 1 degrees of freedom, and its bounds.

    ln(c s^2) is taken as normal, with c = n/(n - z) and the variance
    c^2 (kurtosis - (n - 3)/n)/(n - 1); the kurtosis is that about a trimmed mean (D. Bonett,
    Comput. Stat. Data Anal. 50, 2006, 775). Fewer than ``_FEWEST`` values have no bounds.
    """
    from scipy import stats

    n, value = len(x), float(np.std(x, ddof=1))
    if np.ptp(x) == 0.0:
        return Bounded(0.0, 0.0, 0.0)
    if n < _FEWEST:
        return Bounded(value, np.nan, np.nan)
    z = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE))
    factor = n / (n - z)
    middle = stats.trim_mean(x, 0.5 / np.sqrt(n - 4.0))
    # Over s, so that the fourth power of small values does not underflow.
    kurtosis = n * np.sum(((x - middle) / value) ** 4) / (n - 1.0) ** 2
    half = z * factor * np.sqrt((kurtosis - (n - 3.0) / n) / (n - 1.0))
    low, high = value * np.sqrt(factor) * np.exp(0.5 * half * np.array([-1.0, 1.0]))
    return Bounded(value, float(low), float(high))


def _bootstrap(x: np.ndarray) -> Bounded:
    """Mean with BCa bounds; NaN where values are so alike that resamples show none.

    Resamples of n values scatter by sqrt((n - 1)/n) too little and are normal where Student's
    distribution is wider, so that intervals of 95 % would hold the truth in 87 % of ten normal
    values. They are taken at the greater level that mends both (T. Hesterberg, Am. Stat. 69, 2015,
    371, the expanded interval).
    """
    from scipy import stats

    n = len(x)
    wider = np.sqrt(n / (n - 1.0)) * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)
    level = float(2.0 * stats.norm.cdf(wider) - 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        found = stats.bootstrap(
            (x,),
            np.mean,
            n_resamples=_RESAMPLES,
            confidence_level=level,
            method="BCa",
            random_state=np.random.default_rng(1),
        ).confidence_interval
    return Bounded(float(np.mean(x)), float(found.low), float(found.high))


def quantile(x: np.ndarray, probability: float) -> Bounded:
    """A quantile with bounds by order statistics, whatever the distribution.

    The number of values below the quantile is binomial, so that between the values of ranks l and
    u lies the quantile with at least the wanted confidence (David and Nagaraja 2003, sec. 7.1). A
    bound is NaN if there are too few values for it. The ``probability`` of the quantile is in
    (0, 1).
    """
    from scipy import stats

    ordered, n = np.sort(x), len(x)
    rest = 0.5 * (1.0 - CONFIDENCE)
    lower = int(stats.binom.ppf(rest, n, probability))
    upper = int(stats.binom.ppf(1.0 - rest, n, probability)) + 1
    return Bounded(
        float(np.quantile(ordered, probability)),
        float(ordered[lower - 1]) if lower >= 1 else np.nan,
        float(ordered[upper - 1]) if upper <= n else np.nan,
    )


def share(hits: int, n: int) -> Bounded:
    """A probability from a number of hits among n, with bounds of Clopper and Pearson (1934)."""
    from scipy import stats

    # The probability of the test, which is not asked for, underflows with thousands of runs.
    with np.errstate(all="ignore"):
        interval = stats.binomtest(hits, n).proportion_ci(CONFIDENCE, method="exact")
    return Bounded(hits / n, float(interval.low), float(interval.high))


def named(name: str, one: Bounded) -> dict[str, Any]:
    """An estimate as three cells of a row."""
    return {name: one.value, f"{name}_low": one.low, f"{name}_high": one.high}
