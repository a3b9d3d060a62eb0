"""Derivatives of statistics beside differences of the statistics themselves."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check

from catenary.postproc.evaluate import statistics
from catenary.postproc.evaluate.statistics import contact_statistics

DT, N = 2e-3, 4000
NAMES = {"mean": "mean", "std": "std", "maximum": "maximum", "minimum": "minimum",
         "stat_max": "stat_max", "stat_min": "stat_min"}  # fmt: skip


def records(seed: int) -> np.ndarray:
    """Noise with some slow waves, (N,)."""
    random = np.random.default_rng(seed)
    time = DT * np.arange(N)
    waves = sum(np.sin(2 * np.pi * f * time + random.uniform(0, 6)) for f in (0.7, 1.3, 6.0))
    return np.asarray(20.0 * waves + 5.0 * random.standard_normal(N))


@pytest.mark.parametrize("name", NAMES)
def test_statistics_change_as_differences_of_them(name: str) -> None:
    position, evaluation = 70.0 * DT * np.arange(N), (100.0, 400.0)
    within = (position >= evaluation[0]) & (position <= evaluation[1])
    force, by_force = 120.0 + records(1), records(2)
    found = statistics.force_derivatives(force, by_force[:, None], within, DT)
    step = 1e-6
    both = [
        getattr(contact_statistics("", position, own, own, DT, evaluation), NAMES[name])
        for own in (force + step * by_force, force - step * by_force)
    ]
    # Round-off of some 100 N over twice the step.
    expected = (both[0] - both[1]) / (2.0 * step)
    check(name, getattr(found, name), expected, within=1e-6)


def test_records_are_compared_at_equal_places() -> None:
    """A force that depends on the place alone keeps its statistics at any speed."""
    speed, place = 70.0, 70.0 * DT * np.arange(N)
    number = 2 * np.pi / 50.0
    force = 120.0 + 30.0 * np.sin(number * place)
    by_force = (30.0 * number * np.cos(number * place) * place / speed)[:, None]
    within = (place >= 100.0) & (place <= 400.0)
    by_place = (place / speed / speed)[:, None]  # per m/s, over the speed
    found = statistics.force_derivatives(force, by_force, within, DT, by_place)
    moved = statistics.force_derivatives(force, by_force, within, DT)
    # Differences of the fourth order of a wave of 714 records: (2 pi / 357)^4 / 30 of its slope.
    check("std", found.std, 0.0, within=1e-6)
    check("mean", found.mean, 0.0, within=1e-6)
    assert abs(moved.std[0]) > 1e-3 or abs(moved.mean[0]) > 1e-3


def test_the_largest_of_several_columns_changes_as_its_record() -> None:
    values = np.array([[1.0, 2.0], [5.0, 3.0], [4.0, 4.5]])
    by_values = np.arange(12.0).reshape(3, 2, 2)
    assert statistics.largest_derivatives(values, by_values).tolist() == by_values[1, :, 0].tolist()
    assert np.isnan(statistics.largest_derivatives(values[:, :0], by_values[..., :0])).all()


def test_a_force_that_never_changes_has_no_sigma_that_does() -> None:
    flat = np.full(N, 100.0)
    found = statistics.force_derivatives(flat, records(3)[:, None], np.ones(N, dtype=bool), DT)
    assert np.isfinite(found.std).all()
