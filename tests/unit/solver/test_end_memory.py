"""Sums over the past of a line's ends: quick ones against plain ones."""

from __future__ import annotations

import numpy as np
import pytest

from catenary import InputError
from catenary.solver.integrators.line_loads import NEAR, LineLoads
from catenary.solver.integrators.line_state import LineState
from catenary.solver.linear.line_products import Subdomain
from catenary.solver.model.loads import MemoryLoad, ShapeLoad

DT = 1e-3
NOBODY = np.zeros(0, dtype=np.int64)


def loads_of(n: int, rng: np.random.Generator) -> tuple[list[MemoryLoad], list[np.ndarray]]:
    """Two ends of different sizes, and their numbers (n + 1, m, m)."""
    loads, all_numbers = [], []
    for first, m in ((0, 4), (9, 3)):
        numbers = rng.normal(size=(n + 1, m, m))
        numbers[0] = 0.0
        all_numbers.append(numbers)
        loads.append(
            MemoryLoad(np.arange(first, first + m), DT, n, lambda k, numbers=numbers: numbers[:k])
        )
    return loads, all_numbers


@pytest.mark.parametrize(
    "n", [3, NEAR - 1, NEAR, NEAR + 1, pytest.param(5 * NEAR + 7, marks=pytest.mark.study)]
)
def test_sums_are_those_over_all_the_past(n: int) -> None:
    rng = np.random.default_rng(n)
    memory, numbers = loads_of(n, rng)
    domain = Subdomain(0, 12, 0, 12, 0, 12)
    loads = LineLoads([*memory, ShapeLoad(np.array([0, 5]), np.array([2.0, 3.0]))], domain, NOBODY)
    motion = LineState(*np.zeros((3, 12)), (1.0, 1.0, 1.0))
    loads.read(motion)
    past = rng.normal(size=(n + 1, 12))
    largest = 0.0
    for step in range(n + 1):
        if step:
            motion.acceleration[:] = past[step - 1]
        loads.at(step * DT)
        motion.acceleration[:] = np.nan  # remembered once, also where a step is repeated
        loads.at(step * DT)
        expected = np.zeros(12)
        expected[[0, 5]] = 2.0, 3.0
        for load, own in zip(memory, numbers, strict=True):
            for j in range(1, step + 1):
                expected[load.unknowns] -= own[j] @ past[step - j, load.unknowns]
        largest = max(largest, float(np.abs(loads.values - expected).max()))
    # Sums of n numbers of order one.
    assert largest < 1e-13 * (n + 10)


def test_a_past_is_recalled_to_the_last_bit() -> None:
    n, at = 3 * NEAR, 2 * NEAR + 5
    rng = np.random.default_rng(3)
    memory, _ = loads_of(n, rng)
    domain, past = Subdomain(0, 12, 0, 12, 0, 12), rng.normal(size=(n + 1, 12))
    found: list[np.ndarray] = []
    kept = np.zeros(0)
    for restored in (False, True):
        loads = LineLoads(memory, domain, NOBODY)
        motion = LineState(*np.zeros((3, 12)), (1.0, 1.0, 1.0))
        loads.read(motion)
        memories = loads.memories
        assert memories is not None
        if restored:
            memories.recall(kept, at)
        for step in range(at + 1 if restored else 0, n + 1):
            motion.acceleration[:] = past[step - 1]
            loads.at(step * DT)
            if step == at:
                kept = memories.past()
        found.append(loads.values.copy())
    np.testing.assert_array_equal(found[0], found[1])
    with pytest.raises(InputError, match="the past of the line's ends"):
        memories.recall(kept[:-1], at)
