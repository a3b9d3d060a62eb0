"""Compiled evaluation of joints and forces against each joint's and force's own formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import SPACE, Body, Motion
from catenary.mbs.rigid.forces import (
    Actuator,
    BumpStop,
    Force,
    Gravity,
    PointForce,
    SpringDamper,
    Table,
)
from catenary.mbs.rigid.joints import (
    Fixed,
    Joint,
    PointOnCurve,
    PointOnLine,
    PrescribedAngle,
    PrescribedPoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
    constant,
    tabulated,
)
from catenary.mbs.rigid.kinematics import stacked
from catenary.mbs.rigid.system import System, independent_rows

EPS = np.finfo(float).eps
TIME = 0.7
TABLE = tabulated((0.0, 0.5, 1.0, 1.5), (0.0, 0.3, 0.1, -0.2))
AT_I, AT_J = (0.3, -0.2, 0.5), (-0.4, 0.1, 0.2)
ALONG, ACROSS = (0.2, 1.0, -0.3), (-0.5, 0.4, 1.0)
BODIES = (Body("a", 2.0, (0.1, 0.2, 0.3)), Body("b", 3.0, (0.5, 0.4, 0.3)))
# Joints that are made of products with those that are not between and behind them.
JOINTS: tuple[Joint, ...] = (
    PointOnCurve("curve", "b", (-2.0, 0.0, 1.0, 3.0), (0.0, 1.0, 0.5, 0.2), (0, 1, 0, 2), AT_J),
    Spherical("spherical", "a", "b", AT_I, AT_J),
    Revolute("on space", SPACE, "b", AT_I, AT_J, ALONG, ACROSS),
    PrescribedAngle("angle", "a", "b", TABLE, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
    PrescribedAngle("still", "b", "a", constant(0.4), (0, 1, 0), (1, 0, 0), (0, 0, 1)),
    PointOnLine("line", "a", "b", AT_I, AT_J, ALONG),
    Prismatic("prismatic", "a", "b", AT_I, AT_J, ALONG, ACROSS, (1.0, 0.0, 1.0), (2.0, 1.0, 0.6)),
    RevolutePrismatic("slide", "a", "b", AT_I, AT_J, ALONG, ACROSS, (1.0, 2.0, 0.0)),
    Fixed("fixed", "b", "a", AT_I, AT_J, (0.5, -0.5, 0.5, 0.5)),
    PrescribedPoint("point", "b", TABLE, AT_J, ALONG),
    PrescribedAngle("last", SPACE, "a", TABLE, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
)
ENDS = ("a", "b", AT_I, AT_J)
SOFT = Table((-1.0, 0.0, 0.5, 1.0), (-50.0, 0.0, 80.0, 100.0))
FORCES: tuple[Force, ...] = (
    Gravity((2.0, 3.0)),
    SpringDamper("spring", *ENDS, 300.0, 0.4, 20.0),
    SpringDamper("table", "b", SPACE, AT_J, AT_I, SOFT, 0.2, SOFT),
    Actuator("actuator", *ENDS, 700.0),
    Actuator("growing", SPACE, "a", AT_I, AT_J, lambda time: 100.0 * time),
    BumpStop("stop", *ENDS, 0.1, 0.3, 4000.0, 30.0),
    PointForce("load", "b", (1.0, -2.0, 3.0), AT_J),
)


def some_motion(system: System, seed: int) -> Motion:
    random = np.random.default_rng(seed)
    return system.start().moved(random.normal(size=12)).with_velocities(random.normal(size=12))


@pytest.mark.parametrize("seed", range(4))
def test_rows_of_all_joints_are_what_each_joint_says(seed: int) -> None:
    """The same sums in another order: some ten roundings of numbers below 10."""
    system = System(BODIES, JOINTS)
    motion = some_motion(system, seed)
    found = system.constraints(motion, TIME)
    expected = stacked([joint.rows(motion, TIME) for joint in JOINTS])
    for name, mine, other in zip(found._fields, found, expected, strict=True):
        check(name, mine, other, within=200 * EPS * (1.0 + np.abs(other).max()))


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_what_each_force_says_and_gyroscopic_moments(seed: int) -> None:
    system = System(BODIES, (), FORCES)
    motion = some_motion(system, seed)
    expected = sum((force.generalised(motion, TIME) for force in FORCES), np.zeros(12))
    for i, body in enumerate(BODIES):
        moment = np.cross(motion.spin[i], np.asarray(body.inertia) * motion.spin[i])
        expected[6 * i + 3 : 6 * i + 6] -= moment
    within = 200 * EPS * np.abs(expected).max()
    check("forces", system.generalised_forces(motion, TIME), expected, within=within)


def test_slopes_of_pulls_are_those_of_springs_dampers_and_tables() -> None:
    """Differences over 1e-7 m of forces of 1000 N: eps 1000 / 1e-7 is 2e-6 N/m."""
    system = System(BODIES, (), FORCES)
    length, rate = np.full(5, 0.5), np.full(5, 0.25)
    stiffness, damping = system.lines.slopes(length, rate, TIME)
    # The table has its slope 160 up to 0.5; a stop pushed apart by 0.2 m resists with all it has.
    check("stiffness [N/m]", stiffness, (300.0, 160.0, 0.0, 0.0, 4000.0), within=1e-5)
    check("damping [N s/m]", damping, (20.0, 160.0, 0.0, 0.0, 30.0), within=1e-5)


def test_points_that_coincide_and_unknown_bodies_are_named() -> None:
    system = System(BODIES, (), (SpringDamper("spring", "a", "b"),))
    with pytest.raises(InputError, match="'spring': its two points coincide"):
        system.generalised_forces(system.start(), 0.0)
    wrong = replace(system, joints=(Spherical("ball", "a", "nobody"),))
    with pytest.raises(InputError, match="no body 'nobody'"):
        wrong.constraints(wrong.start(), 0.0)


def test_independent_rows_are_as_many_as_the_rank() -> None:
    random = np.random.default_rng(3)
    full = random.normal(size=(4, 7))
    matrix = np.vstack([full[:2], full[0] - 2 * full[1], full[2:], full.sum(axis=0)])
    assert list(independent_rows(matrix)) == [0, 1, 3, 4]
    assert len(independent_rows(matrix.T)) == np.linalg.matrix_rank(matrix)
