"""Least squares and null spaces: against NumPy's, and on what SciPy's defaults give up on."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.mbs.rigid.system import least_squares, null_space

EPS = np.finfo(float).eps


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_the_smallest_solution_of_a_matrix_of_any_rank(rank: int) -> None:
    rng = np.random.default_rng(rank)
    matrix = rng.normal(size=(7, rank)) @ rng.normal(size=(rank, 5))
    right = rng.normal(size=(7, 2))
    expected = np.linalg.pinv(matrix) @ right
    # Numbers of the order of one, condition numbers below 1e3.
    assert least_squares(matrix, right, 1e-8) == pytest.approx(expected, abs=1e6 * EPS)
    free = null_space(matrix)
    assert free.shape == (5, 5 - rank)
    assert matrix @ free == pytest.approx(np.zeros((7, 5 - rank)), abs=1e3 * EPS)
    assert free.T @ free == pytest.approx(np.eye(5 - rank), abs=1e2 * EPS)


def test_without_equations_all_is_free() -> None:
    assert null_space(np.zeros((0, 3))) == pytest.approx(np.eye(3))
    assert null_space(np.zeros((2, 3))).shape == (3, 3)
