"""Compiled joints and forces: definitions, Jacobians, virtual work, energies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_mechanics import from_vector, generalised, stored_energy, tabulated
from driven_angle import DrivenAngle
from measuring import check
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from catenary import InputError
from catenary.mbs.rigid.bodies import (
    SPACE,
    Body,
    Motion,
    Quantity,
    initial_motion,
    normalised,
    point,
    rotation_matrix,
    stacked,
)
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
    Constant,
    Fixed,
    FlatRows,
    Joint,
    PointOnCurve,
    PointOnLine,
    PrescribedAngle,
    PrescribedPoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
    steady,
)
from catenary.mbs.rigid.system import System, independent_rows

# --- compiled evaluation of joints and forces against their definitions ---------------------------


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
    Revolute("revolute", "a", "b", AT_I, AT_J, ALONG, ACROSS),
    Fixed("in space", "a", at_i=AT_I),
    PrescribedPoint("steady point", "a", steady(0.3, 2.0), AT_I, ACROSS),
)
N_ROWS = (2, 3, 5, 1, 1, 2, 5, 4, 6, 1, 1, 5, 6, 1)
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


# --- jacobians and acceleration terms of joints against finite differences; Euler parameters ------


def any_motion(seed: int = 5) -> Motion:
    """Two bodies anywhere, moving anyhow, at the time TIME."""
    random = np.random.default_rng(seed)
    start = initial_motion([Body("a", 2.0, (1, 2, 3)), Body("b", 3.0, (2, 2, 1))])
    return start.moved(random.uniform(-1, 1, 12)).with_velocities(random.uniform(-1, 1, 12))


def rows_of(joint: Joint, motion: Motion, time: float) -> Quantity:
    return FlatRows((joint,), motion)(motion, time)


@pytest.mark.parametrize(
    ("joint", "n_rows"),
    list(zip(JOINTS, N_ROWS, strict=True)),
    ids=lambda p: getattr(p, "name", str(p)),
)
def test_jacobian_rate_and_drift_are_derivatives_of_the_constraint(
    joint: Joint, n_rows: int
) -> None:
    """Central differences with step h: h^2 of the third derivatives, eps / h of round-off.

    Lengths, speeds and turns are of order one; third derivatives are below 100.
    """
    motion, h = any_motion(), 1e-5
    within = 100 * h**2 + 100 * EPS / h
    rows = rows_of(joint, motion, TIME)
    assert rows.value.shape == rows.rate.shape == rows.drift.shape == (n_rows,)
    differences = [
        (
            rows_of(joint, motion.moved(+h * e), TIME).value
            - rows_of(joint, motion.moved(-h * e), TIME).value
        )
        / (2 * h)
        for e in np.eye(12)
    ]
    check("jacobian", rows.jacobian, np.array(differences).T, within=within)

    # With angular velocities constant in body axes, `moved` is the exact motion without
    # accelerations.
    def later(s: float) -> np.ndarray:
        moved = motion.moved(s * motion.velocities)
        return rows_of(joint, moved, TIME + s).value

    def rate_later(s: float) -> np.ndarray:
        moved = motion.moved(s * motion.velocities)
        return rows_of(joint, moved, TIME + s).rate

    check("rate", rows.rate, (later(h) - later(-h)) / (2 * h), within=within)
    check("drift", rows.drift, (rate_later(h) - rate_later(-h)) / (2 * h), within=within)


def test_rotation_of_euler_parameters_is_the_one_of_scipy() -> None:
    motion = any_motion()
    expected = Rotation.from_quat(np.roll(motion.parameters, -1, axis=-1)).as_matrix()
    check("rotation matrix", rotation_matrix(motion.parameters), expected, within=8 * EPS)
    angles = np.array([0.3, -0.7, 1.1])
    after = motion.moved(np.tile([0.0, 0.0, 0.0, *angles], 2)).rotation
    turn = Rotation.from_rotvec(angles).as_matrix()
    check("after a turn", after[:-1], expected[:-1] @ turn, within=16 * EPS)


def test_vector_of_a_motion_gives_it_back_normalised() -> None:
    motion = any_motion()
    vector = motion.to_vector()
    assert vector.shape == (26,)
    vector[3:7] *= 1.01  # as an integration could leave it
    again = from_vector(motion, vector)
    check("norms", np.linalg.norm(again.parameters, axis=1), 1.0, within=2 * EPS)
    check("state", again.to_vector(), motion.to_vector(), within=4 * EPS)
    check("parameters", normalised(1.01 * motion.parameters), motion.parameters, within=4 * EPS)


def test_bodies_and_joints_that_cannot_be_are_refused() -> None:
    with pytest.raises(InputError, match="'arm': mass 0"):
        Body("arm", 0.0, (1, 1, 1))
    with pytest.raises(InputError, match="no e0"):
        Body("arm", 1.0, (1, 1, 1), turn=(0.9, 0.9, 0.0))
    with pytest.raises(InputError, match="frame at rest"):
        Body(SPACE, 1.0, (1, 1, 1))
    with pytest.raises(InputError, match="different names"):
        initial_motion([Body("a", 1.0, (1, 1, 1))] * 2)
    with pytest.raises(InputError, match="no body 'c'; there are a, b, space"):
        rows_of(Spherical("s", "a", "c"), any_motion(), 0.0)
    with pytest.raises(InputError, match="zero length"):
        rows_of(Revolute("r", "a", "b", axis_i=(0, 0, 0)), any_motion(), 0.0)
    with pytest.raises(InputError, match="'track': x of the curve"):
        PointOnCurve("track", "a", (0.0, 0.0), (0, 1), (0, 1))


def test_laws_of_time() -> None:
    assert Constant(2.0)(5.0) == (2.0, 0.0, 0.0)
    assert steady(2.0, 3.0)(5.0) == (17.0, 3.0, 0.0)
    line = tabulated((0.0, 1.0, 2.0), (1.0, 3.0, 5.0))(1.5)
    check("straight table", line, (4.0, 2.0, 0.0), within=16 * EPS)


# --- forces on bodies -----------------------------------------------------------------------------


PROGRESSIVE = Table((-1.0, 0.0, 0.1, 5.0), (-90.0, 0.0, 20.0, 3000.0))


FORCES_BODIES = (Body("a", 2.0, (1, 2, 3)), Body("b", 3.0, (2, 2, 1), (2.0, 0, 0)))


def some_places() -> Motion:
    random = np.random.default_rng(8)
    return initial_motion(FORCES_BODIES).moved(random.uniform(-0.5, 0.5, 12))


def two_points(length: float, rate: float = 0.0) -> Motion:
    """Centres of two bodies in a row along x, body b moving away."""
    start = initial_motion([Body("a", 1.0, (1, 1, 1)), Body("b", 1.0, (1, 1, 1), (length, 0, 0))])
    velocities = np.zeros(12)
    velocities[6] = rate
    return start.with_velocities(velocities)


STORING: list[Force] = [
    SpringDamper("spring", "a", "b", AT_I, AT_J, stiffness=300.0, free_length=0.5),
    SpringDamper("to space", SPACE, "b", AT_I, AT_J, stiffness=300.0, free_length=0.5),
    SpringDamper("table", "a", "b", AT_I, AT_J, stiffness=PROGRESSIVE, free_length=0.5),
    SpringDamper("cubic", "a", "b", AT_I, AT_J, stiffness=lambda s: 50 * s**3, free_length=0.5),
    BumpStop("too long", "a", "b", AT_I, AT_J, longest=0.5, stiffness=400.0),
    BumpStop("too short", "a", "b", AT_I, AT_J, shortest=9.0, stiffness=400.0),
    Gravity((2.0, 3.0)),
]


@pytest.mark.parametrize("force", STORING, ids=lambda f: f.name)
def test_force_is_the_descent_of_its_energy(force: Force) -> None:
    """Central differences: h^2 of third derivatives (some 1e4 J), round-off of some 1e4 J / h."""
    motion, h = some_places(), 1e-4
    descent = [
        (stored_energy(force, motion.moved(-h * e)) - stored_energy(force, motion.moved(h * e)))
        / (2 * h)
        for e in np.eye(12)
    ]
    within = 1e4 * (h**2 + 10 * EPS / h)
    found = System(FORCES_BODIES, (), (force,)).generalised_forces(motion, 0.0)
    assert np.abs(found).max() > 1.0
    check("force [N, N m]", found, descent, within=within)


def test_spring_and_damper_pull_together() -> None:
    spring = SpringDamper("s", "a", "b", stiffness=100.0, free_length=1.5, damping=7.0)
    force = generalised(spring, two_points(2.0, rate=3.0)).reshape(2, 6)
    check("on a and b [N]", force[:, 0], (71.0, -71.0), within=71 * EPS)


def test_actuator_pushes_apart_with_its_force() -> None:
    force = generalised(Actuator("a", "a", "b", force=20.0), two_points(2.0)).reshape(2, 6)
    check("on a and b [N]", force[:, 0], (-20.0, 20.0), within=40 * EPS)


def test_power_of_a_point_force_is_force_times_velocity_of_its_point() -> None:
    speeds = np.random.default_rng(9).uniform(-1, 1, 12)
    motion, push = some_places().with_velocities(speeds), (3.0, -2.0, 5.0)
    for force in (PointForce("f", "b", push, AT_J), PointForce("f", "b", lambda t: push, AT_J)):
        power = force.generalised(motion, 0.0) @ motion.velocities
        expected = np.dot(push, point(motion, "b", AT_J).rate)
        check("power [W]", power, expected, within=64 * EPS * abs(expected))


def test_stop_pushes_only_and_only_beyond_its_limits() -> None:
    stop = BumpStop("s", "a", "b", shortest=1.0, longest=2.0, stiffness=100.0)

    def on_b(length: float) -> float:
        return float(generalised(stop, two_points(length))[6])

    assert on_b(1.5) == 0.0
    check("too short [N]", on_b(0.8), 20.0, within=1e-13)
    check("too long [N]", on_b(2.2), -20.0, within=1e-13)


def test_table_goes_on_straight() -> None:
    check("beyond", (PROGRESSIVE(-2.0), PROGRESSIVE(0.05)), (-180.0, 10.0), within=1e-12)
    with pytest.raises(InputError, match="spring of the base must have at least two points"):
        Table((1.0, 0.0), (0.0, 1.0), "spring of the base")
