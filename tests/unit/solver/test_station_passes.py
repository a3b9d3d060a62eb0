"""Two passes over the state against prediction, product, solve and correction one by one."""

from __future__ import annotations

import numpy as np
import pytest
from repeating_line import layout, line, station_factors, station_product, widths_of

from catenary.solver.integrators.line_integrator import StationPasses
from catenary.solver.integrators.line_state import LineState, PredictedLineState, StepFactors
from catenary.solver.kernels import native
from catenary.solver.linear.step_operators import ByStations
from catenary.solver.model.switching_links import RESERVE

RNG = np.random.default_rng(11)
STEPS = StepFactors(0.1, 1.0, 0.0, 0.0, 0.002, 0.0, 0.05, 0.0, 0.3, 0.0025, 0.05, 0.4)
LAWS = np.zeros(2000, dtype=RESERVE)
for name in ("rest", "stiffness", "damping"):
    LAWS[name] = RNG.standard_normal(LAWS.size)
# Numbers of order one; the order of a sum differs.
ROUND_OFF = 1e-13


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
    displacement, velocity = RNG.standard_normal((2, b * n_own))
    answer = RNG.standard_normal(b * n)
    loads = RNG.standard_normal(b * n if loaded else 0)
    others = np.pad(RNG.standard_normal(b * n), b)
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
    lower = np.minimum(upper + RNG.integers(0, 2, upper.size), n_own - 1)
    ends = b * np.column_stack([upper, lower]) + [b // 2, 0]
    tension, pulls = np.full((2, upper.size), np.nan)

    read, shown = others.copy(), np.zeros(b * n_own)
    motion = PredictedLineState(read[b:-b][own], np.zeros(b * n_own), answer[own], shown, STEPS)
    motion.put(displacement, velocity, answer[own].copy())
    passes = StationPasses(ByStations(product, factors, read, read, answer, 0.0), loads, motion)
    links = native.Links(ends, RNG.standard_normal(ends.shape), LAWS[: len(ends)])
    passes.track_links(links, tension)
    passes.native.step()
    found = motion.displacement, motion.velocity, answer[own], tension
    plain = LineState(*expected, (0.0, 0.0, 1.0)).read
    native.reserves(plain, links, pulls)
    for one, other in zip(found, (*expected, pulls), strict=True):
        assert np.abs(one - other).max(initial=0.0) < ROUND_OFF * np.abs(other).max(initial=1.0)
