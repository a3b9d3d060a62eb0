"""Statistics of signals whose statistics are known in closed form."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.observations import ObservedRun
from catenary.postproc.read.results import Results

DT, SPEED = 1e-3, 100.0
TIME = DT * np.arange(12001)
POSITION = SPEED * TIME
# Open at its end, so that 400 to 800 m is exactly 4000 steps: whole periods of whole frequencies.
EVALUATION = (400.0, 799.95)
WITHIN = (POSITION >= EVALUATION[0]) & (POSITION <= EVALUATION[1])


def of_force(force: np.ndarray) -> stats.PantographStatistics:
    height = 5.0 + 0.02 * np.sin(2 * np.pi * 1.5 * TIME) + 0.3 * np.sin(2 * np.pi * 100.0 * TIME)
    return stats.contact_statistics("pantograph", POSITION, force, height, DT, EVALUATION)


def sine(amplitude: float, frequency: float) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * frequency * TIME)


def test_deviations_of_the_bands_of_a_sum_of_sines() -> None:
    found = of_force(150.0 + sine(30.0, 2.0) + sine(12.0, 10.0) + sine(40.0, 60.0))
    # Each sine has the deviation amplitude / sqrt(2); at 10 Hz, an octave from either edge, the
    # filters are off by 2^-12, at 60 Hz the low-pass leaves 3^-12 = 2e-6.
    assert found.mean == pytest.approx(150.0, abs=1e-6)
    assert found.std_0_5 == pytest.approx(30.0 / np.sqrt(2), rel=5e-4)
    assert found.std_5_20 == pytest.approx(12.0 / np.sqrt(2), rel=5e-4)
    assert found.std == pytest.approx(np.hypot(30.0, 12.0) / np.sqrt(2), rel=5e-4)
    assert found.stat_max == pytest.approx(found.mean + 3 * found.std)
    assert found.stat_min == pytest.approx(found.mean - 3 * found.std)


def test_extremes_are_those_of_the_filtered_force() -> None:
    found = of_force(150.0 + sine(30.0, 2.0) + sine(40.0, 60.0))
    assert found.maximum == pytest.approx(180.0, abs=0.01)
    assert found.minimum == pytest.approx(120.0, abs=0.01)


def test_contact_height_range_is_twice_the_slow_amplitude() -> None:
    assert of_force(np.full(TIME.size, 150.0)).contact_height_range == pytest.approx(0.04, rel=1e-3)


def test_force_outside_the_stretch_counts_nothing() -> None:
    force = np.where(POSITION < 300.0, 900.0, 150.0)
    force = np.where(POSITION > 900.0, -5.0, force)
    found = of_force(force)
    # One second from the step the 5 Hz filter has decayed by exp(-8), the 20 Hz one by exp(-32).
    assert (found.maximum, found.minimum) == pytest.approx((150.0, 150.0), abs=1e-6)
    assert found.std_0_5 < 0.5
    assert found.loss_percent == 0.0


def test_loss_counts_all_intervals_and_arcing_only_those_of_5_ms() -> None:
    force = np.full(TIME.size, 150.0)
    force[5000:5004] = 0.0  # 4 ms
    force[6000:6005] = 0.0  # 5 ms
    force[7000:7011] = -1e-9  # 11 ms
    force[100:400] = 0.0  # before the stretch
    found = of_force(force)
    assert WITHIN.sum() == 4000
    assert found.loss_percent == pytest.approx(100 * 20 / 4000)
    assert found.arcing_percent == pytest.approx(100 * 16 / 4000)


def test_a_loss_across_an_end_of_the_stretch_counts_by_its_whole_length() -> None:
    force = np.full(TIME.size, 150.0)
    first = int(np.flatnonzero(WITHIN)[0])
    force[first - 4 : first + 2] = 0.0  # 6 ms, of which 2 ms are in the stretch
    found = of_force(force)
    assert found.loss_percent == found.arcing_percent == pytest.approx(100 * 2 / 4000)
    force[first - 4] = force[first - 3] = 150.0  # 4 ms
    found = of_force(force)
    assert (found.loss_percent, found.arcing_percent) == pytest.approx((100 * 2 / 4000, 0.0))


def test_losses_at_both_ends_of_a_record_are_intervals_too() -> None:
    lost = np.zeros(50, dtype=bool)
    lost[:6] = lost[-2:] = True
    kept = stats.without_short_losses(lost, DT)
    assert kept[:6].all() and not kept[6:].any()


def test_histogram_adds_up_and_sorts_values_into_bins() -> None:
    edges, percent = stats.histogram(np.array([100.0, 109.9, 110.0, 125.0]))
    np.testing.assert_allclose(edges, [100.0, 110.0, 120.0, 130.0])
    np.testing.assert_allclose(percent, [50.0, 25.0, 25.0])


def test_histogram_of_forces_beyond_all_bounds_has_wider_bins() -> None:
    edges, percent = stats.histogram(np.array([0.0, 5.0, -3e13, 2e13]))
    np.testing.assert_allclose(np.diff(edges), 1e11)
    assert percent.size <= stats.MOST_BINS + 1
    assert percent.sum() == 100.0 and percent[300] == 50.0


@pytest.mark.parametrize("position", [POSITION[:7000], POSITION[5000:], POSITION[:1], POSITION[:0]])
def test_a_record_that_misses_part_of_the_stretch_does_not_cover_it(position: np.ndarray) -> None:
    assert not stats.covers(position, EVALUATION)
    assert stats.covers(POSITION, EVALUATION)


def test_each_pantograph_is_evaluated_at_its_own_position(run_folder: Path, march: Any) -> None:
    with Results(run_folder) as results:
        found = stats.evaluate(results)
        force = results.channel("contact_force")
        position = results.channel("contact_position")
        low, high = results.evaluation
    for p, statistics in enumerate(found.pantographs):
        within = (position[:, p] >= low) & (position[:, p] <= high)
        slow = np.hypot(30.0 + 6.0 * p, 15.0 + 5.0 * p) / np.sqrt(2)
        # The stretch holds no whole number of periods: 1 part in 6 periods of the slowest.
        assert statistics.std == pytest.approx(slow, rel=0.1)
        assert statistics.mean == pytest.approx(force[within, p].mean(), abs=0.1)
    assert found.pantographs[0].mean != found.pantographs[1].mean
    assert [p.name for p in found.pantographs] == ["leading", "trailing"]


def test_arms_and_droppers_are_those_of_the_stretch(run_folder: Path, march: Any) -> None:
    with Results(run_folder) as results:
        found = stats.evaluate(results)
        uplift, force = results.channel("arm_uplift"), results.channel("dropper_force")
    arms = (march.arm_x >= 250.0) & (march.arm_x <= 550.0)
    droppers = (march.dropper_x >= 250.0) & (march.dropper_x <= 550.0)
    assert found.supports.evaluated.sum() == 7 and droppers.sum() == 54
    assert found.supports.maximum == uplift[:, arms].max()
    np.testing.assert_array_equal(found.supports.uplift, uplift.max(axis=0))
    assert found.droppers.n_slackened == (force[:, droppers] <= 0).any(axis=0).sum() == 54
    assert found.droppers.minimum == -0.5
    assert found.droppers.maximum == force[:, droppers].max()


def test_places_at_the_ends_of_the_stretch_count_though_sums_of_spans_round(
    run_folder: Path, tmp_path: Path
) -> None:
    """The uplift at such an arm is often the largest."""
    path = shutil.copy(run_folder / "run.h5", tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        file["line/evaluation_range"][...] = np.nextafter(250.0, 999.0), np.nextafter(550.0, 0.0)
    with Results(run_folder) as exact, Results(path) as rounded:
        first, second = stats.evaluate(exact), stats.evaluate(rounded)
        assert ObservedRun(exact, first).masts.tolist() == np.arange(250.0, 551.0, 50.0).tolist()
        assert ObservedRun(rounded, second).masts.size == 7
    np.testing.assert_array_equal(first.supports.evaluated, second.supports.evaluated)
    np.testing.assert_array_equal(first.droppers.evaluated, second.droppers.evaluated)


def test_an_unfinished_run_gives_a_sentence_instead_of_figures(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    # After 4 s the leading pantograph is at 393 m, within the stretch of 250 to 550 m.
    path = record_run(tmp_path / "run.h5", make_march(n_steps=4000))
    with Results(path) as results:
        found = stats.evaluate(results)
    assert all(np.isnan(p.mean) and np.isnan(p.loss_percent) for p in found.pantographs)
    assert found.complaints[0] == (
        "No statistics of the leading pantograph: its record covers 60 to 393 m, "
        "the evaluation stretch is 250 to 550 m."
    )
    assert found.supports.maximum > 0.05


def test_too_long_a_step_gives_a_sentence_instead_of_figures(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    path = record_run(tmp_path / "run.h5", make_march(n_steps=240, dt=0.03))
    with Results(path) as results:
        found = stats.evaluate(results)
    assert "must be below 0.025 s" in found.complaints[0]


@pytest.mark.parametrize("length", [0.01, 1.0, 4.1])
def test_a_stretch_of_a_few_samples_gives_a_sentence_instead_of_figures(
    length: float, run_folder: Path
) -> None:
    """At 83.3 m/s a period of 20 Hz is 4.17 m; a sample alone has no deviation."""
    with Results(run_folder) as results:
        results.evaluation = (300.0, 300.0 + length)
        found = stats.evaluate(results)
        errors = indicate(results)
        results.evaluation = (300.0, 304.3)
        longer = stats.evaluate(results)
    assert all(np.isnan(p.std) for p in found.pantographs)
    # Nor has what remains of the force an error that would ask for another step.
    assert np.isnan(errors.force_error).all() and "step" not in " ".join(errors.warnings)
    assert len(found.complaints) == 2
    assert "less than a period of the 20 Hz filter (50 ms)" in found.complaints[0]
    # There are figures, by which nothing is judged.
    assert not any(np.isnan(p.std) for p in longer.pantographs)
    assert all("shorter than a span" in sentence for sentence in longer.complaints)
