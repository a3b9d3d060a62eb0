"""Turns by which the rest of a line that goes on is found: to round-off, whatever that is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catenary import InputError
from catenary.solver.statics.repeated_ends import OF_REST, settled

REST = np.array([7.5, -0.3])


def turns(
    noise: float, factor: float = 0.01
) -> tuple[Callable[[np.ndarray], np.ndarray], list[float]]:
    """Turns that come nearer to ``REST`` by a factor, with a round-off that changes its sign."""
    distances: list[float] = []

    def turn(values: np.ndarray) -> np.ndarray:
        distances.append(float(np.abs(values - REST).max()))
        return REST + factor * (values - REST) + noise * (-1.0) ** len(distances)

    return turn, distances


@pytest.mark.parametrize("noise", [0.0, 2e-13, 1e-12])
def test_values_settle_to_the_round_off_of_their_rest(noise: float) -> None:
    turn, distances = turns(noise)
    # Twice the round-off, and that of 7.5 m in double precision.
    assert np.abs(settled(turn, np.zeros(2)) - REST).max() <= 2.0 * noise + 2e-15
    assert len(distances) < 15


@pytest.mark.parametrize(("noise", "factor"), [(1e-9, 0.01), (0.0, 0.9), (0.0, -1.1)])
def test_values_that_do_not_settle_are_refused(noise: float, factor: float) -> None:
    with pytest.raises(
        InputError, match="does not settle where line.ends says that it is periodic"
    ):
        settled(turns(noise, factor)[0], np.zeros(2))


def test_a_rest_is_as_exact_where_ends_move_by_metres() -> None:
    """Newton's method finds it to 1e-9 m there, too; turns change by twice the noise."""
    with pytest.raises(InputError, match="moves by 1.2e-05 mm"):
        settled(turns(6e-9)[0], np.zeros(2), OF_REST)
    assert np.abs(settled(turns(4e-9)[0], np.zeros(2), OF_REST) - REST).max() < 1e-8
