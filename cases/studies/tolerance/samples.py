"""Margins of the samples of an error at all levels that were run, and how many keep a criterion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np


class Bound(NamedTuple):
    """Bound of a criterion.

    Attributes
    ----------
    limit : in the criterion's unit
    is_least : whether values must be at least that, not at most
    meaning : of the values, with their unit, for axes of pictures
    """

    limit: float
    is_least: bool
    meaning: str

    def values(self, margins: np.ndarray) -> np.ndarray:
        """Values with these margins to the limit."""
        return self.limit + (margins if self.is_least else -margins)


@dataclass(frozen=True)
class Samples:
    """Samples of an error under a criterion, the same random numbers at each level.

    A level at which too many fail is left early, those first that failed at another one. The share
    of the lines run there says nothing; but a line that is not run at a level has kept the
    criterion at a greater one, or lost it at a smaller one, or is not known there. Bisection takes
    the same for granted.

    Attributes
    ----------
    levels : (m,) ascending, from 0, in the error's unit
    margins : (m, n) of n samples, the least of all runs of a line: negative where it loses the
        criterion, minus infinity if a run broke, NaN where it was not run; of several criteria the
        sign alone counts
    """

    levels: np.ndarray
    margins: np.ndarray

    @property
    def n_run(self) -> np.ndarray:
        """Number of samples run at each level, shape (m,)."""
        return np.count_nonzero(~np.isnan(self.margins), axis=1)

    @property
    def n_kept(self) -> tuple[np.ndarray, np.ndarray]:
        """Fewest and most samples that keep the criterion at each level, both of shape (m,)."""
        unknown = np.isnan(self.margins)
        kept, lost = self.margins >= 0.0, self.margins < 0.0
        above = np.logical_or.accumulate(kept[::-1])[::-1]
        below = np.logical_or.accumulate(lost)
        kept |= unknown & above & ~below
        lost |= unknown & below & ~above
        return kept.sum(axis=1), self.margins.shape[1] - lost.sum(axis=1)

    def records(self) -> list[dict[str, Any]]:
        """A row for each level: samples run, and those that keep the criterion."""
        columns = zip(self.levels, self.n_run, *self.n_kept, strict=True)
        return [
            {"level": float(a), "n_run": int(b), "kept_at_least": int(c), "kept_at_most": int(d)}
            for a, b, c, d in columns
        ]


def least_share(kept: int, n: int, confidence: float) -> float:
    """Lower bound of the share of all lines that keep a criterion which ``kept`` of n samples keep
    (C. Clopper, E. Pearson, Biometrika 26, 1934)."""
    from scipy.stats import binomtest

    found = binomtest(kept, n, alternative="greater")
    return float(found.proportion_ci(confidence, method="exact").low)


def samples_of(levels: Sequence[float], margins: Sequence[Sequence[float]]) -> Samples:
    """Samples of levels in any order, with the margins of each."""
    order = np.argsort(levels)
    return Samples(np.array(levels)[order], np.array(margins)[order])
