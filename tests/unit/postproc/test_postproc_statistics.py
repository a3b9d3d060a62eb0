"""Statistics and filters of signals that are known in closed form, and derivatives."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from measuring import check
from scipy import signal

from catenary import InputError
from catenary.postproc.evaluate import filters, statistics
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.observations import ObservedRun
from catenary.postproc.evaluate.statistics import contact_statistics, evaluate
from catenary.postproc.files.committed_rows import FILTERED_FORCE, ForceFilter
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.results import Run

# --- statistics of signals whose statistics are known in closed form ------------------------------


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
    for p, own in enumerate(found.pantographs):
        within = (position[:, p] >= low) & (position[:, p] <= high)
        slow = np.hypot(30.0 + 6.0 * p, 15.0 + 5.0 * p) / np.sqrt(2)
        # The stretch holds no whole number of periods: 1 part in 6 periods of the slowest.
        assert own.std == pytest.approx(slow, rel=0.1)
        assert own.mean == pytest.approx(force[within, p].mean(), abs=0.1)
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


# --- filters --------------------------------------------------------------------------------------


MIDDLE = slice(4000, 8000)  # whole periods of every whole frequency, four seconds from the ends


def in_phase_and_out(signal: np.ndarray, frequency: float) -> tuple[float, float]:
    """Components of a record along sin and cos of a frequency."""
    t = TIME[MIDDLE]
    s, c = np.sin(2 * np.pi * frequency * t), np.cos(2 * np.pi * frequency * t)
    return 2 * float(np.mean(signal[MIDDLE] * s)), 2 * float(np.mean(signal[MIDDLE] * c))


def theory(frequency: float, cut_off: float) -> float:
    """Squared gain of a digital 6th-order Butterworth low-pass (bilinear transform, prewarped)."""
    ratio = np.tan(np.pi * frequency * DT) / np.tan(np.pi * cut_off * DT)
    return 1.0 / (1.0 + ratio**12)


@pytest.mark.parametrize(("frequency", "expected"), [(5.0, 1.0), (20.0, 0.5), (40.0, 2.4e-4)])
def test_the_low_pass_has_butterworths_gain_and_no_phase(frequency: float, expected: float) -> None:
    passed = filters.low_pass(np.sin(2 * np.pi * frequency * TIME), DT)
    gain, out_of_phase = in_phase_and_out(passed, frequency)
    # The design is exact; what remains are the ends of the record, decayed by exp(-32 * 4).
    assert gain == pytest.approx(theory(frequency, 20.0), rel=1e-6, abs=1e-9)
    assert abs(out_of_phase) < 1e-9
    # The round numbers of the continuous filter hold to the warping at 40 Hz, 6 (pi f dt)^2.
    assert gain == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize(
    ("frequency", "low", "high"), [(1.0, 1, 0), (5.0, 0.5, 0.5), (10.0, 0, 1), (20.0, 0, 0.5)]
)
def test_the_bands_share_the_spectrum(frequency: float, low: float, high: float) -> None:
    signal = np.sin(2 * np.pi * frequency * TIME)
    for band, expected in ((filters.band_0_5, low), (filters.band_5_20, high)):
        gain, out_of_phase = in_phase_and_out(band(signal, DT), frequency)
        # Leakage of one octave: 2^-12 = 2.4e-4.
        assert gain == pytest.approx(expected, abs=5e-4)
        assert abs(out_of_phase) < 1e-6


def test_mean_belongs_to_the_low_band_only() -> None:
    constant = np.full(TIME.size, 150.0)
    np.testing.assert_allclose(filters.low_pass(constant, DT), 150.0, rtol=1e-9)
    np.testing.assert_allclose(filters.band_0_5(constant, DT), 150.0, rtol=1e-9)
    np.testing.assert_allclose(filters.band_5_20(constant, DT), 0.0, atol=1e-6)


def test_ends_of_the_record_are_not_pulled_to_zero() -> None:
    # A slow trend must come out as it went in, up to the ends: the record is continued oddly.
    ramp = 100.0 + 20.0 * TIME
    np.testing.assert_allclose(filters.low_pass(ramp, DT), ramp, atol=1e-6)


def test_columns_are_filtered_one_by_one() -> None:
    signals = np.column_stack([np.sin(2 * np.pi * f * TIME) for f in (3.0, 15.0, 60.0)])
    together = filters.low_pass(signals, DT)
    for column in range(3):
        np.testing.assert_array_equal(together[:, column], filters.low_pass(signals[:, column], DT))


@pytest.mark.parametrize("n", [0, 1, 2, 10])
def test_short_records_pass_without_an_error(n: int) -> None:
    assert filters.low_pass(np.ones(n), DT) == pytest.approx(np.ones(n))


@pytest.mark.parametrize("dt", [0.025, 0.03])
def test_too_slow_sampling_is_refused_with_a_sentence(dt: float) -> None:
    with pytest.raises(InputError, match=rf"dt_s = {dt:g} s .* must be below 0.025 s"):
        filters.low_pass(np.ones(100), dt)


def test_sampling_just_fast_enough_is_accepted() -> None:
    filters.check_sampling(0.0249)


# --- the filtered contact force in a result file --------------------------------------------------


FILTER = ForceFilter(filters.ABOUT, filters.low_pass)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    """The folder of a run that is done."""
    folder: Path = tmp_path_factory.mktemp("filtered")
    record_run(folder / "run.h5", make_march(n_steps=2000), force_filter=lambda: FILTER)
    return folder


def test_the_file_holds_the_force_that_scipys_filter_gives(done: Path) -> None:
    with Results(done) as results:
        force, stored = results.channel("contact_force"), results.stored_filtered_force()
    assert stored is not None and stored[1]["cut_off_Hz"] == 20.0
    sos = signal.butter(6, 20.0, fs=1000.0, output="sos")
    expected = signal.sosfiltfilt(sos, force, axis=0, padlen=300)
    np.testing.assert_array_equal(stored[0], expected)
    with h5py.File(done / "run.h5", "r") as file:
        table = file[FILTERED_FORCE]
        assert [dim[0].name for dim in table.dims] == ["/time", "/pantograph"]
        assert table.fletcher32 and table.attrs["unit"] == b"N" and table.attrs["order"] == 6


def test_python_reads_it_and_makes_it_where_there_is_none(done: Path, run_folder: Path) -> None:
    with Run(Results(done)) as run:
        found = run.filtered_force
        assert found.dims == ("time", "pantograph") and found.attrs["filter"].startswith("low-pass")
        np.testing.assert_array_equal(found, filters.low_pass(run.force.values, 1e-3))
    with Run(Results(run_folder)) as run:  # a file as earlier versions wrote them
        assert run._results.stored_filtered_force() is None
        expected = filters.low_pass(run.force.values, 1e-3)
        np.testing.assert_array_equal(run.filtered_force, expected)
        assert run.filtered_force.attrs["cut_off_Hz"] == 20.0


def test_statistics_and_indicators_are_the_same_with_and_without_it(
    tmp_path: Path, make_march: Any, record_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    record_run(whole, make_march(), force_filter=lambda: FILTER)
    shutil.copyfile(whole, path)
    with h5py.File(path, "r+") as file:
        del file[FILTERED_FORCE]
    with Results(path) as without:
        expected = evaluate(without), indicate(without)
        force = filters.contact_force(without, 0)
    filtered, low_pass = [], filters.low_pass

    def counted(values: np.ndarray, dt: float, cut_off: float = filters.CUT_OFF) -> np.ndarray:
        filtered.append((cut_off, values))
        return low_pass(values, dt, cut_off)

    monkeypatch.setattr(filters, "low_pass", counted)
    with Results(whole) as results:
        found = evaluate(results), indicate(results)
        np.testing.assert_array_equal(filters.contact_force(results, 0), force)
        heights = [results.column("wire_height", p) for p in range(2)]
    # What the file has passes no filter: at 20 Hz heights of the contact point alone do.
    at_20_hz = [values for cut_off, values in filtered if cut_off == filters.CUT_OFF]
    np.testing.assert_array_equal(at_20_hz, heights)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_equal(asdict(one), asdict(other))


def test_a_run_that_goes_on_has_none_of_its_earlier_end(
    done: Path, tmp_path: Path, make_march: Any
) -> None:
    path = tmp_path / "run.h5"
    shutil.copyfile(done / "run.h5", path)
    march = make_march(n_steps=2000)
    recorder = Recorder(march.comm, path, march.header(), resume=True, force_filter=lambda: FILTER)
    march.drive(recorder, outcome="interrupted", first_step=2000)
    recorder.close()
    with Results(path) as results:
        assert results.outcome == "interrupted" and results.stored_filtered_force() is None


def test_a_damaged_one_is_left_aside(done: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copyfile(done / "run.h5", path)
    with h5py.File(path, "r") as file:
        chunk = file[FILTERED_FORCE].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + 7] ^= 0xFF
    path.write_bytes(content)
    with Results(path) as results:
        assert results.stored_filtered_force() is None
        assert not results.damage  # what it was made of is there


# --- derivatives of statistics beside differences of the statistics themselves --------------------


STEP, N = 2e-3, 4000
NAMES = {"mean": "mean", "std": "std", "maximum": "maximum", "minimum": "minimum",
         "stat_max": "stat_max", "stat_min": "stat_min"}  # fmt: skip


def records(seed: int) -> np.ndarray:
    """Noise with some slow waves, (N,)."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(N)
    waves = sum(np.sin(2 * np.pi * f * time + random.uniform(0, 6)) for f in (0.7, 1.3, 6.0))
    return np.asarray(20.0 * waves + 5.0 * random.standard_normal(N))


@pytest.mark.parametrize("name", NAMES)
def test_statistics_change_as_differences_of_them(name: str) -> None:
    position, evaluation = 70.0 * STEP * np.arange(N), (100.0, 400.0)
    within = (position >= evaluation[0]) & (position <= evaluation[1])
    force, by_force = 120.0 + records(1), records(2)
    found = statistics.force_derivatives(force, by_force[:, None], within, STEP)
    step = 1e-6
    both = [
        getattr(contact_statistics("", position, own, own, STEP, evaluation), NAMES[name])
        for own in (force + step * by_force, force - step * by_force)
    ]
    # Round-off of some 100 N over twice the step.
    expected = (both[0] - both[1]) / (2.0 * step)
    check(name, getattr(found, name), expected, within=1e-6)


def test_records_are_compared_at_equal_places() -> None:
    """A force that depends on the place alone keeps its statistics at any speed."""
    speed, place = 70.0, 70.0 * STEP * np.arange(N)
    number = 2 * np.pi / 50.0
    force = 120.0 + 30.0 * np.sin(number * place)
    by_force = (30.0 * number * np.cos(number * place) * place / speed)[:, None]
    within = (place >= 100.0) & (place <= 400.0)
    by_place = (place / speed / speed)[:, None]  # per m/s, over the speed
    found = statistics.force_derivatives(force, by_force, within, STEP, by_place)
    moved = statistics.force_derivatives(force, by_force, within, STEP)
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
    found = statistics.force_derivatives(flat, records(3)[:, None], np.ones(N, dtype=bool), STEP)
    assert np.isfinite(found.std).all()
