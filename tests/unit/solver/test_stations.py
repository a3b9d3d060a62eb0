"""Products, solves and passes by stations, of one type and of several, against SciPy."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from repeating_line import (
    holding,
    lacking,
    layout,
    line,
    neighbours,
    sections_of,
    station_factors,
    station_product,
    widths_of,
)
from scipy import sparse
from scipy.sparse.linalg import spsolve

from catenary.solver.integrators.line_integrator import StationPasses
from catenary.solver.integrators.line_state import LineState, PredictedLineState, StepFactors
from catenary.solver.kernels import native
from catenary.solver.linear.station_factors import StationFactors
from catenary.solver.linear.station_products import (
    MOST_UNKNOWNS,
    Layout,
    StationProduct,
    layout_of,
    of_pairs,
    with_damping,
)
from catenary.solver.linear.step_operators import ByStations
from catenary.solver.model.switching_links import RESERVE

# --- products and solves that store each kind of row or station once, against SciPy ---------------


RNG = np.random.default_rng(7)
# Sums of a dozen products of numbers of order one; solves lose a few digits to the condition, 1e2.
ROUND_OFF = 1e-14
WIDTHS = [
    (2,),
    (3,),
    (4,),
    (6,),
    (8,),
    (10,),
    (12,),
    (16,),
    (4, 4),
    (4, 2),
    (6, 4),
    (4, 4, 4),
    (12, 2),
]
LENGTHS = [1, 2, 3, 4, 5, 40, 301]


@pytest.mark.parametrize("n_stations", LENGTHS)
def test_factors_solve_lines_of_any_length(n_stations: int) -> None:
    compare_factors(n_stations, 0, n_stations)


@pytest.mark.parametrize("n_own", LENGTHS)
@pytest.mark.parametrize("ends", [(1, 0), (0, 1), (3, 12), (20, 9)])
def test_factors_solve_parts_of_lines(n_own: int, ends: tuple[int, int]) -> None:
    compare_factors(ends[0] + n_own + ends[1], ends[0], ends[0] + n_own)


@pytest.mark.parametrize("joined", [False, True])
@pytest.mark.parametrize("widths", widths_of(*WIDTHS))
def test_factors_and_products_of_any_width(widths: tuple[int, ...], joined: bool) -> None:
    compare_factors(40, 5, 33, widths, joined)
    matrix = line(40, widths=widths, joined=joined)
    lanes = layout(matrix)
    assert lanes.widths == widths
    assert (lanes.beside <= of_pairs(lanes.pitch)).all() == (not joined or max(widths) == 2)
    compare_product(matrix, 0, lanes)


@pytest.mark.parametrize("widths", widths_of((2,), (3,), (4,), (4, 4), (6,), (8,), (10,), (6, 4)))
@pytest.mark.parametrize("n_stations", [2, 3, 40])
@pytest.mark.parametrize("joined", [False, True])
def test_factors_keep_what_is_read_soonest(
    widths: tuple[int, ...], n_stations: int, joined: bool
) -> None:
    matrix = line(n_stations, widths=widths, joined=joined)
    found = station_factors(matrix, layout(matrix))
    assert found is not None
    # Wide stations, joined wire by wire between each other, are multiplied with the matrix's own
    # blocks: of eight unknowns 12 and 4 products in place of 16.
    is_wide = widths in ((8,), (10,), (6, 4))
    assert found.layout.native.is_sparse == (is_wide and not joined)
    # Blocks between stations repeat with the line, those after elimination more slowly.
    assert np.unique(found.arrays.beside_kinds).size <= min(n_stations, 10)
    assert found.arrays.kinds.size == n_stations
    compare_factors(n_stations, 0, n_stations, widths, joined)


@pytest.mark.parametrize("widths", widths_of((6,), (10,)))
def test_factors_of_wires_that_only_stations_join_keep_blocks_by_wires(
    widths: tuple[int, ...],
) -> None:
    # As unknowns stand in a cross-section: heights and slopes of both wires, then those along the
    # track, then those across.
    wire = np.array([0, 0, 1, 1, 0, 1, 0, 0, 1, 1])[: widths[0]]
    matrix = line(40, widths=widths, joined=True, wire=wire)
    found = station_factors(matrix, layout(matrix))
    assert found is not None
    together = (wire[:, None] == wire) | of_pairs(wire.size)
    assert np.array_equal(found.layout.beside, together)
    assert found.layout.packed(together, "beside").size < found.layout.packed(together, "own").size
    compare_factors(40, 0, 40, widths, wire=wire)


PLANES = [(1,), (2,), (5,), (6,), (8,), (9,), (4, 2), (6, 4), (9, 12), (3, 8, 4), (32,)]


@pytest.mark.parametrize("widths", PLANES)
def test_packed_blocks_hold_each_number_once(widths: tuple[int, ...]) -> None:
    lanes, block = Layout(widths), block_of(widths)
    assert np.array_equal(unpacked(lanes, block, "own"), block)
    # Vectors of four begin where a line of a cache may not end.
    assert lanes.packed(block, "own").size % (2 if lanes.pitch <= 2 else 4) == 0


@pytest.mark.parametrize("widths", PLANES)
def test_half_of_a_symmetric_block_holds_all_of_it(widths: tuple[int, ...]) -> None:
    lanes, block = Layout(widths, factors=True), block_of(widths)
    block += block.T
    half = unpacked(lanes, block, "half")
    assert np.array_equal(np.where(half != 0, half, half.T), block)
    sizes = [lanes.packed(block, which).size for which in ("half", "own")]
    assert sizes[0] < sizes[1] if max(widths) > 4 else sizes[0] <= sizes[1]


def test_kernels_of_a_line_serve_those_that_join_little_less() -> None:
    apart = np.bitwise_xor.outer(np.arange(6), np.arange(6))

    def products(*differences: int) -> int:
        return Layout((6,), np.isin(apart, differences), of_pairs(6)).native.n_products

    # Of a compound line's three wires the third may hang on nothing; bare ones have kernels of
    # their own.
    assert products(0, 1, 2) == products(0, 1, 2, 6) > products(0, 1)


def block_of(widths: tuple[int, ...]) -> np.ndarray:
    """A block that joins all of each plane."""
    planes = np.repeat(np.arange(len(widths)), widths)
    return RNG.standard_normal((planes.size, planes.size)) * (planes[:, None] == planes)


def unpacked(lanes: Layout, block: np.ndarray, which: Literal["own", "half"]) -> np.ndarray:
    """A block by its packed numbers, the sum of those in one place."""
    (row, column), numbers = lanes.native.places(which), lanes.packed(block, which)
    result, there = np.zeros(block.shape), row >= 0
    np.add.at(result, (row[there], column[there]), numbers[there])
    return result


def compare_factors(
    n_stations: int,
    low: int,
    high: int,
    widths: tuple[int, ...] = (4,),
    joined: bool = True,
    wire: np.ndarray | None = None,
) -> None:
    matrix = line(n_stations, widths=widths, joined=joined, wire=wire)
    factors = station_factors(matrix, layout(matrix), low, high)
    assert factors is not None
    right, answer = RNG.standard_normal(matrix.shape[0]), np.zeros(matrix.shape[0])
    factors.solve(right, answer)
    expected = spsolve(matrix.tocsc(), right)
    assert np.abs(answer - expected).max() < ROUND_OFF * np.abs(expected).max()


def compare_product(matrix: sparse.bsr_matrix, first: int, lanes: Layout) -> None:
    product = station_product(matrix, first, lanes)
    assert product is not None
    factor, result = RNG.standard_normal(matrix.shape[1]), np.zeros(matrix.shape[0])
    product.multiply(np.pad(factor, lanes.pitch), result)
    assert np.abs(result - matrix @ factor).max() < ROUND_OFF * np.abs(factor).max() * 1e3


def test_factors_of_a_long_line_are_of_as_many_kinds_as_those_of_a_short_one() -> None:
    short, long = (station_factors(line(n), layout(line(n))) for n in (150, 1500))
    assert short is not None and long is not None
    # The two lines differ; both forget their ends within some ten stations.
    n_short, n_long = (np.unique(own.arrays.kinds).size for own in (short, long))
    assert abs(n_long - n_short) < 30
    assert long.arrays.kinds.size == 1500 and n_long < 150


def test_a_line_of_which_no_two_stations_are_alike_keeps_them_in_their_order() -> None:
    n = 5000
    own = np.einsum("i,jk->ijk", 10.0 + np.arange(n), np.eye(4))
    alone = sparse.bsr_matrix((own, np.arange(n), np.arange(n + 1)))
    lanes = layout(alone)
    product, factors = station_product(alone, 0, lanes), station_factors(alone, lanes)
    assert product is not None and factors is not None
    for kinds in (product.arrays.kinds, factors.arrays.kinds):
        assert np.array_equal(kinds, kinds[1] * np.arange(n))
    compare_product(alone, 0, lanes)


def test_what_joins_stations_further_apart_is_left_to_petsc() -> None:
    far = line(10).tolil()
    far[0, 39] = far[39, 0] = 0.1
    assert station_factors(far.tobsr((4, 4)), layout(line(10))) is None
    assert station_product(far.tobsr((4, 4)), 0, layout(line(10))) is None


def test_planes_are_what_no_matrix_joins() -> None:
    apart = neighbours(line(10, widths=(4, 2)))
    assert apart is not None
    assert layout_of(apart, apart).widths == (4, 2)
    for place in ((1, 3, 5, 1), (0, 3, 1, 5)):
        joined = apart.copy()
        joined[place] = 0.1
        assert layout_of(joined, apart).widths == layout_of(apart, joined).widths == (6,)
    assert layout_of(*[np.ones((3, 2, MOST_UNKNOWNS + 1, MOST_UNKNOWNS + 1))] * 2) is None


def test_what_is_not_positive_definite_gives_no_number_and_no_error() -> None:
    matrix = line(5)
    matrix.data[:] = 0.0
    factors, answer = station_factors(matrix, Layout((4,))), np.zeros(20)
    assert factors is not None
    factors.solve(np.ones(20), answer)
    assert not np.isfinite(answer).all()


@pytest.mark.parametrize(("low", "high"), [(0, 90), (0, 40), (30, 60), (30, 90), (89, 90), (0, 1)])
def test_products_with_part_of_a_line(low: int, high: int) -> None:
    whole = line(90).tocsr()
    read_low, read_high = max(low - 1, 0), min(high + 1, 90)
    rows = whole[4 * low : 4 * high, 4 * read_low : 4 * read_high].tobsr((4, 4))
    compare_product(rows, low - read_low, layout(line(90)))


def test_a_product_that_joins_more_than_its_layout_is_refused() -> None:
    assert station_product(line(10, joined=True), 0, layout(line(10))) is None
    assert station_product(line(10), 0, Layout((2, 2))) is None


# --- stations of several types --------------------------------------------------------------------


VARYING_RNG = np.random.default_rng(3)
VARYING_ROUND_OFF = 1e-12
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
        x, v = VARYING_RNG.standard_normal((2, len(matrix)))
        result = np.zeros(len(matrix))
        product.multiply(np.pad(x, width), result, np.pad(v, width))
        expected = matrix @ (x - 0.3 * v if damped else x)
        assert np.abs(result - expected).max() < VARYING_ROUND_OFF * np.abs(expected).max()


@pytest.mark.parametrize("name", some(*LINES))
def test_solves_are_those_of_the_matrix(name: str) -> None:
    for low, high in ((0, N), (12, 45), (30, 31), (55, N)):
        matrix, _, factors = parts(name, low, high)
        assert factors is not None
        right, answer = VARYING_RNG.standard_normal(len(matrix)), np.zeros(len(matrix))
        factors.solve(right, answer)
        expected = np.linalg.solve(matrix, right)
        assert np.abs(answer - expected).max() < VARYING_ROUND_OFF * np.abs(expected).max()


@pytest.mark.parametrize("name", some("stitch", "lateral", "odd"))
def test_a_wire_may_end_at_its_last_station(name: str) -> None:
    """Blocks between stations are the matrix's own: they join no unknowns that a station lacks."""
    matrix, _, factors = parts(name, ends=0)
    assert factors is not None
    right, answer = VARYING_RNG.standard_normal(len(matrix)), np.zeros(len(matrix))
    factors.solve(right, answer)
    expected = np.linalg.solve(matrix, right)
    assert np.abs(answer - expected).max() < VARYING_ROUND_OFF * np.abs(expected).max()


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


# --- two passes over the state against prediction, product, solve and correction one by one -------


PASSES_RNG = np.random.default_rng(11)
STEPS = StepFactors(0.1, 1.0, 0.0, 0.0, 0.002, 0.0, 0.05, 0.0, 0.3, 0.0025, 0.05, 0.4)
LAWS = np.zeros(2000, dtype=RESERVE)
for name in ("rest", "stiffness", "damping"):
    LAWS[name] = PASSES_RNG.standard_normal(LAWS.size)
# Numbers of order one; the order of a sum differs.
PASSES_ROUND_OFF = 1e-13


@pytest.mark.parametrize("n_own", [1, 2, 3, 7, 40, 513, 5000])
@pytest.mark.parametrize("before", [0, 1, 30])
@pytest.mark.parametrize("after", [0, 2, 25])
def test_passes_take_the_steps_of_their_parts(n_own: int, before: int, after: int) -> None:
    compare(n_own, before, after)


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("widths", widths_of((2,), (6,), (8,), (10,), (12,), (16,), (4, 4), (6, 4)))
def test_passes_over_stations_of_any_width(widths: tuple[int, ...], loaded: bool) -> None:
    compare(90, 4, 7, widths, loaded)


def compare(
    n_own: int, before: int, after: int, widths: tuple[int, ...] = (4,), loaded: bool = False
) -> None:
    """A rank's own stations with some of its neighbours', which it is told of."""
    n, b = before + n_own + after, sum(widths)
    low, high = before, before + n_own
    matrix = line(n, widths=widths)
    product = station_product(matrix, 0, layout(matrix))
    factors = station_factors(matrix, layout(matrix), low, high)
    assert product is not None and factors is not None
    displacement, velocity = PASSES_RNG.standard_normal((2, b * n_own))
    answer = PASSES_RNG.standard_normal(b * n)
    loads = PASSES_RNG.standard_normal(b * n if loaded else 0)
    others = np.pad(PASSES_RNG.standard_normal(b * n), b)
    own = slice(b * low, b * high)

    read, force, solution = others.copy(), np.zeros(b * n), answer.copy()
    expected = displacement.copy(), velocity.copy(), solution[own]
    native.predict(*expected, np.zeros(0), read[b:-b][own], STEPS)
    product.multiply(read, force)
    if loaded:
        force += loads
    factors.solve(force, solution)
    native.correct(*expected, *STEPS[9:])

    # Links at every third station, whose ends may be at different ones.
    upper = np.arange(0, n_own, 3)
    lower = np.minimum(upper + PASSES_RNG.integers(0, 2, upper.size), n_own - 1)
    ends = b * np.column_stack([upper, lower]) + [b // 2, 0]
    tension, pulls = np.full((2, upper.size), np.nan)

    read, shown = others.copy(), np.zeros(b * n_own)
    motion = PredictedLineState(read[b:-b][own], np.zeros(b * n_own), answer[own], shown, STEPS)
    motion.put(displacement, velocity, answer[own].copy())
    passes = StationPasses(ByStations(product, factors, read, read, answer, 0.0), loads, motion)
    links = native.Links(ends, PASSES_RNG.standard_normal(ends.shape), LAWS[: len(ends)])
    passes.track_links(links, tension)
    passes.native.step()
    found = motion.displacement, motion.velocity, answer[own], tension
    plain = LineState(*expected, (0.0, 0.0, 1.0)).read
    native.reserves(plain, links, pulls)
    for one, other in zip(found, (*expected, pulls), strict=True):
        assert np.abs(one - other).max(initial=0.0) < PASSES_ROUND_OFF * np.abs(other).max(
            initial=1.0
        )
