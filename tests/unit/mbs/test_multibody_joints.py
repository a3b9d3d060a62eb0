"""Jacobians and acceleration terms of joints against finite differences; Euler parameters."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import from_vector, tabulated
from driven_angle import DrivenAngle
from measuring import check
from scipy.spatial.transform import Rotation

from catenary import InputError
from catenary.mbs.rigid.bodies import (
    SPACE,
    Body,
    Motion,
    Quantity,
    initial_motion,
    normalised,
    rotation_matrix,
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

EPS = np.finfo(float).eps
TIME = 0.7
TABLE = tabulated((0.0, 0.5, 1.0, 1.5), (0.0, 0.3, 0.1, -0.2))
AT_I, AT_J = (0.3, -0.2, 0.5), (-0.4, 0.1, 0.2)
AXIS_I, AXIS_J = (0.2, 1.0, -0.3), (-0.5, 0.4, 1.0)
JOINTS: list[Joint] = [
    Spherical("spherical", "a", "b", AT_I, AT_J),
    Revolute("revolute", "a", "b", AT_I, AT_J, AXIS_I, AXIS_J),
    Revolute("revolute on space", SPACE, "b", AT_I, AT_J, AXIS_I, AXIS_J),
    PointOnLine("point on line", "a", "b", AT_I, AT_J, AXIS_I),
    Prismatic("prismatic", "a", "b", AT_I, AT_J, AXIS_I, AXIS_J, (1.0, 0.0, 1.0), (2.0, 1.0, 0.6)),
    RevolutePrismatic("revolute-prismatic", "a", "b", AT_I, AT_J, AXIS_I, AXIS_J, (1.0, 2.0, 0.0)),
    Fixed("fixed", "b", "a", AT_I, AT_J, (0.5, -0.5, 0.5, 0.5)),
    Fixed("fixed in space", "a", at_i=AT_I),
    PointOnCurve("curve", "b", (-2.0, 0.0, 1.0, 3.0), (0.0, 1.0, 0.5, 0.2), (0, 1, 0, 2), AT_J),
    PrescribedPoint("prescribed point", "b", TABLE, AT_J, AXIS_I),
    PrescribedPoint("steady point", "a", steady(0.3, 2.0), AT_I, AXIS_J),
    PrescribedAngle("prescribed angle", "a", "b", 0.3, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
    DrivenAngle("driven angle", "a", "b", TABLE, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
]
N_ROWS = (3, 5, 5, 2, 5, 4, 6, 6, 2, 1, 1, 1, 1)


def some_motion(seed: int = 5) -> Motion:
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
    motion, h = some_motion(), 1e-5
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
    motion = some_motion()
    expected = Rotation.from_quat(np.roll(motion.parameters, -1, axis=-1)).as_matrix()
    check("rotation matrix", rotation_matrix(motion.parameters), expected, within=8 * EPS)
    angles = np.array([0.3, -0.7, 1.1])
    after = motion.moved(np.tile([0.0, 0.0, 0.0, *angles], 2)).rotation
    turn = Rotation.from_rotvec(angles).as_matrix()
    check("after a turn", after[:-1], expected[:-1] @ turn, within=16 * EPS)


def test_vector_of_a_motion_gives_it_back_normalised() -> None:
    motion = some_motion()
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
        rows_of(Spherical("s", "a", "c"), some_motion(), 0.0)
    with pytest.raises(InputError, match="zero length"):
        rows_of(Revolute("r", "a", "b", axis_i=(0, 0, 0)), some_motion(), 0.0)
    with pytest.raises(InputError, match="'track': x of the curve"):
        PointOnCurve("track", "a", (0.0, 0.0), (0, 1), (0, 1))


def test_laws_of_time() -> None:
    assert Constant(2.0)(5.0) == (2.0, 0.0, 0.0)
    assert steady(2.0, 3.0)(5.0) == (17.0, 3.0, 0.0)
    line = tabulated((0.0, 1.0, 2.0), (1.0, 3.0, 5.0))(1.5)
    check("straight table", line, (4.0, 2.0, 0.0), within=16 * EPS)
