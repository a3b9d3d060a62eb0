"""The controller of step sizes, and the estimate that it is given."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check

from catenary.solver.problem.problem import n_halvings
from catenary.solver.schemes.adaptive_steps import StepError, StepSize


def test_the_next_size_is_that_of_petscs_basic_controller() -> None:
    """PETSc manual, TSADAPTBASIC: h 0.9 e^(-1/3), within a tenth and ten times h, and half of that
    where a step is rejected twice."""
    control = StepSize(0.5, 1e-3, 1e-5)
    for error in (0.1, 0.4, 0.6, 4.0):
        accepted, size = control.after_step(error, 1e-4)
        assert accepted == (error <= 0.5)
        check(
            f"next size after {error} N [s]", size, 0.9e-4 * (error / 0.5) ** (-1 / 3), within=1e-12
        )
        control.after_step(0.1, 1e-4)
    assert control.after_step(4.0, 1e-4) == (False, pytest.approx(0.45e-4))
    assert control.after_step(4.0, 1e-4) == (False, pytest.approx(0.225e-4))
    assert control.after_step(0.0, 1e-3) == (True, 1e-3)
    assert control.after_step(1e-9, 2e-5) == (True, 2e-4)  # ten times at most
    assert control.after_step(1e9, 1e-5) == (True, 1e-5)  # the smallest is taken whatever happens
    check("size after a failure [s]", control.after_failure(8e-4), 2e-4, within=1e-16)
    assert not control.after_step(4.0, 1e-4)[0]


def test_the_estimate_is_what_average_acceleration_misses() -> None:
    """One step of x" = -w^2 x from an exact state against its exact end.

    The step misses h^3 / 12 times the third derivative in its middle. The estimate takes it h
    earlier, from an exact past and an end that is wrong by what is missed, which is 1 / 12 of the
    third difference: w h and 1 / 12 are how far both may differ.
    """
    omega, k, one = 30.0, np.array([1e5]), np.ones(1)
    for h in (2e-3, 1e-3):
        for phase in (0.3, 1.1, 2.0):
            estimate = StepError(1)
            for back in (2, 1, 0):
                estimate.accept(1.0 - back * h, one * np.cos(phase - omega * h * back), one)
            x, v, a = np.cos(phase), -omega * np.sin(phase), -(omega**2) * np.cos(phase)
            ahead = x + h * v + h**2 / 4 * a
            new_a = -(omega**2) * ahead / (1 + (omega * h) ** 2 / 4)
            found = one * (ahead + h**2 / 4 * new_a)
            missed = k[0] * abs(found[0] - np.cos(phase + omega * h))
            told = estimate.of(1.0 + h, found, one, k, 1e-9 * one)
            scale = k[0] * (omega * h) ** 3 / 12
            check("error of the step [N]", told, missed, within=(1.5 * omega * h + 1 / 12) * scale)


def test_a_landing_within_a_step_is_told() -> None:
    """A mass that hits a spring amid a step of average acceleration: by energy, it is pressed back
    with v sqrt(k m) at most. The estimate bounds what the step makes of that, for h -> 0."""
    mass, k, v, one = 2.0, 8e4, 0.3, np.ones(1)
    omega = np.sqrt(k / mass)
    for h in (5e-4, 2.5e-4):
        compliance = one * h**2 / (4 * mass)
        for share in (0.25, 0.5, 0.75):
            estimate = StepError(1)
            for number in (0, 1, 2):
                estimate.accept(h * number, one * v * h * (number - 2 - share), 0 * one)
            ahead = v * h * (1 - share)
            acceleration = -k * ahead / mass / (1 + k * compliance[0])
            depth, speed = ahead + h**2 / 4 * acceleration, v + h / 2 * acceleration
            told = estimate.of(3 * h, one * depth, one * k * depth, one * k, compliance)
            missed = abs(np.hypot(speed * np.sqrt(k * mass), k * depth) - v * np.sqrt(k * mass))
            print(f"h {h:g} share {share}: told {told:.3g} N, wrong by {missed:.3g} N")
            assert missed <= told * (1 + omega * h)


def test_no_estimate_without_a_past_or_a_contact() -> None:
    estimate, one, none = StepError(1), np.ones(1), np.zeros(1)
    for number in range(3):
        assert estimate.of(number, -one, none, one, one) is None
        estimate.accept(number, -one * number**3, none)
    assert estimate.of(3.0, -27 * one, none, one, one) == 0.0
    # A 12th of the third derivative, which is 6; no compliance that could swing.
    assert estimate.of(3.0, -27 * one, one, one, none) == pytest.approx(0.5)
    again = StepError(1)
    again.restore(estimate.state())
    assert again.of(3.0, -27 * one, one, one, none) == pytest.approx(0.5)


def test_halvings() -> None:
    assert [n_halvings(1e-3, s) for s in (None, 5e-4, 2.6e-4, 2.5e-4, 1e-3 / 4096)] == [
        5,
        1,
        1,
        2,
        12,
    ]
