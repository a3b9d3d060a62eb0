"""The head over the reduced mechanism against lumped masses and against all bodies."""

from __future__ import annotations

import numpy as np
import paper_pantograph as ambrosio
from body_mechanics import static_force
from constraint_handling import Baumgarte
from measuring import check, orders, print_table
from variable_steps import integrate

from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.reduction import (
    Head,
    RaisingData,
    RaisingPantograph,
    ReducedMechanism,
    reduce_mechanism,
)
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.rigid.statics import calibrate_actuator, equilibrium
from catenary.mbs.vehicle import BaseMotion, Harmonic, VehicleMotion

EPS = np.finfo(float).eps
ARM, HEAD = ambrosio.STABILISATION_ARM, ambrosio.HEAD
HOLDER = PrescribedPoint("holder", ARM, Constant(ambrosio.INITIAL_ARM_HEIGHT))
WEIGHT, STIFFNESS = 7.8 * 9.81, 6000.0
# The head stands on springs of free length 0.103 m, held 0.010 m above its own origin.
OFFSET = 0.103 - 0.010 - WEIGHT / STIFFNESS


def test_mechanism_that_is_the_same_at_all_heights_is_two_lumped_masses() -> None:
    """The same scheme on the same equations: round-off of heights of 5 m over 2000 steps."""
    same = np.ones(5)
    frame = ReducedMechanism(
        np.linspace(0.0, 9.0, 5), 15.0 * same, 190.0 * same, 90.0 * same, 15.0 * same
    )
    data = RaisingData(frame, Head(7.2, 4200.0, 10.0, 70.0, 0.1), 0.2)
    found = RaisingPantograph(data, Stepping(raise_time=0.5, dt=1e-3))
    lumped = LumpedData((7.2, 15.0), (4200.0, 0.0), (10.0, 90.0))
    expected = LumpedPantograph(lumped, 120.0, 5.0, Stepping(raise_time=0.5, dt=1e-3))
    for pantograph in (found, expected):
        pantograph.place(5.0)
    # What contact and restart see, a force that comes and goes included.
    for number in range(2000):
        time = 1e-3 * (number + 1)
        mine, other = found.predict(time), expected.predict(time)
        force = 130.0 + 40.0 * np.sin(9.0 * time) if number > 300 else 0.0
        found.advance(np.array([force]))
        expected.advance(np.array([force]))
    # Newmark's accelerations come from differences of heights on springs: 2000 steps of eps.
    within = 2000 * EPS * 5.0 * 10
    check("height [m]", mine.height, other.height, within=within)
    check("velocity [m/s]", mine.velocity, other.velocity, within=100 * within)
    check("height compliance", mine.height_compliance, other.height_compliance, within=1e-20)
    check("velocity compliance", mine.velocity_compliance, other.velocity_compliance, within=1e-17)
    check("all heights [m]", found.position, expected.position, within=within)
    check("all velocities [m/s]", found.velocity, expected.velocity, within=100 * within)
    check("static force [N]", static_force(found, 5.0), 120.0, within=1e-10)
    assert abs(found.position[0] - 5.0) > 0.01


def test_strips_roll_and_a_moving_base_are_the_same_for_both_models() -> None:
    """A base that carries along all of a mechanism leaves it what a chain without a last spring is.

    The frame's damper stands on the base in both. Round-off as above, of 1500 steps.
    """
    same = np.ones(5)
    frame = ReducedMechanism(
        np.linspace(0.0, 9.0, 5), 15.0 * same, 190.0 * same, 90.0 * same, 15.0 * same
    )
    own = Suspension(0.8, 9000.0, 20.0)
    strips = Strips(2, 0.5, 1.6, own, Turning(0.3, 90.0, 2.0))
    roll = Turning(2.0, 470.0, 3.0)
    data = RaisingData(frame, Head(7.2, 4200.0, 10.0, 70.0, 0.1, roll), 0.2, strips)
    chain = LumpedData((7.2, 15.0), (4200.0, 0.0), (10.0, 90.0), strips, roll)
    vehicle = VehicleMotion((Harmonic(0.02, 2.0, 0.3),), (Harmonic(0.05, 1.0),))
    base = BaseMotion(vehicle, 100.0, 70.0)
    path = LateralPath(
        [(np.array([0.0, 150.0, 300.0]), (0.2, -0.2, 0.2))], 100.0, strips.offsets, 70.0, base
    )
    found = RaisingPantograph(data, Stepping(0.5, 1e-3, lateral=path, base=base))
    expected = LumpedPantograph(chain, 120.0, 5.0, Stepping(0.5, 1e-3, lateral=path, base=base))
    for pantograph in (found, expected):
        pantograph.place(5.0, velocity=0.1)
    force = np.zeros(2)
    for number in range(1500):
        time = 1e-3 * (number + 1)
        mine, other = found.predict(time), expected.predict(time)
        if number > 300:
            force[:] = 60.0 + 40.0 * np.sin(9.0 * time), 55.0 + 30.0 * np.cos(17.0 * time)
        found.advance(force)
        expected.advance(force)
    within = 1500 * EPS * 5.0 * 100
    check("heights [m]", mine.height, other.height, within=within)
    check("velocities [m/s]", mine.velocity, other.velocity, within=100 * within)
    check("height compliance", mine.height_compliance, other.height_compliance, within=1e-18)
    check("velocity compliance", mine.velocity_compliance, other.velocity_compliance, within=1e-15)
    check("state", found.position, expected.position, within=within)
    assert np.abs(found.position[3]) > 1e-3  # the roll


def test_paper_s_pantograph_let_go_rises_like_all_its_bodies() -> None:
    """Order 2 in dt; all bodies differ by the 0.1 kg of what the head carries along the track."""
    force, end = 150.0, 0.1
    system = ambrosio.pantograph()
    held = system.with_joints(HOLDER)
    push = calibrate_actuator(held, ambrosio.ACTUATOR, system.start(), force).actuator_force
    system = system.with_force_changed(ambrosio.ACTUATOR, force=push)
    pressed = system.with_forces(PointForce("wire", HEAD, (0, 0, -force)))
    rest = equilibrium(pressed.with_joints(HOLDER), system.start()).motion
    head = rest.numbers[HEAD]
    full = integrate(system, Baumgarte(), rest, [0.0, end], rtol=1e-9).motions[-1]
    expected = full.position[head, 2]
    frame = ambrosio.frame().with_force_changed(ambrosio.ACTUATOR, force=push)
    tables = reduce_mechanism(frame, ARM, np.linspace(1.3, 1.6, 13))
    data = RaisingData(tables, Head(7.8, STIFFNESS, 26.0, WEIGHT, OFFSET))
    start = rest.position[head, 2]
    steps, ends = [4e-3, 2e-3, 1e-3, 0.5e-3], []
    for dt in [*steps, 0.125e-3]:
        pantograph = RaisingPantograph(data, Stepping(raise_time=0.0, dt=dt))
        check("static force [N]", static_force(pantograph, start), force, within=0.01)
        # At rest under the wire, which lets go: what is left pushes the head.
        z = start + force / STIFFNESS
        pantograph.restore(np.array([start, z, 0.0, 0.0, force / 7.8, 0.0]))
        for number in range(round(end / dt)):
            pantograph.predict(dt * (number + 1))
            pantograph.advance(np.array([0.0]))
        ends.append(pantograph.position[0])
    rise = expected - start
    errors = [abs(found - ends[-1]) for found in ends[:-1]]
    observed = print_table("head after 0.1 s, against dt / 4 [m]", steps, errors)
    # The reference has 1 / 16 of the finest error: 4 reads as (4 - 1 / 16) / (1 - 1 / 16).
    check("order", observed[-1], np.log2(63 / 15), within=0.05)
    assert orders(errors)[0] > 1.7
    check("head [m]", ends[-1] - start, rise, within=rise * 0.1 / (25.7 + 7.8))


def test_state_is_all_that_is_needed_to_continue() -> None:
    tables = reduce_mechanism(ambrosio.frame(), ARM, np.linspace(1.3, 1.6, 7))
    data = RaisingData(tables, Head(7.8, STIFFNESS, 26.0, WEIGHT, OFFSET), base_height=3.6)
    one, other = (RaisingPantograph(data, Stepping(raise_time=0.05, dt=1e-3)) for _ in range(2))
    one.place(5.1)
    for number in range(50):
        one.predict(1e-3 * (number + 1))
        one.advance(np.array([20.0]))
    other.restore(one.state())
    for pantograph in (one, other):
        pantograph.predict(0.051)
        pantograph.advance(np.array([30.0]))
    assert (one.state() == other.state()).all()
    assert one.position[0] != 5.1
