"""Products and solves that store each kind of row or station once, against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from repeating_line import line
from scipy import sparse
from scipy.sparse.linalg import spsolve

from catenary.solver.linear.station_factors import station_factors
from catenary.solver.linear.station_products import MOST_KINDS, station_product
from catenary.solver.linear.unique_rows import repeated_rows

RNG = np.random.default_rng(7)
# Sums of a dozen products of numbers of order one; solves lose a few digits to the condition, 1e2.
ROUND_OFF = 1e-14
LENGTHS = [1, 2, 3, 4, 5, 40, 301]


@pytest.mark.parametrize("n_stations", LENGTHS)
def test_factors_solve_lines_of_any_length(n_stations: int) -> None:
    compare_factors(n_stations, 0, n_stations)


@pytest.mark.parametrize("n_own", LENGTHS)
@pytest.mark.parametrize("ends", [(1, 0), (0, 1), (3, 12), (20, 9)])
def test_factors_solve_parts_of_lines(n_own: int, ends: tuple[int, int]) -> None:
    compare_factors(ends[0] + n_own + ends[1], ends[0], ends[0] + n_own)


def compare_factors(n_stations: int, low: int, high: int) -> None:
    matrix = line(n_stations, joined=True)
    factors = station_factors(matrix, low, high)
    assert factors is not None
    right, answer = RNG.standard_normal(4 * n_stations), np.zeros(4 * n_stations)
    factors.solve(right, answer)
    expected = spsolve(matrix.tocsc(), right)
    assert np.abs(answer - expected).max() < ROUND_OFF * np.abs(expected).max()


def test_factors_of_a_long_line_are_of_as_many_kinds_as_those_of_a_short_one() -> None:
    short, long = station_factors(line(150)), station_factors(line(1500))
    assert short is not None and long is not None
    # The two lines differ; both forget their ends within some ten stations.
    assert abs(long.n_kinds - short.n_kinds) < 30
    assert long.n_stations == 1500 and long.n_kinds < 150


def test_a_line_that_does_not_repeat_is_left_to_petsc() -> None:
    n = MOST_KINDS + 1
    own = np.einsum("i,jk->ijk", 10.0 + np.arange(n), np.eye(4))
    indices, indptr = np.arange(n), np.arange(n + 1)
    alone = sparse.bsr_matrix((own, indices, indptr))
    assert station_factors(alone) is None
    assert station_product(alone, 0) is None


def test_blocks_of_another_size_or_place_are_left_to_petsc() -> None:
    assert station_factors(line(10, size=2)) is None
    far = line(10).tolil()
    far[0, 39] = far[39, 0] = 0.1
    assert station_factors(far.tobsr((4, 4))) is None
    assert station_product(far.tobsr((4, 4)), 0) is None


def test_what_is_not_positive_definite_gives_no_number_and_no_error() -> None:
    matrix = line(5)
    matrix.data[:] = 0.0
    factors, answer = station_factors(matrix), np.zeros(20)
    assert factors is not None
    factors.solve(np.ones(20), answer)
    assert not np.isfinite(answer).all()


@pytest.mark.parametrize(("low", "high"), [(0, 90), (0, 40), (30, 60), (30, 90), (89, 90), (0, 1)])
def test_products_with_part_of_a_line(low: int, high: int) -> None:
    whole = line(90).tocsr()
    read_low, read_high = max(low - 1, 0), min(high + 1, 90)
    rows = whole[4 * low : 4 * high, 4 * read_low : 4 * read_high].tobsr((4, 4))
    product = station_product(rows, low - read_low)
    assert product is not None
    factor, result = RNG.standard_normal(rows.shape[1]), np.zeros(rows.shape[0])
    product.multiply(np.pad(factor, 4), result)
    assert np.abs(result - rows @ factor).max() < ROUND_OFF * np.abs(factor).max() * 100.0


def test_wires_joined_between_stations_are_left_to_other_products() -> None:
    assert station_product(line(10, joined=True), 0) is None


def test_a_product_by_rows_where_stations_do_not_pair() -> None:
    matrix = line(400, size=2)
    # The first and the last row have a neighbour on one side only, so that they take in more.
    product = repeated_rows(matrix)
    assert product is not None
    factor, result = RNG.standard_normal(800), np.zeros(800)
    product.multiply(factor, result)
    assert np.abs(result - matrix @ factor).max() < ROUND_OFF * np.abs(factor).max() * 100.0
    assert repeated_rows(line(20, size=2)) is None
