"""Filters: gain and phase against theory, ends of the record, sampling."""

from __future__ import annotations

import numpy as np
import pytest

from catenary import InputError
from catenary.postproc.evaluate import filters

DT = 1e-3
TIME = DT * np.arange(12001)
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
