"""Kernels for any processor against those for the best one that this is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from repeating_line import layout, line, station_factors, station_product

from catenary.solver.integrators.line_integrator import StationPasses
from catenary.solver.integrators.line_state import PredictedLineState, StepFactors
from catenary.solver.kernels import native
from catenary.solver.linear.step_operators import ByStations

STEPS = StepFactors(0.1, 1.0, 0.0, 0.0, 0.002, 0.0, 0.05, 0.0, 0.3, 0.0025, 0.05, 0.4)
# Numbers of order one; the order of a sum differs.
ROUND_OFF = 1e-13


@pytest.fixture(autouse=True)
def best_again() -> Iterator[None]:
    """What is made after a test has the kernels of the best processor again."""
    yield
    assert native.set_target(native.targets()[-1])


def test_other_processors_are_refused() -> None:
    assert native.targets()
    assert not native.set_target("abacus")


@pytest.mark.parametrize("widths", [(4,), (6,), (4, 4), (10,)])
def test_kernels_of_all_processors_agree(widths: tuple[int, ...]) -> None:
    best, *others = reversed(native.targets())
    expected = answers(best, widths)
    for target in others:
        for one, other in zip(answers(target, widths), expected, strict=True):
            assert np.abs(one - other).max() < ROUND_OFF * np.abs(other).max(initial=1.0)


def answers(target: str, widths: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """A product, a solve, and displacement and velocity after two steps, by kernels of a target."""
    assert native.set_target(target)
    n, b = 41, sum(widths)
    rng = np.random.default_rng(5)
    matrix = line(n, widths=widths)
    own = layout(matrix)
    product, factors = station_product(matrix, 0, own), station_factors(matrix, own)
    assert product is not None and factors is not None
    read = np.pad(rng.standard_normal(b * n), b)
    force, solution = np.zeros(b * n), np.zeros(b * n)
    product.multiply(read, force)
    factors.solve(force, solution)

    state, ahead = rng.standard_normal((3, b * n)), np.zeros(b * n + 2 * b)
    answer, shown = np.zeros(b * n), np.zeros(b * n)
    motion = PredictedLineState(ahead[b:-b], np.zeros(b * n), answer, shown, STEPS)
    motion.put(*state)
    parts = ByStations(product, factors, ahead, ahead, answer, 0.0)
    passes = StationPasses(parts, rng.standard_normal(b * n), motion)
    for _ in range(2):
        passes.native.step()
    return force, solution, motion.displacement.copy(), motion.velocity
