"""Equilibrium, actuator calibration and equivalent mass of systems that can be done by hand."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import equivalent_mass, reaction
from measuring import check

from catenary import InputError, RunBroken
from catenary.mbs.rigid.bodies import SPACE, Body
from catenary.mbs.rigid.forces import Actuator, Gravity, PointForce, SpringDamper
from catenary.mbs.rigid.joints import Constant, PrescribedPoint, Prismatic, Revolute, Spherical
from catenary.mbs.rigid.statics import calibrate_actuator, equilibrium, held_force
from catenary.mbs.rigid.system import System

G = 9.81
UP, ACROSS = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
UPWARD = Prismatic("guide", SPACE, "head", axis_i=UP, axis_j=UP, normal_i=ACROSS, normal_j=ACROSS)


def lever(length: float = 2.0, mass: float = 3.0) -> System:
    """A level rod hinged at its left end, weight and a strut from below at a quarter."""
    moment = mass * length**2 / 12
    return System(
        (Body("rod", mass, (1e-3, moment, moment), (length / 2, 0, 0)),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (
            Gravity((mass,), G),
            Actuator("strut", SPACE, "rod", (length / 4, 0, -1.0), (-length / 4, 0, 0), 100.0),
        ),
    )


def test_hanging_mass_stretches_its_spring_by_weight_over_stiffness() -> None:
    mass, stiffness, free, load = 2.0, 300.0, 0.5, 5.0
    system = System(
        (Body("head", mass, (1, 1, 1), (0, 0, -0.4)),),
        (UPWARD,),
        (
            Gravity((mass,), G),
            SpringDamper("spring", SPACE, "head", stiffness=stiffness, free_length=free),
            PointForce("load", "head", (0, 0, -load)),
        ),
    )
    rest = equilibrium(system, system.start().with_velocities(np.ones(6)))
    # Left over: 1e-9 of 25 N, on 300 N/m.
    expected = -(free + (mass * G + load) / stiffness)
    check("height [m]", rest.motion.position[0, 2], expected, within=1e-10)
    assert not rest.motion.velocities.any()


def test_pendulum_comes_to_rest_below_its_hinge_while_it_may_spin_freely() -> None:
    """On a spherical joint the turn about its own axis is resisted by nothing."""
    system = System(
        (Body("bob", 1.0, (1, 1, 0.1), (0.3, 0.2, -0.9)),),
        (Spherical("hook", SPACE, "bob", at_j=(0, 0, 1)),),
        (Gravity((1.0,), G),),
    )
    rest = equilibrium(system, system.start())
    check("position [m]", rest.motion.position[0], (0, 0, -1), within=1e-8)
    found = reaction(system, "hook", "bob", rest.motion, rest.multipliers)
    check("hook carries [N]", found.force, (0, 0, G), within=1e-7)


def test_lever_presses_as_levers_do() -> None:
    """Held at its end: strut F at L / 4, weight at L / 2: F / 4 - m g / 2 upward."""
    system, holder = lever(), PrescribedPoint("wire", "rod", Constant(0.0), (1.0, 0, 0))
    expected = 100.0 / 4 - 3.0 * G / 2
    check("pressed [N]", held_force(system, holder, system.start()), expected, within=1e-10)
    found = calibrate_actuator(system.with_joints(holder), "strut", system.start(), 50.0)
    check("actuator [N]", found.actuator_force, 4 * (50.0 + 3.0 * G / 2), within=1e-6)
    check("static force [N]", found.static_force, 50.0, within=1e-6)
    check("gain", found.gain, 0.25, within=1e-9)
    check("had [N]", found.force_before, expected, within=1e-10)


def test_equivalent_mass_of_a_lever_is_its_inertia_over_arm_squared() -> None:
    """m L^2 / 3 about the hinge: m / 3 at the end, 4 m / 3 in the middle."""
    system = lever()
    at_end = equivalent_mass(system, system.start(), "rod", (1.0, 0, 0))
    check("at the end [kg]", at_end, 1.0, within=1e-12)
    check("in the middle [kg]", equivalent_mass(system, system.start(), "rod"), 4.0, within=1e-12)
    with pytest.raises(InputError, match="do not let body 'rod' move along"):
        equivalent_mass(system, system.start(), "rod", along=(1, 0, 0))


def test_what_has_no_answer_is_said() -> None:
    system = System((Body("head", 2.0, (1, 1, 1)),), (UPWARD,), (Gravity((2.0,), G),))
    with pytest.raises(RunBroken, match="no equilibrium near its start: 19.6 N are left over"):
        equilibrium(system, system.start())
    holder = PrescribedPoint("wire", "rod", Constant(0.0), (1.0, 0, 0))
    with pytest.raises(InputError, match="'gravity' is no actuator"):
        calibrate_actuator(lever().with_joints(holder), "gravity", lever().start(), 50.0)
    with pytest.raises(InputError, match="no force 'lift'"):
        calibrate_actuator(lever().with_joints(holder), "lift", lever().start(), 50.0)
    useless = lever().with_forces(Actuator("idle", SPACE, "rod", (-1.0, 0, 0), (0, 0, 0), 1.0))
    with pytest.raises(InputError, match="'idle' does not act on the wire"):
        calibrate_actuator(useless.with_joints(holder), "idle", useless.start(), 50.0)
