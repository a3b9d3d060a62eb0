"""States to continue from: whose unknowns they hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from measuring import History, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary import InputError

PROBLEM = problem_of(en50318_line(4), WHOLE, train=train(70.0, 70.0, 77.0), numerics=numerics(1e-3))
MESH = mesh_of(PROBLEM.line, 2)


def forces_and_states(kept: dict[str, Any] | None = None) -> History:
    march, _ = start_march(PROBLEM, MESH)
    with march:
        if kept is not None:
            march.restore(kept)
        history = History(lambda view: view.checkpoint() if view.step == 50 else None)
        march.run([history])
    return history


@pytest.fixture(scope="module")
def whole() -> History:
    return forces_and_states()


def state_of(whole: History) -> dict[str, Any]:
    return dict(next(state for state in whole.watched if state is not None))


def test_a_state_continues_bit_for_bit(whole: History) -> None:
    rest = forces_and_states(state_of(whole))["contact_force"]
    assert np.array_equal(rest, whole["contact_force"][50:])


def reverse(kept: dict[str, Any]) -> None:
    kept["row_of_node"] = kept["row_of_node"][::-1].copy()


def swap_two(kept: dict[str, Any]) -> None:
    """The contact wire and the messenger wire at one place."""
    rows = kept["row_of_node"].copy()
    first, second = (int(np.flatnonzero(rows == row)[0]) for row in (40, 41))
    rows[[first, second]] = rows[[second, first]]
    kept["row_of_node"] = rows


def shorten(kept: dict[str, Any]) -> None:
    kept["row_of_node"] = kept["row_of_node"][:-1]


def move_far(kept: dict[str, Any]) -> None:
    kept["displacement"] = kept["displacement"] + 1e3


# Damage of a state, of which its checksum may know nothing, and what is told.
OTHERS: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "reversed": (reverse, "row_of_node puts node 0 in row .*, and along this line it is in row"),
    "two nodes": (swap_two, "row_of_node puts node .* in row 41, and along this line it is in row"),
    "short": (shorten, "row_of_node has the shape"),
    "far": (move_far, r"a node is 1000.* m from rest on a line of 2.* m"),
}


@pytest.mark.parametrize("how", OTHERS)
def test_a_state_of_another_line_is_refused(how: str, whole: History) -> None:
    damage, words = OTHERS[how]
    kept = state_of(whole)
    damage(kept)
    with pytest.raises(InputError, match=words):
        forces_and_states(kept)


def test_a_state_that_does_not_tell_its_nodes_is_refused(whole: History) -> None:
    kept = state_of(whole)
    del kept["row_of_node"]
    with pytest.raises(InputError, match="earlier version of Catenary"):
        forces_and_states(kept)
