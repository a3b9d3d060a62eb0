"""A pan head next to an anchor: what holds the wire does not give way."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import History, check, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_an_anchor_stays_under_a_head_in_the_last_element(scheme: str) -> None:
    """The element is 5 m / 3 long and ends at 120 m, the run 0.05 m before that.

    A force on it is shared out to both its ends; the share of the one that is held moves nothing.
    """
    problem = problem_of(
        en50318_line(2),
        WHOLE,
        train=train(30.0, 117.0, 119.95, raise_time=0.0),
        numerics=numerics(1e-3, scheme),
    )
    run, model = start_march(problem, mesh_of(en50318_line(2), 3))
    history = History(lambda view: view.checkpoint())
    with run:
        outcome = run.run([history])
    assert outcome.outcome == "done"
    held = model.constrained
    for name in ("displacement", "velocity", "acceleration"):
        moved = np.array([state[name][held] for state in history.watched])
        check(f"{name} of what is held", moved, 0.0, within=1e-300)
    pressed = history["contact_force"][history["contact_position"] > 120 - 5 / 3]
    print(f"contact force in the last element up to {pressed.max():.0f} N")
    assert pressed.max() > 50.0
