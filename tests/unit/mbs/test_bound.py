"""Compiled loops bound to their arguments: the same loops, on the arrays as they are by then."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from catenary.solver.base.kernels.bound import bound


def scale(values, factors, by):  # type: ignore[no-untyped-def]
    """Scale values in place; their sum."""
    total = 0.0
    for i in range(values.size):
        values[i] *= factors[0][i] * by
        total += values[i]
    return total


@pytest.mark.parametrize("kernel", [njit(scale), scale], ids=["compiled", "plain"])
def test_arguments_are_kept_by_reference_and_numbers_follow(kernel: object) -> None:
    values, factors = np.array([1.0, 2.0]), np.array([3.0, 5.0])
    scaled = bound(kernel, values, (factors,), later=(0.0,))
    assert scaled(2.0) == 26.0 and np.array_equal(values, [6.0, 20.0])
    values[:], factors[:] = 1.0, 2.0
    # A whole number is converted: nothing is compiled anew, and nothing taken for what it is not.
    assert scaled(3) == scaled.func(values * 0.0 + 1.0, (factors,), 3.0) == 12.0
    assert np.array_equal(values, [6.0, 6.0])


def test_without_an_entry_point_the_dispatcher_is_called() -> None:
    class Newer:
        """A compiled loop of a Numba that has no ``entry_point``."""

        def __init__(self) -> None:
            self.loop, self.overloads = njit(scale), {}

        def compile(self, types: tuple[object, ...]) -> None:
            self.overloads[types] = object()

        def __call__(self, *arguments: object) -> object:
            return self.loop(*arguments)

    values = np.array([1.0, 2.0])
    scaled = bound(Newer(), values, (np.array([3.0, 5.0]),), later=(0.0,))
    assert scaled(2.0) == 26.0 and np.array_equal(values, [6.0, 20.0])


def test_records_and_views_are_what_they_are() -> None:
    """Other strides are another type: a bound loop reads every second number if it was given so."""
    given = np.array([2.0, 4.0, 8.0, 16.0])[::2]
    records = np.zeros(2, dtype=[("x", np.float64), ("n", np.int64)])
    records["x"] = [1.5, 2.5]
    total = bound(njit(lambda rows, some: rows[0].x + rows[1].x + some.sum()), records, given)
    assert total() == 4.0 + 2.0 + 8.0
    records["x"] = 0.0
    assert total() == 10.0
