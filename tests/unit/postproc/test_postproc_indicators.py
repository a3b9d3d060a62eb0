"""Error indicators: closed forms, a second method for the mesh, and what a run is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from measuring import check
from scipy import linalg

from catenary.postproc.evaluate.error_indicators import (
    LINE_MEMORY,
    NEAR_MEMORY,
    Method,
    as_table,
    indicate,
    memory,
    required_by_bending,
    required_frequency,
    resolved_frequency,
    step_error,
)
from catenary.postproc.read.results import Results
from catenary.solver.model import beam
from catenary.solver.problem.integrator_parameters import Integration, integration_of

UNDAMPED = Method(0.0, 0.0)


def tone(frequency: float, dt: float, seconds: float = 6.0) -> np.ndarray:
    """A force of amplitude 10 N on 100 N."""
    t = np.arange(round(seconds / dt)) * dt
    return 100.0 + 10.0 * np.sin(2.0 * np.pi * frequency * t)


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 2e-3])
def test_a_single_tone_is_late_by_the_period_elongation_of_the_method(dt: float) -> None:
    """Period elongation (w dt)^2 / 12 of the average acceleration (Bathe, ch. 9), for T seconds.

    The window spreads the tone over 2 / 6 s: up to w^3 (1 +- 3 * 0.17 / 10), and half of that on
    average cancels; 2 % is allowed.
    """
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    phase = total * omega * (omega * dt) ** 2 / 12.0
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * phase)
    found = step_error(tone(10.0, dt), dt, UNDAMPED)
    check("rms error [N]", found, expected, within=0.02 * expected)


def test_a_long_record_is_wrong_by_as_much_as_a_short_one() -> None:
    """Of 15 minutes the spectrum is a mean over three stretches: the tone's lines are narrower."""
    dt = 1e-3
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * total * omega * (omega * dt) ** 2 / 12.0)
    found = step_error(tone(10.0, dt, 900.0), dt, UNDAMPED)
    check("rms error [N]", found, expected, within=1e-4 * expected)


def test_numerical_damping_counts_to_the_first_order_of_the_step() -> None:
    """Damping ratio (gamma - 1/2) w dt / 2: halving the step halves the error."""
    damped = Method(0.0, 0.0, Integration(0.3025, 0.6))
    coarse = step_error(tone(5.0, 1e-3), 1e-3, damped)
    fine = step_error(tone(5.0, 0.5e-3), 0.5e-3, damped)
    expected = 10.0 / np.sqrt(2.0) * (LINE_MEMORY + NEAR_MEMORY)
    expected *= 0.1 * (2.0 * np.pi * 5.0) ** 2 * 0.5e-3 / 2.0
    # The window's spread, and what the period elongation adds: (0.025)^2 / 2 of it.
    check("rms error [N]", fine, expected, within=0.03 * expected)
    check("ratio", coarse / fine, 2.0, within=0.02)


def test_methods_that_damp_with_order_3_are_late_by_their_own_period_elongation() -> None:
    """HHT with a_f = 1/3: beta = 4/9, E = 2/9 - 1/24 - 1/18; damping ratio 1/54 (w dt)^3."""
    method, dt = Method(0.0, 0.0, integration_of("hht", 0.5)), 1e-3
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    x = omega * dt
    phase = total * omega * x**2 * np.hypot(2 / 9 - 1 / 24 - 1 / 18, x / 54)
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * phase)
    found = step_error(tone(10.0, dt), dt, method)
    check("rms error [N]", found, expected, within=0.02 * expected)


def test_no_error_without_fluctuation() -> None:
    assert step_error(np.full(500, 120.0), 1e-3, UNDAMPED) == 0.0


def test_damped_waves_are_forgotten_at_the_rate_at_which_they_decay() -> None:
    """A lightly damped oscillation decays with (beta + alpha w^2) / 2 (Rayleigh)."""
    omega = np.array([20.0, 60.0, 120.0])
    alpha, beta = 1e-4, 0.02
    rate = 0.5 * (beta + alpha * omega**2)
    expected = NEAR_MEMORY + 1.0 / (1.0 / LINE_MEMORY + rate)
    # The next term of the root is (alpha w)^2 = 1.4e-4 of the first.
    check("memory [s]", memory(omega, alpha, beta), expected, within=1e-3 * expected)


def test_a_heavily_damped_line_leaves_the_memory_of_what_is_near() -> None:
    assert memory(np.array([120.0]), 1.0, 0.0)[0] < 1.6 * NEAR_MEMORY


@pytest.mark.parametrize(("length", "stiffness"), [(1.0, 195.0), (1.3, 195.0), (2.0, 0.0)])
def test_resolved_waves_are_the_modes_that_a_hinged_wire_gets_right(
    length: float, stiffness: float
) -> None:
    """Modes of 60 elements between hinges, sin(j pi x / L): the last right one in ascending order.

    Neighbouring modes are c / 2 L apart, which is the resolution of this way to count.
    """
    n, tension, mass = 60, 20e3, 1.35
    total = n * length
    size = 2 * (n + 1)
    matrices = np.zeros((2, size, size))
    lengths = np.full(n, length)
    for which, parts in enumerate(
        (beam.stiffness(lengths, stiffness, tension), beam.mass(lengths, mass))
    ):
        for e in range(n):
            matrices[which, 2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += parts[e]
    free = np.setdiff1d(np.arange(size), [0, size - 2])
    k, m = (matrix[np.ix_(free, free)] for matrix in matrices)
    found = np.sqrt(linalg.eigh(k, m, eigvals_only=True))
    number = np.arange(1, found.size + 1) * np.pi / total
    exact = number * np.sqrt((tension + stiffness * number**2) / mass)
    wrong = np.abs(found / exact - 1.0) > 0.01
    wrong[n - 1] = False  # two elements a wave: only one of its two standing waves fits
    last = int(np.argmax(wrong)) - 1
    spacing = (exact[last + 1] - exact[last]) / (2.0 * np.pi)
    check(
        "resolved [Hz]",
        resolved_frequency(length, tension, stiffness, mass),
        exact[last] / (2.0 * np.pi),
        within=1.5 * spacing,
    )


def test_waves_ahead_of_the_train_are_shortened_by_its_motion() -> None:
    """Doppler: 20 Hz / (1 - v / c)."""
    check("required [Hz]", required_frequency(20.0, 0.6, 0.0), 50.0, within=1e-6)
    assert required_frequency(20.0, 1.0, 0.0) == np.inf


def test_waves_ahead_on_a_rail_are_shortened_by_its_bending() -> None:
    """A train at rest excites waves of the frequency that it feels; without tension k is the root
    of sqrt(EI / m) k^2 - v k - w_0 = 0 and the frequency w_0 + v k."""
    rail = {"tension": 1e-6, "bending_stiffness": 2.7e5, "mass_per_length": 7.1}
    check("required [Hz]", required_by_bending(20.0, 0.0, **rail), 20.0, within=1e-9)
    stiff, speed, own = np.sqrt(2.7e5 / 7.1), 120.0 / 3.6, 2.0 * np.pi * 20.0
    k = (speed + np.sqrt(speed**2 + 4.0 * stiff * own)) / (2.0 * stiff)
    expected = (own + speed * k) / (2.0 * np.pi)
    check("required [Hz]", required_by_bending(20.0, speed, **rail), expected, within=1e-9)
    # A string as slow as that has none at all.
    assert required_by_bending(20.0, speed, 100.0, 0.0, 7.1) == np.inf


def test_waves_on_a_damped_line_need_no_more_than_their_length() -> None:
    """The root itself: w - v Re k = w_0 and f = |k| c / 2 pi with k = (w / c) / sqrt(1 + i a w).

    On a heavily damped line at rest k tends to sqrt(w / a) / c.
    """
    alpha = 50.0
    own = 2.0 * np.pi * 20.0
    expected = np.sqrt(own / alpha) / (2.0 * np.pi)
    # The next term of the root is 1 / (4 (alpha w)^2) = 6e-9 of it.
    check("required [Hz]", required_frequency(20.0, 0.0, alpha), expected, within=1e-6 * expected)
    found = [required_frequency(20.0, 0.7, alpha) for alpha in (0.0, 1e-4, 1e-3, 1e-2, 1e-1)]
    assert sorted(found, reverse=True) == found


def test_finer_elements_resolve_more() -> None:
    """Without bending stiffness nothing but the element's length has a length: f ~ 1 / h."""
    coarse, fine = (resolved_frequency(h, 20e3, 0.0, 1.35) for h in (2.0, 1.0))
    check("ratio", fine / coarse, 2.0, within=1e-9)


def test_a_run_is_told_its_indicators(run_folder: Path) -> None:
    """The made-up record has 10 N at 9 Hz beside the span's frequency, steps of 1 ms."""
    with Results(run_folder) as results:
        found = indicate(results)
        table = as_table(found)
    # 20 Hz / (1 - 83.3 / 122.6)
    check("required [Hz]", found.required_frequency, 62.4, within=0.1)
    assert table["mesh"]["resolved_hz"] == found.resolved_frequency
    assert ((found.relative_error > 1e-4) & (found.relative_error < 0.05)).all()
    # Elements of 5/3 m, about half as many as 62 Hz need.
    assert [text.split()[1] for text in found.warnings] == ["longest"]
    assert list(found.warnings) == table["warnings"]
