"""Compiled evaluation of joints and forces against their definitions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_mechanics import generalised, tabulated
from driven_angle import DrivenAngle
from measuring import check
from scipy.interpolate import CubicSpline

from catenary import InputError
from catenary.mbs.rigid.bodies import SPACE, Body, Motion, stacked
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
)
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
    DrivenAngle("angle", "a", "b", TABLE, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
    PrescribedAngle("still", "b", "a", 0.4, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
    PointOnLine("line", "a", "b", AT_I, AT_J, ALONG),
    Prismatic("prismatic", "a", "b", AT_I, AT_J, ALONG, ACROSS, (1.0, 0.0, 1.0), (2.0, 1.0, 0.6)),
    RevolutePrismatic("slide", "a", "b", AT_I, AT_J, ALONG, ACROSS, (1.0, 2.0, 0.0)),
    Fixed("fixed", "b", "a", AT_I, AT_J, (0.5, -0.5, 0.5, 0.5)),
    PrescribedPoint("point", "b", TABLE, AT_J, ALONG),
    DrivenAngle("last", SPACE, "a", TABLE, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
)
ENDS = ("a", "b", AT_I, AT_J)
SOFT = Table((-1.0, 0.0, 0.5, 1.0), (-50.0, 0.0, 80.0, 100.0))
FORCES: tuple[Force, ...] = (
    Gravity((2.0, 3.0)),
    SpringDamper("spring", *ENDS, 300.0, 0.4, 20.0),
    SpringDamper("table", "b", SPACE, AT_J, AT_I, SOFT, 0.2, 15.0),
    Actuator("actuator", *ENDS, 700.0),
    BumpStop("stop", *ENDS, 0.1, 0.3, 4000.0),
    PointForce("load", "b", (1.0, -2.0, 3.0), AT_J),
)


def some_motion(system: System, seed: int) -> Motion:
    random = np.random.default_rng(seed)
    return system.start().moved(random.normal(size=12)).with_velocities(random.normal(size=12))


@pytest.mark.parametrize("seed", range(4))
def test_rows_of_all_joints_are_those_of_each_alone(seed: int) -> None:
    system = System(BODIES, JOINTS)
    motion = some_motion(system, seed)
    found = system.constraints(motion, TIME)
    alone = [System(BODIES, (joint,)).constraints(motion, TIME) for joint in JOINTS]
    for name, mine, other in zip(found._fields, found, stacked(alone), strict=True):
        assert np.array_equal(mine, other), name


def at(motion: Motion, body: str, local: tuple[float, float, float]) -> np.ndarray:
    number = motion.numbers[body]
    return motion.position[number] + motion.rotation[number] @ local


def turned(motion: Motion, body: str, vector: tuple[float, float, float]) -> np.ndarray:
    return motion.rotation[motion.numbers[body]] @ vector


def test_rows_are_the_distances_and_cosines_that_joints_are_defined_by() -> None:
    """Some ten roundings of numbers below 10; where a joint picks normals, lengths are compared."""
    motion = some_motion(System(BODIES, ()), 3)
    system = System(BODIES, JOINTS)
    value = system.constraints(motion, TIME).value
    rows = {name: value[where] for name, where in system.row_ranges.items()}
    gap = at(motion, "a", AT_I) - at(motion, "b", AT_J)
    axis = turned(motion, "a", ALONG) / np.linalg.norm(ALONG)
    other = turned(motion, "b", ACROSS) / np.linalg.norm(ACROSS)
    across = np.linalg.norm(np.cross(axis, gap))
    place, angle = at(motion, "b", AT_J), TABLE(TIME)[0]
    spline = CubicSpline((-2.0, 0.0, 1.0, 3.0), (0.0, 1.0, 0.5, 0.2), bc_type="natural")
    side, forward = turned(motion, "a", (0, 0, -1)), turned(motion, "a", (1, 0, 0))
    normal = np.cos(angle) * side - np.sin(angle) * forward
    within = 200 * EPS
    check("spherical", rows["spherical"], gap, within=within)
    check("curve", rows["curve"][0], place[1] - spline(place[0]), within=within)
    check("revolute", rows["on space"][:3], np.array(AT_I) - place, within=within)
    tilt = np.linalg.norm(np.cross(np.array(ALONG) / np.linalg.norm(ALONG), other))
    check("tilt", np.linalg.norm(rows["on space"][3:]), tilt, within=within)
    check("line", np.linalg.norm(rows["line"]), across, within=within)
    check("slide", np.linalg.norm(rows["prismatic"][:2]), across, within=within)
    tilt = np.linalg.norm(np.cross(axis, other))
    check("its tilt", np.linalg.norm(rows["prismatic"][2:4]), tilt, within=within)
    height = place @ np.array(ALONG) / np.linalg.norm(ALONG)
    check("height", rows["point"], [height - TABLE(TIME)[0]], within=within)
    check("angle", rows["angle"], [normal @ turned(motion, "b", (0, 0, 1))], within=within)


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_what_each_force_says_and_gyroscopic_moments(seed: int) -> None:
    system = System(BODIES, (), FORCES)
    motion = some_motion(system, seed)
    expected = sum((generalised(force, motion, TIME) for force in FORCES), np.zeros(12))
    for i, body in enumerate(BODIES):
        moment = np.cross(motion.spin[i], np.asarray(body.inertia) * motion.spin[i])
        expected[6 * i + 3 : 6 * i + 6] -= moment
    within = 200 * EPS * np.abs(expected).max()
    check("forces", system.generalised_forces(motion, TIME), expected, within=within)


def test_slopes_of_pulls_are_those_of_springs_dampers_and_tables() -> None:
    """Differences over 1e-7 m of forces of 1000 N: eps 1000 / 1e-7 is 2e-6 N/m."""
    system = System(BODIES, (), FORCES)
    stiffness = system.lines.stiffness(np.full(4, 0.5))
    # The table has its slope 160 up to 0.5; a stop pushed apart by 0.2 m resists with all it has.
    check("stiffness [N/m]", stiffness, (300.0, 160.0, 0.0, 4000.0), within=1e-5)
    assert np.array_equal(system.lines.damping, (20.0, 15.0, 0.0, 0.0))


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
