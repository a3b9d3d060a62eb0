"""Forces on bodies: virtual work, energies as potentials, tables, stops."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import generalised, stored_energy
from measuring import check

from catenary import InputError
from catenary.mbs.rigid.bodies import SPACE, Body, Motion, initial_motion, point
from catenary.mbs.rigid.forces import (
    Actuator,
    BumpStop,
    Force,
    Gravity,
    PointForce,
    SpringDamper,
    Table,
)
from catenary.mbs.rigid.system import System

EPS = np.finfo(float).eps
AT_I, AT_J = (0.3, -0.2, 0.5), (-0.4, 0.1, 0.2)
PROGRESSIVE = Table((-1.0, 0.0, 0.1, 5.0), (-90.0, 0.0, 20.0, 3000.0))


BODIES = (Body("a", 2.0, (1, 2, 3)), Body("b", 3.0, (2, 2, 1), (2.0, 0, 0)))


def some_motion() -> Motion:
    random = np.random.default_rng(8)
    return initial_motion(BODIES).moved(random.uniform(-0.5, 0.5, 12))


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
    motion, h = some_motion(), 1e-4
    descent = [
        (stored_energy(force, motion.moved(-h * e)) - stored_energy(force, motion.moved(h * e)))
        / (2 * h)
        for e in np.eye(12)
    ]
    within = 1e4 * (h**2 + 10 * EPS / h)
    found = System(BODIES, (), (force,)).generalised_forces(motion, 0.0)
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
    motion, push = some_motion().with_velocities(speeds), (3.0, -2.0, 5.0)
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
