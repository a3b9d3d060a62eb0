"""The Hermite element: symmetry, rigid motions, patch tests, consistency of its functions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catenary.solver.model.elements import beam
from catenary.solver.model.elements.shape_functions import shape_slopes, shape_values

EPS = np.finfo(float).eps
lengths = st.floats(0.05, 20.0)
inside = st.floats(0.0, 1.0)


def shape_of(polynomial: np.polynomial.Polynomial, length: float) -> np.ndarray:
    """Unknowns (w1, theta1, w2, theta2) of a polynomial on an element from 0 to ``length``."""
    slope = polynomial.deriv()
    return np.array([polynomial(0), slope(0), polynomial(length), slope(length)])


@given(lengths)
def test_matrices_are_symmetric_and_do_not_resist_rigid_motions(length: float) -> None:
    one = np.array([length])
    bending = beam.stiffness(one, 3.0, 0.0)[0]
    tension = beam.stiffness(one, 0.0, 7.0)[0]
    mass = beam.mass(one, 2.0)[0]
    for matrix in (bending, tension, mass):
        assert np.array_equal(matrix, matrix.T)
        # One eigenvalue may be zero for each rigid motion; none is negative.
        assert np.linalg.eigvalsh(matrix)[0] > -8 * EPS * np.abs(matrix).max()
    lift, turn = np.array([1.0, 0.0, 1.0, 0.0]), np.array([0.0, 1.0, length, 1.0])
    for matrix, motions in ((bending, (lift, turn)), (tension, (lift,))):
        for motion in motions:
            round_off = 8 * EPS * (np.abs(matrix) @ np.abs(motion)).max()
            assert np.abs(matrix @ motion).max() <= round_off
    assert lift @ mass @ lift == pytest.approx(2.0 * length, rel=8 * EPS)
    # About its end a rod of mass m has the moment of inertia m l^2 / 3.
    assert turn @ mass @ turn == pytest.approx(2.0 * length**3 / 3, rel=16 * EPS)


@given(lengths, st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4))
def test_energies_of_cubics_are_exact(length: float, coefficients: list[float]) -> None:
    """Patch test: all cubics are represented, so EI w''^2, F w'^2 and rho w^2 integrate exactly."""
    w = np.polynomial.Polynomial(coefficients)
    unknowns = shape_of(w, length)
    one = np.array([length])
    for matrix, integrand in (
        (beam.stiffness(one, 3.0, 0.0)[0], 3.0 * w.deriv(2) ** 2),
        (beam.stiffness(one, 0.0, 7.0)[0], 7.0 * w.deriv() ** 2),
        (beam.mass(one, 2.0)[0], 2.0 * w**2),
    ):
        whole = integrand.integ()
        # Round-off of the products that cancel.
        round_off = 64 * EPS * np.abs(unknowns) @ np.abs(matrix) @ np.abs(unknowns)
        assert unknowns @ matrix @ unknowns == pytest.approx(whole(length), abs=round_off + 1e-300)


# The first example compiles.
@settings(deadline=None)
@given(lengths, inside, st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4))
def test_shape_functions_interpolate_cubics_and_their_slopes(
    length: float, xi: float, coefficients: list[float]
) -> None:
    w = np.polynomial.Polynomial(coefficients)
    unknowns = shape_of(w, length)
    value, slope = (
        shape_values(xi, length),
        shape_slopes(xi, length),
    )
    round_off = 32 * EPS * max(1.0, length) ** 3
    assert value @ unknowns == pytest.approx(w(xi * length), abs=round_off * 4)
    assert slope @ unknowns == pytest.approx(w.deriv()(xi * length), abs=round_off * 12 / length)


def test_shape_functions_are_one_at_their_own_unknown() -> None:
    length = 2.5
    assert np.array_equal(shape_values(0.0, length), [1, 0, 0, 0])
    assert np.array_equal(shape_values(1.0, length), [0, 0, 1, 0])
    assert np.array_equal(shape_slopes(0.0, length), [0, 1, 0, 0])
    assert np.array_equal(shape_slopes(1.0, length), [0, 0, 0, 1])


@given(lengths)
def test_uniform_load_does_the_work_of_its_distribution(length: float) -> None:
    load = beam.uniform_load(np.array([length]))[0]
    for coefficients in np.eye(4):
        w = np.polynomial.Polynomial(coefficients)
        whole = w.integ()(length)
        assert load @ shape_of(w, length) == pytest.approx(whole, rel=16 * EPS)


def test_many_lengths_are_many_elements() -> None:
    several = np.array([0.5, 1.0, 4.0])
    matrices = beam.stiffness(several, 195.0, 20e3)
    for length, matrix in zip(several, matrices, strict=True):
        assert np.array_equal(matrix, beam.stiffness(np.array([length]), 195.0, 20e3)[0])
