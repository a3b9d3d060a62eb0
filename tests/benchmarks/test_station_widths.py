"""A free step of the line by unknowns a station, beside the floor of a step. Run by ``make bench``.

Stations as many as the case ambrosio2012 has, in blocks that repeat from span to span and are full
at every fifth station, as at droppers. All are measured in turns in one process, and the least of
many short rounds counts, so that ratios hold on a machine that others use, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from floor import LIBRARIES
from mpi4py import MPI
from repeating_line import layout, line, station_factors, station_product
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.integrators.line_integrator import StationPasses, make_line
from catenary.solver.integrators.line_state import PredictedLineState, StepFactors
from catenary.solver.kernels import aligned_arrays
from catenary.solver.linear.step_operators import ByStations
from catenary.solver.model.partition import distribute
from catenary.solver.statics.form_finding import find_form

N_STATIONS, PERIOD = 1126, 45
STEPS = StepFactors(1e-3, 1.0, 0.0, 0.0, 2.5e-7, 0.0, 5e-4, 0.0, 0.003, 2.5e-7, 5e-4, 0.0)
ROUNDS, CALLS = 300, 20
FLOOR = "floor"
# Planes of a station, and what a step took in terms of the floor. On a processor that fetches more
# at a time and computes less it may be 1.4 times that. Kernels that ask what is joined take more
# than twice as long.
TAKEN = {
    (4,): 0.31,
    (6,): 0.76,
    (8,): 1.06,
    (10,): 1.55,
    (12,): 1.86,
    (4, 4): 0.68,
    (6, 4): 1.54,
    (4, 2): 0.77,
}
MOST = {widths: 1.7 * taken for widths, taken in TAKEN.items()}
# Stations of shipped lines, with kernels of their own, and the most that a step takes of them if
# two unknowns more are joined, so that they have none.
SHIPPED, MOST_GENERAL = ((4,), (6,), (4, 4)), 1.3


def passes(widths: tuple[int, ...], full: bool = True, more: bool = False) -> Callable[[], None]:
    """A free step of a line of such stations."""
    matrix = line(N_STATIONS, PERIOD, widths, full=full)
    if more:
        row = np.repeat(np.arange(N_STATIONS), np.diff(matrix.indptr))
        matrix.data[np.ix_(matrix.indices == row, [0, 3], [3, 0])] += [[0.1, 0.0], [0.0, 0.1]]
    lanes = layout(matrix)
    product, factors = station_product(matrix, 0, lanes), station_factors(matrix, lanes)
    assert product is not None and factors is not None and lanes.widths == widths
    n, b = matrix.shape[0], lanes.pitch
    read = aligned_arrays.zeros(n + 2 * b, 0)
    answer, velocity = aligned_arrays.zeros(n, 1), aligned_arrays.zeros(n, 2)
    motion = PredictedLineState(read[b:-b], velocity, answer, np.zeros(n), STEPS)
    motion.put(*np.full((3, n), 1e-3))
    return StationPasses(
        ByStations(product, factors, read, read, answer, 0.0), np.zeros(0), motion
    ).native.step


@pytest.fixture(scope="module")
def times() -> dict[str, float]:
    """Least time of each [us]; that of the floor is a library's solve and a product with K."""
    scene = load_scene("ambrosio2012", [])
    problem = problem_of(scene)
    model, _ = find_form(problem, mesh_of(scene))
    whole = make_line(MPI.COMM_SELF, model, distribute(model, 1, 0), problem.numerics)
    calls: dict[str, Callable] = {name: make(whole, model) for name, make in LIBRARIES.items()}
    calls["product"] = whole.internal_forces
    calls |= {str(widths): passes(widths) for widths in MOST}
    for widths in SHIPPED:
        calls[f"{widths}, compiled"] = passes(widths, full=False)
        calls[f"{widths}, general"] = passes(widths, full=False, more=True)
    least = dict.fromkeys(calls, np.inf)
    for _ in range(ROUNDS):
        for name, call in calls.items():
            begin = time.perf_counter()
            for _ in range(CALLS):
                call()
            least[name] = min(least[name], 1e6 * (time.perf_counter() - begin) / CALLS)
    whole.destroy()
    least[FLOOR] = min(least[name] for name in LIBRARIES) + least["product"]
    print(f"\nfree step of {N_STATIONS} stations\n{'':44}{'us':>8}{'x floor':>9}{'at most':>9}")
    for name, value in least.items():
        bound = {str(widths): most for widths, most in MOST.items()}.get(name)
        at_most = "" if bound is None else f"{bound:9.2f}"
        print(f"{name:44}{value:8.1f}{value / least[FLOOR]:9.2f}{at_most}")
    return least


@pytest.mark.parametrize("widths", MOST, ids=str)
def test_a_step_of_wider_stations_keeps_to_what_is_possible(
    times: dict[str, float], widths: tuple[int, ...]
) -> None:
    assert times[str(widths)] < MOST[widths] * times[FLOOR]


@pytest.mark.parametrize("widths", SHIPPED, ids=str)
def test_a_line_without_kernels_of_its_own_takes_half_as_long_again(
    times: dict[str, float], widths: tuple[int, ...]
) -> None:
    assert times[f"{widths}, general"] < MOST_GENERAL * times[f"{widths}, compiled"]
