"""A state kept one prediction ahead is the same state."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.solver.integrators.line_state import LineState, PredictedLineState, StepFactors
from catenary.solver.kernels import native

RNG = np.random.default_rng(5)
N = 12
STEPS = StepFactors(0.1, 1.0, 0.0, 0.0, 0.002, 0.0, 0.05, 0.0, 0.3, 0.0025, 0.05, 0.4)
# Sums of some numbers of order one.
ROUND_OFF = 1e-15


@pytest.fixture
def state() -> np.ndarray:
    """Displacement, velocity and acceleration."""
    return RNG.standard_normal((3, N))


def ahead() -> PredictedLineState:
    return PredictedLineState(*np.zeros((4, N)), STEPS)


def test_it_keeps_what_newmark_s_formulas_predict(state: np.ndarray) -> None:
    motion, work = ahead(), np.zeros(N)
    motion.put(*state)
    predicted = state.copy()
    native.predict(*predicted, np.zeros(0), work, STEPS)
    x, y, z = motion.read[:3]
    for found, expected in ((x, work), (y, predicted[1]), (z, state[2])):
        np.testing.assert_allclose(found, expected, rtol=0, atol=4 * ROUND_OFF)


def test_it_gives_back_what_it_took(state: np.ndarray) -> None:
    motion = ahead()
    motion.put(*state)
    found = np.array([motion.displacement, motion.velocity, motion.acceleration])
    np.testing.assert_allclose(found, state, rtol=0, atol=4 * ROUND_OFF)
    part = np.zeros((2, 5))
    native.displacements(motion.read, 3, part[0])
    native.velocities(motion.read, 3, part[1])
    np.testing.assert_allclose(part, state[:2, 3:8], rtol=0, atol=4 * ROUND_OFF)


def test_acceleration_found_later_moves_it_as_it_moves_the_state(state: np.ndarray) -> None:
    motion, change = ahead(), RNG.standard_normal(N)
    motion.put(*state)
    gained = np.array([STEPS.position_factor, STEPS.velocity_factor, 1.0])
    moved = state + gained[:, None] * change
    for array, gain in zip(motion.read[:3], motion.gains, strict=True):
        array += gain * change
    found = np.array([motion.displacement, motion.velocity, motion.acceleration])
    np.testing.assert_allclose(found, moved, rtol=0, atol=8 * ROUND_OFF)


def test_what_is_carried_is_taken_bit_by_bit(state: np.ndarray) -> None:
    names = "displacement", "velocity", "acceleration"
    motion, other = ahead(), ahead()
    motion.put(*state)
    rounded = motion.displacement.copy(), motion.velocity, motion.acceleration.copy()
    stored = dict(zip(names, rounded, strict=True)) | {
        name: array.copy() for name, array in motion.carried().items()
    }
    other.take(stored)
    for found, expected in zip(other.read[:4], motion.read[:4], strict=True):
        assert np.array_equal(found, expected)
    # A motion that is kept as it is has no use for predictions, and gives none away.
    plain = LineState(*np.zeros((3, N)), (0.0, 0.0, 1.0))
    plain.take(stored)
    assert np.array_equal(plain.displacement, rounded[0]) and not plain.carried()
