"""Estimates from samples with confidence bounds: mean, deviation, quantiles, probabilities."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

CONFIDENCE = 0.95
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_RESAMPLES = 2000
# Up to so many samples bounds are corrected for bias and skewness, which needs n^2 numbers.
_MOST_CORRECTED = 1000
_BATCH_NUMBERS = 5_000_000


class Bounded(NamedTuple):
    """An estimate and the bounds of its confidence interval, NaN where there is none."""

    value: float
    low: float
    high: float


def moments(x: np.ndarray) -> tuple[Bounded, Bounded]:
    """Mean and standard deviation (n - 1) with bootstrap bounds (Efron and Tibshirani 1993).

    Parameters
    ----------
    x : independent values, shape (n,), n >= 2
    """
    from scipy import stats

    values = float(np.mean(x)), float(np.std(x, ddof=1))
    if np.ptp(x) == 0.0:
        return Bounded(values[0], *[values[0]] * 2), Bounded(0.0, 0.0, 0.0)
    mean_bounds = stats.t.interval(CONFIDENCE, len(x) - 1, values[0], values[1] / np.sqrt(len(x)))
    if len(x) < 10:  # resamples of so few are too few different ones
        return Bounded(values[0], *map(float, mean_bounds)), Bounded(values[1], np.nan, np.nan)
    found = stats.bootstrap(
        (x,),
        lambda sample, axis: np.std(sample, ddof=1, axis=axis),
        n_resamples=_RESAMPLES,
        batch=max(1, _BATCH_NUMBERS // len(x)),
        confidence_level=CONFIDENCE,
        method="BCa" if len(x) <= _MOST_CORRECTED else "percentile",
        random_state=np.random.default_rng(1),
    ).confidence_interval
    mean = Bounded(values[0], *map(float, mean_bounds))
    return mean, Bounded(values[1], float(found.low), float(found.high))


def quantile(x: np.ndarray, probability: float) -> Bounded:
    """A quantile with bounds by order statistics, whatever the distribution.

    The number of values below the quantile is binomial, so that between the values of ranks l and
    u lies the quantile with at least the wanted confidence (David and Nagaraja 2003, sec. 7.1). A
    bound is NaN if there are too few values for it.

    Parameters
    ----------
    x : independent values, shape (n,)
    probability : of the quantile, in (0, 1)
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

    interval = stats.binomtest(hits, n).proportion_ci(CONFIDENCE, method="exact")
    return Bounded(hits / n, float(interval.low), float(interval.high))


def named(name: str, one: Bounded) -> dict[str, Any]:
    """An estimate as three cells of a row."""
    return {name: one.value, f"{name}_low": one.low, f"{name}_high": one.high}
