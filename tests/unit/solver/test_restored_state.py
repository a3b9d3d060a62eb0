"""States to continue from: whose unknowns they hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from measuring import History, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.solver.base.errors import InputError

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


def test_a_state_whose_nodes_stand_in_another_order_continues_bit_for_bit() -> None:
    whole = forces_and_states()
    kept = next(state for state in whole.watched if state is not None)
    rows = kept["row_of_node"]
    order = np.random.default_rng(3).permutation(rows.size)
    # The node in row i then stood in row order[i].
    for name in ("displacement", "velocity", "acceleration", "ahead", "velocity_ahead"):
        before = kept[name].reshape(rows.size, -1)
        moved = np.empty_like(before)
        moved[order] = before
        kept[name] = moved.ravel()
    kept["row_of_node"] = order[rows]
    rest = forces_and_states(kept)["contact_force"]
    assert np.array_equal(rest, whole["contact_force"][50:])


def test_a_state_that_does_not_tell_its_nodes_is_refused() -> None:
    kept = next(state for state in forces_and_states().watched if state is not None)
    del kept["row_of_node"]
    with pytest.raises(InputError, match="earlier version of Catenary"):
        forces_and_states(kept)
