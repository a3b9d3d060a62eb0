"""Heads that start below a sloping wire: with it, if contact is kinematic, else at rest."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check, march
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train

from catenary.mbs.lumped import LumpedData
from catenary.solver.problem.contact_laws import ContactLaw, KinematicLaw, LinearLaw

STATIC, SPEED = 150.0, 320.0 / 3.6
# The reference pantograph of the simple AC line.
THREE = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
# Between the third and the fourth dropper of a span, where the pre-sag's slope is 41 - 24 mm on
# 5.75 m or so, 0.26 m/s; in the middle of the span there is none.
BETWEEN, MIDDLE = 2 * 55.0 + 13.1, 2 * 55.0 + 27.5


def start(law: ContactLaw, at: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, heights of wire and head and forces of the first 50 ms."""
    line = ac_simple_line(6)
    problem = problem_of(
        line,
        WHOLE - {"contact_loss"},
        contact=law,
        train=train(SPEED, at, at + 0.05 * SPEED, data=THREE, static_force=STATIC, raise_time=0.2),
        numerics=numerics(1e-3, beta=0.28, gamma=0.55),
    )
    history = march(problem, mesh_of(line, 6))
    return np.array(history.time), history["head_height"][:, 0], history["contact_force"][:, 0]


@pytest.mark.parametrize("at", [BETWEEN, MIDDLE])
def test_kinematic_contact_does_not_jolt_the_head_at_the_start(at: float) -> None:
    """While raised from zero, forces stay of the order of the static one.

    A head at rest would be brought to the wire's V w' = 0.26 m/s within a step of 1 ms: 7.5 kg of
    it, with the line's half of that, pushed by more than 200 N.
    """
    _, _, force = start(KinematicLaw(), at)
    print(f"forces from {force.min():.1f} to {force.max():.1f} N")
    assert np.abs(force[:20]).max() < 0.5 * STATIC
    assert np.abs(force[1:]).max() > 0.0


def test_head_moves_with_the_wire_from_the_first_step_on() -> None:
    """Its speed is V dw/dx of the wire at rest, with what V^2 w'' and forces change in 1 ms.

    w'' below 55 mm 8 / (46 m)^2 = 2e-4 1/m in the mean, a few times that below a dropper: 10 m/s^2
    in the worst case, 0.01 m/s.
    """
    time, head, _ = start(KinematicLaw(), BETWEEN)
    slope = (0.041 - 0.024) / 5.75
    speed = (head[1] - head[0]) / time[1]
    # The pre-sag is that at droppers; between them the wire sags by its own weight besides.
    assert abs(speed) > 0.5 * SPEED * slope
    check("speed [m/s]", (head[2] - head[1]) / time[1], speed, within=0.02)


def test_with_a_penalty_law_heads_start_at_rest_as_ever() -> None:
    """A step after the start the head has moved by its static force's beginning only."""
    time, head, _ = start(LinearLaw(5e4, 0.0), BETWEEN)
    # 5e4 N/m on a depth of 0.26 mm, 13 N, on 7.5 kg for 1 ms: 1 um.
    check("head [m]", head[1], head[0], within=2e-6)
