"""Which of very many ranges a picture draws."""

from __future__ import annotations

import numpy as np

from catenary.postproc.report.pictures.figures import MOST_POINTS, thinned_ranges


def test_few_ranges_are_drawn_as_they_are() -> None:
    assert thinned_ranges(np.zeros(MOST_POINTS), np.ones(MOST_POINTS)) == slice(None)


def test_of_many_the_peaks_of_both_ends_are_drawn() -> None:
    random = np.random.default_rng(3)
    low = random.normal(size=4 * MOST_POINTS)
    high = low + random.exponential(size=low.size)
    drawn = thinned_ranges(low, high)
    assert isinstance(drawn, np.ndarray) and drawn.size <= MOST_POINTS + 4
    assert low[drawn].min() == low.min() and high[drawn].max() == high.max()
    # Each hundredth of the line has its own peaks still.
    for part in np.array_split(np.arange(low.size), 100):
        inside = drawn[(drawn >= part[0]) & (drawn <= part[-1])]
        assert low[inside].min() == low[part].min() and high[inside].max() == high[part].max()
