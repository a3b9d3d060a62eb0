"""Joints and heights that a step cannot keep: each says so, and none goes unnoticed."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.base.errors import NotConverged
from catenary.mbs.rigid.bodies import SPACE, Body
from catenary.mbs.rigid.forces import Gravity
from catenary.mbs.rigid.implicit_steps import Augmented, Partitioned, Stepper
from catenary.mbs.rigid.joints import Revolute
from catenary.mbs.rigid.system import System

# A pendulum of 1 m that is let go from level.
PENDULUM = System(
    (Body("bob", 1.0, (0.1, 0.1, 0.1), (1.0, 0.0, 0.0)),),
    (Revolute("hinge", SPACE, "bob", at_j=(-1.0, 0.0, 0.0), axis_i=(0, 1, 0), axis_j=(0, 1, 0)),),
    (Gravity((1.0,)),),
)


class Lame(Partitioned):
    """Removes a tenth of the errors of joints only: after eight removals 0.9^8 are left."""

    def removal(self, errors: np.ndarray) -> np.ndarray:
        return 0.1 * super().removal(errors)


def swung(solver: Partitioned | Augmented) -> None:
    """One long step, after which the hinge is open by some millimetres until that is removed."""
    stepper = Stepper(PENDULUM, 0.05, solver)
    stepper.begin(PENDULUM.start(), 0.0)
    stepper.step()


def test_the_usual_way_closes_them() -> None:
    swung(Partitioned())
    swung(Augmented())


def test_joints_that_stay_open_are_told() -> None:
    with pytest.raises(NotConverged, match=r"cannot be kept closed at 0\.05 s.*take shorter steps"):
        swung(Lame())


def test_velocities_that_joints_do_not_allow_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Stepper, "_closed", lambda self, motion, time: motion)
    with pytest.raises(NotConverged, match=r"velocities .* at 0\.05 s: they miss by .* shorter"):
        swung(Lame())


def test_a_penalty_that_does_not_close_a_step_is_told() -> None:
    with pytest.raises(NotConverged, match="not converge within a step: choose another penalty"):
        swung(Augmented(penalty=0.1, max_iterations=5))
