"""Ends of a window are stable: eigenvalues of a step of a part of a wire whose rest is held.

Matrices are those of ``model/beam.py``; the step is written out here.
"""

from __future__ import annotations

import numpy as np
import pytest

from catenary.solver.model import beam

# The contact wire of re330_stitched: tension [N], bending stiffness [N m2], mass [kg/m].
TENSION, BENDING, MASS = 27e3, 137.0, 1.082
# Damping on mass [1/s]; elements that move and elements beyond, further than a step reaches in
# all but the shortest, where they stand for a longer line well enough.
BETA, MOVING, BEYOND = 0.0125, 14, 12


def matrices(element: float) -> tuple[np.ndarray, np.ndarray]:
    """M and K of the wire, clamped at both ends."""
    n, length = MOVING + BEYOND, np.array([element])
    mass = beam.mass(length, np.array([MASS]))[0]
    stiffness = beam.stiffness(length, np.array([BENDING]), np.array([TENSION]))[0]
    whole = np.zeros((2, 2 * n + 2, 2 * n + 2))
    for i in range(0, 2 * n, 2):
        whole[:, i : i + 4, i : i + 4] += mass, stiffness
    return whole[0, 2:-2, 2:-2], whole[1, 2:-2, 2:-2]


def largest_growth(element: float, dt: float, alpha: float, station_beyond: bool) -> float:
    """Largest eigenvalue of a step of Newmark's method (1/4, 1/2) of the part that moves.

    With ``station_beyond`` elimination starts one station beyond that part, else at its end.
    """
    mass, stiffness = matrices(element)
    damping = alpha * stiffness + BETA * mass
    operator = mass + 0.5 * dt * damping + 0.25 * dt**2 * stiffness
    n = 2 * MOVING
    read = n + 2 * station_beyond

    # State: x, dt v, dt^2 a of the part that moves; all else is at rest before and after a step.
    x, v, a = np.eye(3 * n).reshape(3, n, 3 * n)
    predicted, rate = x + v + 0.25 * a, v + 0.5 * a
    right = np.zeros((len(mass), 3 * n))
    right[:read] = -(dt**2 * stiffness[:read, :n] @ predicted + dt * damping[:read, :n] @ rate)
    found = np.linalg.solve(operator, right)[:n]
    step = np.concatenate([predicted + 0.25 * found, rate + 0.5 * found, found])
    return float(np.abs(np.linalg.eigvals(step)).max())


@pytest.mark.parametrize("alpha", [0.0, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 2e-3])
def test_ends_are_stable_at_any_step_and_element(dt: float, alpha: float) -> None:
    elements = (0.1, 0.15, 0.2, 0.27, 0.4, 0.7, 1.0, 1.4, 2.0, 4.0)
    growth = [largest_growth(element, dt, alpha, station_beyond=True) for element in elements]
    print(f"dt {1e3 * dt:g} ms, alpha {alpha:g} s: largest eigenvalue {max(growth):.6f}")
    # Without damping some are 1. Round-off of a matrix that is not normal is some 1e-9 of them.
    assert max(growth) < 1.0 + 1e-6


def test_ends_at_which_elimination_starts_are_not() -> None:
    assert largest_growth(0.27, 1e-3, 1e-2, station_beyond=False) > 1.5
