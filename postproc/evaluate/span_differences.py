"""Whether statistics of two runs differ by more than chance: differences span by span.

The force of a span is taken for a sample of what the line may show. The statistic without each
span in turn, the jackknife, tells how far it depends on which spans there are (B. Efron, The
jackknife, the bootstrap and other resampling plans, 1982, chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

# With fewer spans nothing is said.
_LEAST_SPANS = 4
STATISTICS = ("mean", "standard deviation")


class SpanSums(NamedTuple):
    """Number of samples of each span (n,), their sum and the sum of their squares."""

    samples: np.ndarray
    total: np.ndarray
    square: np.ndarray


class Difference(NamedTuple):
    """A difference of two runs with the interval that holds it with a confidence of 95 %."""

    value: float
    low: float
    high: float

    @property
    def is_certain(self) -> bool:
        """Whether the interval excludes zero; not of runs that are alike."""
        return not self.low <= 0.0 <= self.high


def span_sums(position: np.ndarray, force: np.ndarray, edges: np.ndarray) -> SpanSums:
    """Sums of a force (n,) at positions (n,) [m] between edges (m + 1,) of spans [m].

    Spans without a sample are left out. A sample at the last edge belongs to the last span, as it
    does to the evaluated stretch: means of all spans are those of the stretch.
    """
    n_spans = max(edges.size - 1, 0)
    which = np.searchsorted(edges, position, side="right") - 1
    if n_spans:
        which[position == edges[-1]] -= 1
    inside = (which >= 0) & (which < n_spans)
    which, force = which[inside], force[inside]
    sums = [np.bincount(which, weights, n_spans) for weights in (None, force, np.square(force))]
    there = sums[0] > 0
    return SpanSums(*(one[there].astype(float) for one in sums))


def differences(first: SpanSums, second: SpanSums, paired: bool) -> Sequence[Difference] | None:
    """Differences, second less first, of ``STATISTICS``; None with too few spans.

    Parameters
    ----------
    first, second : SpanSums
        Sums over the spans of each run.
    paired : bool
        Whether both are of the same spans of a line, whose common part then drops out.
    """
    n, m = first.samples.size, second.samples.size
    if min(n, m) < _LEAST_SPANS or (paired and n != m):
        return None
    values = _statistics(second, whole=True) - _statistics(first, whole=True)
    without = _statistics(first), _statistics(second)
    if paired:
        square, freedom = _jackknifed(without[1] - without[0]), np.full(len(STATISTICS), n - 1.0)
    else:
        own, other = _jackknifed(without[0]), _jackknifed(without[1])
        square = own + other
        with np.errstate(invalid="ignore"):  # Welch and Satterthwaite
            freedom = square**2 / (own**2 / (n - 1) + other**2 / (m - 1))
        freedom = np.nan_to_num(freedom, nan=float(min(n, m) - 1))
    width = stats.t.ppf(0.975, freedom) * np.sqrt(square)
    return [
        Difference(*map(float, row))
        for row in zip(values[:, 0], *_ends(values, width), strict=True)
    ]


def _ends(values: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values[:, 0] - width, values[:, 0] + width


def _statistics(sums: SpanSums, whole: bool = False) -> np.ndarray:
    """Statistics (2, n) without each span in turn, (2, 1) of all spans."""
    left = [one.sum() - (0.0 if whole else one) for one in sums]
    count, total, square = (np.atleast_1d(one) for one in left)
    mean = total / count
    return np.stack([mean, np.sqrt(np.maximum(square / count - mean**2, 0.0))])


def _jackknifed(without: np.ndarray) -> np.ndarray:
    """Variance (2,) of statistics of which (2, n) are known without each span."""
    n = without.shape[1]
    return np.asarray((n - 1.0) * without.var(axis=1))
