"""Two passes over the state against prediction, product, solve and correction one by one."""

from __future__ import annotations

import numpy as np
import pytest
from repeating_line import line

from catenary.solver.integrators import state_kernels
from catenary.solver.integrators.line_state import Motion, MotionAhead, Steps
from catenary.solver.integrators.two_pass_step import StationPasses
from catenary.solver.linear.station_factors import station_factors
from catenary.solver.linear.station_products import station_product

RNG = np.random.default_rng(11)
STEPS = Steps(0.1, 0.002, 0.05, 0.3, 0.0025, 0.05, 0.4)
LAWS = RNG.standard_normal((2000, 4))
# Numbers of order one; the order of a sum differs.
ROUND_OFF = 1e-13


@pytest.mark.parametrize("n_own", [1, 2, 3, 7, 40, 513, 5000])
@pytest.mark.parametrize("before", [0, 1, 30])
@pytest.mark.parametrize("after", [0, 2, 25])
def test_passes_take_the_steps_of_their_parts(n_own: int, before: int, after: int) -> None:
    """A rank's own stations with some of its neighbours', which it is told of."""
    n = before + n_own + after
    low, high = before, before + n_own
    product = station_product(line(n), 0)
    factors = station_factors(line(n), low, high)
    assert product is not None and factors is not None
    displacement, velocity = RNG.standard_normal((2, 4 * n_own))
    answer = RNG.standard_normal(4 * n)
    others = np.pad(RNG.standard_normal(4 * n), 4)
    own = slice(4 * low, 4 * high)

    read, force, solution = others.copy(), np.zeros(4 * n), answer.copy()
    expected = displacement.copy(), velocity.copy(), solution[own]
    state_kernels.predict(*expected, read[4:-4][own], *STEPS[:4])
    product.multiply(read, force)
    factors.solve(force, solution)
    state_kernels.correct(*expected, *STEPS[4:])

    # Droppers at every third station, whose ends may be at different ones.
    upper = np.arange(0, n_own, 3)
    lower = np.minimum(upper + RNG.integers(0, 2, upper.size), n_own - 1)
    ends = 4 * np.column_stack([upper, lower]) + [2, 0]
    tension, pulls = np.full((2, upper.size), np.nan)

    read, shown = others.copy(), np.zeros(4 * n_own)
    motion = MotionAhead(read[4:-4][own], np.zeros(4 * n_own), answer[own], shown, STEPS)
    motion.put(displacement, velocity, answer[own].copy())
    passes = StationPasses(product, factors, read, answer, motion, STEPS)
    passes.look_at(ends, LAWS[: len(ends)], tension)
    passes.step()
    found = motion.displacement, motion.velocity, answer[own], tension
    plain = Motion(*expected, (0.0, 0.0)).read
    state_kernels.tension(plain, ends, LAWS, pulls)
    for one, other in zip(found, (*expected, pulls), strict=True):
        assert np.abs(one - other).max(initial=0.0) < ROUND_OFF * np.abs(other).max(initial=1.0)


def test_a_compiled_loop_takes_the_same_steps_with_kernel_and_arguments() -> None:
    product, factors = station_product(line(20), 0), station_factors(line(20))
    assert product is not None and factors is not None
    states = []
    for by_kernel in (False, True):
        start = np.cos(np.arange(80.0))
        read, answer, shown = np.zeros(88), np.zeros(80), np.zeros(80)
        motion = MotionAhead(read[4:-4], np.zeros(80), answer, shown, STEPS)
        motion.put(start, 2.0 * start, 3.0 * start)
        passes = StationPasses(product, factors, read, answer, motion, STEPS)
        for _ in range(3):
            if by_kernel:
                passes.kernel(*passes.arguments)
            else:
                passes.step()
        states.append(motion.displacement.copy())
    assert np.array_equal(*states)
