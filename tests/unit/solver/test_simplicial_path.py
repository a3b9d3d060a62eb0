"""Zeros on Merrill's path of simplices, of maps whose zeros are known otherwise."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catenary.solver.kernels import native

SMALL = 1e-11


def find_zero(
    of: Callable[[np.ndarray], np.ndarray], start: np.ndarray, width: float
) -> tuple[np.ndarray, bool]:
    """The last place looked at, and whether it is a zero."""
    at = start.copy()
    return at, native.find_zero(of, at, width, SMALL, native.Room(2 * start.size))


def faces(matrix: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """All s in the unit cube with F = matrix s + right: F >= 0 where s = 0, <= 0 where s = 1, and 0
    between; every face of the cube is tried."""
    n, found = right.size, []
    for face in itertools.product((0.0, 1.0, None), repeat=n):
        s = np.array([0.0 if at is None else at for at in face])
        inside = np.array([at is None for at in face])
        if inside.any():
            own = matrix[np.ix_(inside, inside)]
            s[inside] = np.linalg.solve(own, -(right + matrix @ s)[inside])
        force = matrix @ s + right
        between = ((s > 0.0) & (s < 1.0))[inside].all()
        if between and (force[~inside & (s == 0.0)] >= 0.0).all():
            if (force[~inside & (s == 1.0)] <= 0.0).all():
                found.append(s)
    return found


@given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(1, 4), turning=st.sampled_from([0.0, 1.0, 5.0])
)
@settings(max_examples=100, deadline=None)
def test_the_variational_inequality_of_any_matrix_is_solved(
    seed: int, n: int, turning: float
) -> None:
    """Also of matrices that turn, on which going from component to component runs in circles."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    matrix, right = rng.normal(size=(n, n)) + turning * (root - root.T), rng.normal(size=n)

    def normal(z: np.ndarray) -> np.ndarray:
        share = np.clip(z, 0.0, 1.0)
        return matrix @ share + right + z - share

    z, found = find_zero(normal, np.full(n, 0.5), 0.25)
    assert found
    assert np.abs(normal(z)).max() <= SMALL
    # Shares are as far from a solution as the worst condition of a face makes of SMALL.
    known = faces(matrix, right)
    assert min(np.abs(np.clip(z, 0.0, 1.0) - s).max() for s in known) < 1e6 * SMALL


def test_a_smooth_map_is_solved_and_its_path_passes_other_zeros() -> None:
    """Of z^3 - z the path may end at any of three zeros, of z^3 - 3 z + 10 at the one there is."""
    z, found = find_zero(lambda z: z**3 - z, np.array([0.3]), 0.1)
    assert found and min(abs(z[0] - root) for root in (-1.0, 0.0, 1.0)) < SMALL
    (root,) = (r.real for r in np.roots([1.0, 0.0, -3.0, 10.0]) if abs(r.imag) < 1e-9)
    z, found = find_zero(lambda z: z**3 - 3.0 * z + 10.0, np.array([4.0]), 0.25)
    assert found and z[0] == pytest.approx(root, abs=SMALL)


def test_a_map_without_a_number_is_no_zero() -> None:
    """Where it is no number, and where it is one at the start alone."""
    for of in (
        lambda z: np.full(2, np.nan),
        lambda z: z + 1.0 if z[0] == 0.5 else np.full(2, np.nan),
    ):
        _, found = find_zero(of, np.array([0.5, 0.5]), 0.25)
        assert not found


def test_a_map_without_a_zero_has_none() -> None:
    """That does not point back from afar: the path ends where nothing is left to go on with."""
    _, found = find_zero(lambda z: np.array([1.0, 0.0]), np.array([0.3, 0.4]), 0.25)
    assert not found


def test_a_map_of_numbers_beyond_the_grid_is_no_zero() -> None:
    """It jumps by 1e17: columns of a simplex are the same to round-off, and it has no next one."""
    matrix = np.array([[1.0, 1.0], [-1.0, 1.0]])
    _, found = find_zero(lambda z: 1e17 * np.sign(matrix @ z + 0.3), np.zeros(2), 0.25)
    assert not found
