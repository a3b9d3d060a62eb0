"""Stations of several types: products and solves against dense ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from repeating_line import (
    holding,
    lacking,
    line,
    neighbours,
    sections_of,
    station_factors,
    station_product,
)

from catenary.solver.linear.station_factors import StationFactors
from catenary.solver.linear.station_products import StationProduct, layout_of, with_damping

RNG = np.random.default_rng(3)
ROUND_OFF = 1e-12
N = 60


def some(*names: str) -> list[Any]:
    """Parameters of a test over lines; a third wire stands for all but in whole studies."""
    usual = ("stitch",)
    return [pytest.param(name, marks=() if name in usual else pytest.mark.study) for name in names]


def stretches(*places: tuple[int, int, tuple[int, ...]]) -> np.ndarray:
    """Stations of a line that have some places from one station to another."""
    width = 1 + max(max(own) for _, _, own in places)
    present = np.zeros((N, width), dtype=bool)
    for first, last, own in places:
        present[first:last, list(own)] = True
    return present


FOUR, SIX, EIGHT = tuple(range(4)), tuple(range(6)), tuple(range(8))
# A third wire in some stretches; an overlap after which the first two wires end; lateral unknowns
# of two of three wires; unknowns that do not come in pairs.
LINES = {"stitch": (6,), "overlap": (8,), "lateral": (6, 4), "odd": (5,)}
PRESENT = {
    "stitch": stretches((0, N, FOUR), (0, 5, SIX), (28, 31, SIX), (40, 41, SIX), (55, N, SIX)),
    "overlap": stretches((0, 33, FOUR), (27, N, EIGHT[4:])),
    "lateral": stretches((0, N, (0, 1, 2, 3, 6, 7)), (20, 31, tuple(range(10)))),
    "odd": stretches((0, N, (0, 1, 4)), (10, 22, (0, 1, 2, 3, 4))),
}


def parts(
    name: str, low: int = 0, high: int = N, damped: bool = False, ends: int = 1
) -> tuple[np.ndarray, StationProduct | None, StationFactors | None]:
    """Matrix, product and factors of one of the lines.

    Beyond both ends of a wire ``ends`` stations have its unknowns, too, joined to nothing.
    """
    real = PRESENT[name]
    present = real.copy()
    for step in range(1, ends + 1):
        present[step:] |= real[:-step]
        present[:-step] |= real[step:]
    joined = name == "overlap"
    matrix = holding(line(N, widths=LINES[name], joined=joined), ~real)
    matrix = lacking(matrix, present)
    stations = sections_of(present)
    assert stations.varies
    blocks = neighbours(matrix, 0, stations)
    assert blocks is not None
    layout = layout_of(blocks, blocks, stations.station_types)
    assert layout is not None and layout.widths == LINES[name]
    damping = 0.3 * matrix if damped else None
    product = station_product(
        matrix, 0, with_damping(layout, blocks) if damped else layout, damping, stations
    )
    return matrix.toarray(), product, station_factors(matrix, layout, low, high, stations)


@pytest.mark.parametrize("name", some(*LINES))
def test_products_are_those_of_the_matrix(name: str) -> None:
    width = PRESENT[name].shape[1]
    for damped in (False, True):
        matrix, product, _ = parts(name, damped=damped)
        assert product is not None
        x, v = RNG.standard_normal((2, len(matrix)))
        result = np.zeros(len(matrix))
        product.multiply(np.pad(x, width), result, np.pad(v, width))
        expected = matrix @ (x - 0.3 * v if damped else x)
        assert np.abs(result - expected).max() < ROUND_OFF * np.abs(expected).max()


@pytest.mark.parametrize("name", some(*LINES))
def test_solves_are_those_of_the_matrix(name: str) -> None:
    for low, high in ((0, N), (12, 45), (30, 31), (55, N)):
        matrix, _, factors = parts(name, low, high)
        assert factors is not None
        right, answer = RNG.standard_normal(len(matrix)), np.zeros(len(matrix))
        factors.solve(right, answer)
        expected = np.linalg.solve(matrix, right)
        assert np.abs(answer - expected).max() < ROUND_OFF * np.abs(expected).max()


@pytest.mark.parametrize("name", some("stitch", "lateral", "odd"))
def test_a_wire_may_end_at_its_last_station(name: str) -> None:
    """Blocks between stations are the matrix's own: they join no unknowns that a station lacks."""
    matrix, _, factors = parts(name, ends=0)
    assert factors is not None
    right, answer = RNG.standard_normal(len(matrix)), np.zeros(len(matrix))
    factors.solve(right, answer)
    expected = np.linalg.solve(matrix, right)
    assert np.abs(answer - expected).max() < ROUND_OFF * np.abs(expected).max()


def test_wires_that_meet_without_a_common_station_are_left_to_petsc() -> None:
    """Elimination joins the next station, which lacks unknowns, to all of the last."""
    assert parts("overlap", ends=0)[2] is None


def test_blocks_of_one_station_type_are_kept_once() -> None:
    _, product, factors = parts("stitch")
    assert product is not None and factors is not None
    # The line repeats after seven stations; the wire comes and goes at five places.
    assert np.unique(product.arrays.kinds).size < N == product.arrays.kinds.size
    assert np.unique(factors.arrays.kinds).size <= N
    assert factors.stations.starts[-1] == 4 * N + 2 * (6 + 5 + 3 + 6)
