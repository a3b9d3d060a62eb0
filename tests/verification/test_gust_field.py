"""Made gusts against the spectra and the coherence that are wanted of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scipy.integrate import quad

from catenary.mbs.air import Tunnel
from catenary.solver.problem.wind import Gusts, Profile, Stretch, Wind, friction_velocity_of
from catenary.solver.wind import (
    ACROSS,
    ALONG,
    POSTS,
    UPWARD,
    GustField,
    exposure,
    variance_below,
    wind_at,
)

# As strong as the wind at 10 m, so that Davenport's U10 is the mean.
WIND = Wind(
    25.0, height=10.0, gusts=Gusts(friction_velocity_of(0.2, 25.0), highest=2.0, growth=0.0)
)
KARMAN = replace(WIND, gusts=replace(WIND.gusts, spectrum="von_karman"))
BANDS = [(0.1, 0.3), (0.3, 0.8), (0.8, 1.8)]


def density(wind: Wind, part: int, n: float) -> float:
    """The published spectra [m2/s], written as they are in their sources."""
    u2, mean, z = wind.gusts.friction_velocity**2, wind.mean, wind.height
    if part == UPWARD:
        return u2 / n * 6 * (n * z / mean) / (1 + 4 * n * z / mean) ** 2
    if part == ACROSS:
        return u2 / n * 15 * (n * z / mean) / (1 + 9.5 * n * z / mean) ** (5 / 3)
    if wind.gusts.spectrum == "von_karman":
        y = n * wind.gusts.length_scale / mean
        return 6 * u2 / n * 4 * y / (1 + 70.8 * y**2) ** (5 / 6)
    x = 1200 * n / wind.speed
    return u2 / n * 4 * x**2 / (1 + x**2) ** (4 / 3)


@pytest.mark.parametrize("part", [ALONG, ACROSS, UPWARD])
@pytest.mark.parametrize("wind", [WIND, KARMAN], ids=["davenport", "von karman"])
def test_waves_have_the_variance_of_the_spectrum(wind: Wind, part: int) -> None:
    gusts = wind.gusts
    area = quad(lambda n: density(wind, part, n), gusts.lowest, gusts.highest, limit=200)[0]
    field = GustField(wind, part, np.array([0.0, 5.0]))
    check("variance [m2/s2]", (field.deviations**2).sum(), area, within=1e-6 * area)
    assert field.frequencies.min() >= gusts.lowest and field.frequencies.max() <= gusts.highest
    for low, high in BANDS:
        own = (field.frequencies >= low) & (field.frequencies < high)
        area = quad(lambda n: density(wind, part, n), low, high)[0]
        # By one band of 0.01 Hz at either edge.
        edge = 0.01 * (density(wind, part, low) + density(wind, part, high))
        check(f"{low} to {high} Hz", (field.deviations[own] ** 2).sum(), area, within=edge)
    whole = variance_below(wind, ALONG)(np.array(1e9))
    check("intensity", np.sqrt(whole) / wind.mean, 0.2, within=1e-3)


def spectra(part: int, points: np.ndarray, seeds: int, duration: float):
    """Transforms (seeds, points, n) of fields, scaled so that squares are densities, and n [Hz]."""
    found = []
    for seed in range(seeds):
        wind = replace(WIND, gusts=replace(WIND.gusts, seed=seed))
        field = GustField(wind, part, points)
        slices = np.empty((round(duration / field.interval), points.size))
        field.fill(1000 * seed, slice(0, points.size), slices)
        window = np.hanning(slices.shape[0])
        scale = np.sqrt(2.0 * field.interval / (window**2).sum())
        found.append(scale * np.fft.rfft(window[:, None] * slices, axis=0).T)
    n = np.fft.rfftfreq(slices.shape[0], field.interval)
    return np.array(found), n, field.interval


@pytest.mark.parametrize("part", [ALONG, UPWARD])
def test_series_have_the_spectrum(part: int) -> None:
    """Band means of periodograms at places 800 m apart, over seeds.

    A periodogram's value is spread by its mean. A band of width B over T = 100 s holds B T of them,
    of which a Hann window lets 2 B T / 3 be independent; with 6 places and 8 seeds their mean is
    spread by 1 / sqrt(32 B T). Four times that, and 2 % for leakage, are allowed.
    """
    found, n, interval = spectra(part, 800.0 * np.arange(6), 8, 100.0)
    for low, high in BANDS:
        own = (n >= low) & (n < high)
        # Slices are raised by what is lost between them.
        wanted = [density(WIND, part, f) / np.sinc(f * interval) ** 4 for f in n[own]]
        spread = 4.0 / np.sqrt(32.0 * (high - low) * 100.0) + 0.02
        ratio = (np.abs(found[..., own]) ** 2).mean() / np.mean(wanted)
        check(f"{low} to {high} Hz, of what is wanted", ratio, 1.0, within=spread)


@pytest.mark.parametrize("apart", [1, 4])
def test_points_are_as_coherent_as_wanted(apart: int) -> None:
    """Cross spectra of neighbours 5 and 20 m apart, about a post and between posts.

    The real part of the mean of M products is spread by sqrt((1 + c^2) / 2 M) of the spectrum at
    most, M as in the other test for 24 seeds and one pair.
    """
    points = 5.0 * np.arange(POSTS + 8)
    found, n, _ = spectra(ALONG, points, 24, 50.0)
    for first in (10, POSTS - 1):
        one, other = found[:, first], found[:, first + apart]
        for low, high in BANDS:
            own = (n >= low) & (n < high)
            power = np.sqrt((np.abs(one[:, own]) ** 2).mean() * (np.abs(other[:, own]) ** 2).mean())
            coherence = (one[:, own] * other[:, own].conj()).real.mean() / power
            weight = [density(WIND, ALONG, f) for f in n[own]]
            exact = np.exp(-10.0 * n[own] * 5.0 * apart / WIND.mean)
            wanted = np.average(exact, weights=weight)
            m = 24 * (high - low) * 50.0 / 1.5
            # What leaks into a band from below it is more coherent: 2 %.
            within = 4.0 * np.sqrt((1 + wanted**2) / (2 * m)) * (1 - wanted**2 / 2) + 0.02
            check(f"{5 * apart} m, {low} to {high} Hz", coherence, wanted, within=within)


def test_any_part_of_the_field_is_the_same_however_it_is_made() -> None:
    points = np.sort(np.random.default_rng(3).uniform(0.0, 1500.0, 3 * POSTS + 5))
    whole = np.empty((40, points.size))
    GustField(WIND, ALONG, points).fill(100, slice(0, points.size), whole)
    again = GustField(WIND, ALONG, points)
    for first, begin, end in ((130, 150, 197), (100, 0, 10), (110, 60, 140), (131, 63, 65)):
        part = np.empty((139 - first, end - begin))
        again.fill(first, slice(begin, end), part)
        assert np.array_equal(part, whole[first - 100 : 39, begin:end])
    other = np.empty_like(whole)
    for field in (
        GustField(WIND, UPWARD, points),
        GustField(replace(WIND, gusts=replace(WIND.gusts, seed=2)), ALONG, points),
    ):
        field.fill(100, slice(0, points.size), other)
        assert np.abs(other - whole).max() > 1.0


@pytest.mark.parametrize("n", [1, 2, POSTS, POSTS + 1, 2 * POSTS + 1])
def test_a_line_of_any_number_of_points_is_filled(n: int) -> None:
    field, slices = GustField(WIND, ALONG, 5.0 * np.arange(n)), np.full((3, n), np.nan)
    field.fill(0, slice(0, n), slices)
    assert np.isfinite(slices).all()


def test_gusts_grow_from_zero() -> None:
    wind = replace(WIND, gusts=replace(WIND.gusts, growth=2.0))
    field, free = (GustField(one, ALONG, 5.0 * np.arange(3)) for one in (wind, WIND))
    grown, whole = np.empty((2, 40, 3))
    field.fill(0, slice(0, 3), grown), free.fill(0, slice(0, 3), whole)
    times = field.interval * np.arange(40)
    part = 0.5 - 0.5 * np.cos(np.pi * np.minimum(times / 2.0, 1.0))
    check("grown [m/s]", grown, whole * part[:, None], within=1e-12)


def test_mean_wind_follows_profile_and_exposure() -> None:
    wind = Wind(30.0, height=6.0, stretches=(Stretch(100.0, 200.0, 1.1, 20.0),))
    check("log law [m/s]", wind.mean, 30.0 * np.log(6 / 0.05) / np.log(10 / 0.05), within=1e-12)
    power = replace(wind, profile=Profile(exponent=0.16))
    check("power law [m/s]", power.mean, 30.0 * 0.6**0.16, within=1e-12)
    places = np.array([50.0, 150.0, 250.0])
    higher = 1.1 * np.log(20 / 0.05) / np.log(6 / 0.05)
    check("exposure", exposure(wind, places), [1.0, higher, 1.0], within=1e-12)
    sheltered = exposure(wind, places, (Tunnel(210.0, 400.0, 1.5, 10.0),))
    check("in a tunnel", sheltered, [1.0, higher, 0.0], within=1e-12)


def test_a_viaduct_has_the_mean_of_its_height_and_the_gusts_of_the_plain() -> None:
    high, places = Stretch(100.0, 200.0, 1.0, 31.0), np.array([50.0, 150.0, 250.0])
    over_viaduct = wind_at(replace(WIND, stretches=(high,)), 0.0, 300.0)
    over_plain, times = wind_at(WIND, 0.0, 300.0), np.full(3, 33.3)
    more = 25.0 * (np.log(31.0 / 0.05) / np.log(10.0 / 0.05) - 1.0)
    for part, mean in ((1, [0.0, more, 0.0]), (0, [0.0, 0.0, 0.0])):
        differ = over_viaduct(places, times)[part] - over_plain(places, times)[part]
        check("faster than over the plain [m/s]", differ, mean, within=1e-12)


def test_wind_at_moving_places_is_that_of_the_field() -> None:
    """Between points and slices it is linear; across the track it is the gust along the wind."""
    moving = wind_at(WIND, 0.0, 600.0)
    points = np.linspace(0.0, 600.0, 121)
    field, slices = GustField(WIND, ALONG, points), np.empty((2, 121))
    field.fill(50, slice(0, 121), slices)
    places, later = np.array([0.0, 102.5, 600.0, 700.0]), 0.25
    times = np.full(4, (50 + later) * field.interval)
    nodes = (1 - later) * slices[0] + later * slices[1]
    with_train, across = moving(places, times)
    expected = WIND.mean + np.interp(places, points, nodes)
    check("across [m/s]", across, expected, within=1e-10)
    against = wind_at(replace(WIND, direction=np.pi), 0.0, 600.0)
    check("head wind [m/s]", against(places, times)[0], -expected, within=1e-10)
    assert np.abs(with_train).max() < 4 * WIND.mean
