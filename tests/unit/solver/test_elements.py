"""The Hermite element: symmetry, rigid motions, patch tests, consistency of its functions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catenary.solver.model import beam
from catenary.solver.model.beam import shape_slopes, shape_values

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


BENDING, TENSION = 131.7, 16000.0  # sqrt(EI / T) is 0.09 m


def pinned_wire(
    elements: np.ndarray, bending_stiffness: float, load: float, force: float
) -> tuple[np.ndarray, np.ndarray]:
    """Heights (n + 1,) [m] and slopes (n + 1,) [-] of a wire pinned at both ends.

    ``elements`` (n,) are their lengths [m], ``load`` is downward per length [N/m], ``force``
    downward at the node in the middle [N].
    """
    n, tension = elements.size, np.full(elements.size, TENSION)
    matrices = beam.exact_stiffness(elements, bending_stiffness, tension)
    share = beam.moment_share(elements, bending_stiffness, tension)
    loads = -load * beam.uniform_load(elements)
    loads[:, 1::2] *= share[:, None]
    whole, right = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros(2 * n + 2)
    for i in range(n):
        own = slice(2 * i, 2 * i + 4)
        whole[own, own] += matrices[i]
        right[own] += loads[i]
    right[n // 2 * 2] -= force
    free = np.delete(np.arange(2 * n + 2), [0, 2 * n])
    found = np.zeros(2 * n + 2)
    found[free] = np.linalg.solve(whole[np.ix_(free, free)], right[free])
    return found[::2], found[1::2]


@pytest.mark.parametrize("elements", [[27.5, 27.5], [1.0, 26.0, 0.5, 0.4, 20.1, 7.0]])
def test_exact_elements_of_any_length_have_the_heights_of_the_closed_form(
    elements: list[float],
) -> None:
    """A load q and a force P: each sags as a string's does, less what bending holds up in layers of
    r = sqrt(EI / T)."""
    ends = np.concatenate([[0.0], np.cumsum(elements)])
    span, place = ends[-1], ends[len(elements) // 2]
    q, force, r = 10.6, 196.0, np.sqrt(BENDING / TENSION)
    height, _ = pinned_wire(np.array(elements), BENDING, q, force)
    s, half = ends, span / 2
    layer = 1.0 - np.cosh((s - half) / r) / np.cosh(half / r)
    sag = q * s * (span - s) / (2 * TENSION) - q * r**2 / TENSION * layer
    near, far = np.minimum(s, place), span - np.maximum(s, place)
    bent = np.sinh(near / r) / np.sinh(span / r) * np.sinh(far / r)
    sag += force / TENSION * (near * far / span - r * bent)
    # Condition of the chain: bending of the shortest element 12 EI / h^3 against T / l of all.
    condition = 12 * BENDING / min(elements) ** 3 * span / TENSION + len(elements) ** 2
    np.testing.assert_allclose(height, -sag, rtol=0, atol=64 * EPS * condition * sag.max())


def test_an_exact_element_without_bending_stiffness_is_a_string() -> None:
    height, _ = pinned_wire(np.array([27.5, 27.5]), 0.0, 10.6, 196.0)
    sag = 10.6 * 55.0**2 / (8 * TENSION) + 196.0 * 55.0 / (4 * TENSION)
    # It bends in layers r of 1e-4 of an element, which hold up F r / 2 T + q r^2 / T and no more.
    r = 1e-4 * 27.5
    within = 1.01 * (0.5 * 196.0 * r + 10.6 * r**2) / TENSION
    assert height[1] == pytest.approx(-sag, abs=within)


@given(st.floats(1e-4, 0.4), st.floats(0.05, 20.0))
def test_short_exact_elements_are_those_of_hermite(ratio: float, length: float) -> None:
    """Both are series in (h / r)^2, of which Hermite's has the first two terms. The third one of
    k coth k is -k^4 / 45, of k^2 / (k coth k - 1) it is -k^4 / 175, with k = h / 2 r."""
    one, tension = np.array([length]), np.array([TENSION])
    bending = TENSION * (length / ratio) ** 2
    exact = beam.exact_stiffness(one, bending, tension)[0]
    hermite = beam.stiffness(one, bending, TENSION)[0]
    # In terms of EI / h, for deflections in terms of h.
    scale = np.array([length, 1.0, length, 1.0])
    difference = np.abs(exact - hermite) * scale * scale[:, None] * length / bending
    k = 0.5 * ratio
    third = 2 * k**4 * np.array([1 / 175, 1 / 45])
    # Of the series below k = 0.01, and round-off of what is divided by c - 1 = k^2 / 3.
    round_off = 12 * (1e-10 + 8 * EPS / max(k, 1e-2) ** 2)
    assert difference.max() < 4 * third[0] + round_off
    assert difference[1, 1] < 0.5 * third.sum() + round_off
