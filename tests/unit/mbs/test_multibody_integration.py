"""What constraint methods and the integrator refuse; which coordinates are dependent."""

from __future__ import annotations

import numpy as np
import pytest
from constraint_handling import (
    AugmentedLagrangian,
    Baumgarte,
    CoordinatePartitioning,
)
from measuring import check
from variable_steps import integrate

from catenary import InputError, RunBroken
from catenary.mbs.rigid.bodies import SPACE, Body
from catenary.mbs.rigid.forces import Gravity
from catenary.mbs.rigid.joints import Prismatic, Revolute
from catenary.mbs.rigid.system import System

BODY = Body("slider", 1.0, (1.0, 1.0, 1.0))
RAIL = System((BODY,), (Prismatic("rail", SPACE, "slider"),))


def test_constants_that_cannot_be_are_refused() -> None:
    with pytest.raises(InputError, match="must not be negative"):
        Baumgarte(-1.0, 2.0)
    with pytest.raises(InputError, match="penalty 0.0 must be positive"):
        AugmentedLagrangian(penalty=0.0)
    with pytest.raises(InputError, match="Times of an integration must grow"):
        integrate(RAIL, Baumgarte(), RAIL.start(), [0.0, 0.0])


def test_dependent_coordinates_are_those_that_the_joint_takes() -> None:
    method = CoordinatePartitioning()
    method.begin(RAIL, RAIL.start(), 0.0)
    assert list(method.dependent) == [1, 2, 3, 4, 5]


def test_correction_changes_dependent_coordinates_only() -> None:
    method = CoordinatePartitioning()
    method.begin(RAIL, RAIL.start(), 0.0)
    off = RAIL.start().moved(np.array([0.3, 0.01, -0.02, 0.03, 0.0, 0.01]))
    off = off.with_velocities(np.array([2.0, 0.1, 0.1, 0.1, 0.1, 0.1]))
    corrected, rows = method.correct(RAIL, off, 0.0)
    check("position [m]", corrected.position[0], (0.3, 0.0, 0.0), within=1e-12)
    check("velocities", corrected.velocities, (2.0, 0, 0, 0, 0, 0), within=1e-12)
    check("rows", rows.value, 0.0, within=1e-12)


def test_a_penalty_too_small_to_converge_is_named() -> None:
    system = System((BODY,), RAIL.joints, (Gravity((1.0,)),))
    weak = AugmentedLagrangian(penalty=0.1, max_iterations=5)
    with pytest.raises(RunBroken, match="another penalty than 0.1"):
        weak.rates(system, system.start(), 0.0)


def test_partition_that_has_become_useless_is_named() -> None:
    """A long pendulum's height is chosen as independent, and then put out of its reach."""
    system = System((BODY,), (Revolute("hinge", SPACE, "slider", at_j=(-2, 0, 0)),))
    method = CoordinatePartitioning()
    start = system.start().moved(np.array([2.0, 0, 0, 0, 0, 0]))
    method.begin(system, start, 0.0)
    assert list(method.dependent) == [0, 1, 3, 4, 5]
    with pytest.raises(RunBroken, match="shorter intervals"):
        method.correct(system, start.moved(np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0])), 0.0)
