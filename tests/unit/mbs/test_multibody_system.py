"""Equations of motion, equilibrium, calibration and least squares of small systems."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import equivalent_mass, reaction
from measuring import check

from catenary import InputError, RunBroken
from catenary.mbs.rigid.bodies import SPACE, Body, Motion
from catenary.mbs.rigid.forces import Actuator, Gravity, PointForce, SpringDamper
from catenary.mbs.rigid.joints import (
    Constant,
    Fixed,
    PointOnLine,
    PrescribedPoint,
    Prismatic,
    Revolute,
    Spherical,
    steady,
)
from catenary.mbs.rigid.statics import calibrate_actuator, equilibrium, held_force
from catenary.mbs.rigid.system import System, independent_rows, least_squares, null_space

# --- equations of motion, reactions, assembly and projections of small systems --------------------


EPS = np.finfo(float).eps
G = 9.81


def rod(name: str, mass: float, length: float, x: float, z: float = 0.0) -> Body:
    """A thin rod along its first axis."""
    moment = mass * length**2 / 12
    return Body(name, mass, (1e-3 * moment, moment, moment), (x, 0.0, z))


def four_bar() -> tuple[System, Motion]:
    """A parallelogram of two upright rods under a horizontal one, all hinges about y.

    The upright rods turn by -90 degrees about y, so that their first axes point up.
    """
    up = (0.0, -np.sqrt(0.5), 0.0)
    left = Body("left", 1.0, (0.01, 1 / 12, 1 / 12), (0, 0, 0.5), up)
    right = Body("right", 1.0, (0.01, 1 / 12, 1 / 12), (2, 0, 0.5), up)
    top = rod("top", 2.0, 2.0, 1.0, 1.0)
    low, high = (-0.5, 0, 0), (0.5, 0, 0)
    system = System(
        (left, right, top),
        (
            Revolute("hinge left", SPACE, "left", at_j=low),
            Revolute("hinge right", SPACE, "right", (2, 0, 0), low),
            Revolute("top left", "left", "top", high, (-1, 0, 0)),
            Revolute("top right", "right", "top", high, (1, 0, 0)),
        ),
        (Gravity((1.0, 1.0, 2.0), G),),
    )
    return system, system.start()


def test_held_rod_has_the_reactions_of_statics() -> None:
    """A cantilever of weight m g with a load F at its end: the wall carries m g + F.

    Its moment about the centre of mass balances the load's, F L / 2.
    """
    mass, length, load = 3.0, 2.0, 7.0
    system = System(
        (rod("rod", mass, length, 1.0),),
        (Fixed("wall", "rod", at_j=(-length / 2, 0, 0)),),
        (Gravity((mass,), G), PointForce("load", "rod", (0, 0, -load), (length / 2, 0, 0))),
    )
    motion = system.start()
    solution = system.accelerations(motion, 0.0)
    check("acceleration", solution.acceleration, 0.0, within=1e-12)
    found = reaction(system, "wall", "rod", motion, solution.multipliers)
    check("force [N]", found.force, (0, 0, mass * G + load), within=1e-12)
    # A load down at +x turns about +y; the joint turns back.
    check("moment [N m]", found.moment, (0, -load * length / 2, 0), within=1e-12)


def test_swinging_rod_let_go_level_falls_and_pulls_like_by_hand() -> None:
    """alpha = 3 g / (2 L); the hinge carries m g / 4; at spin w, along the rod m w^2 L / 2."""
    mass, length, spin = 3.0, 2.0, 1.7
    body = rod("rod", mass, length, length / 2)
    system = System(
        (body,),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (Gravity((mass,), G),),
    )
    motion = system.start().with_velocities(np.array([0, 0, -spin * length / 2, 0, spin, 0]))
    check("rate", system.constraints(motion, 0.0).rate, 0.0, within=4 * EPS)
    solution = system.accelerations(motion, 0.0)
    check("alpha [rad/s^2]", solution.acceleration[4], 1.5 * G / length, within=1e-12)
    found = reaction(system, "hinge", "rod", motion, solution.multipliers)
    expected = (-mass * spin**2 * length / 2, 0.0, mass * G / 4)
    check("hinge force [N]", found.force, expected, within=1e-12)


def test_redundant_rows_of_a_plane_mechanism_are_named_and_do_no_harm() -> None:
    """Four hinges: 20 rows leave -2 by count, but one degree of freedom: three are redundant."""
    system, motion = four_bar()
    assert system.redundant(motion) == ("top right (3)",)
    assert system.n_degrees_of_freedom(motion) == 1
    solution = system.accelerations(motion, 0.0)
    check("upright, at rest: accelerations", solution.acceleration, 0.0, within=1e-12)
    feet = sum(
        reaction(system, name, body, motion, solution.multipliers).force
        for name, body in (("hinge left", "left"), ("hinge right", "right"))
    )
    check("carried by the hinges [N]", feet, (0.0, 0.0, 4 * G), within=1e-11)
    assert list(independent_rows(np.array([[1.0, 0], [2, 0], [0, 0], [0, 3]]))) == [0, 3]


def test_assembly_closes_joints_and_says_what_each_missed() -> None:
    system, motion = four_bar()
    off = np.zeros(18)
    off[12:15] = (0.03, 0.0, 0.04)  # the whole top, by 50 mm
    missed = {miss.joint: miss.gap for miss in system.misses(motion.moved(off))}
    assembled = system.assemble(motion.moved(off))
    expected = {"hinge left": 0, "hinge right": 0, "top left": 0.05, "top right": 0.05}
    check("missed [m]", list(missed.values()), list(expected.values()), within=1e-15)
    assert list(missed) == list(expected)
    after = system.misses(assembled)
    check("left open [m]", [m.gap for m in after], 0.0, within=2e-12)
    check("left open (cosine)", [m.tilt for m in after], 0.0, within=2e-12)


def test_joints_that_cannot_be_closed_are_named() -> None:
    body = rod("rod", 1.0, 2.0, 1.0)
    system = System(
        (body,),
        (
            Spherical("near", SPACE, "rod", at_j=(-1, 0, 0)),
            Spherical("far", SPACE, "rod", (5, 0, 0), (1, 0, 0)),
        ),
    )
    with pytest.raises(InputError, match="joint '(near|far)' misses by 1.5 m"):
        system.assemble(system.start())


def test_velocity_projection_keeps_what_joints_allow() -> None:
    """A mass on a rail along x: the velocity along stays, the others go; a drive sets its own."""
    body = rod("slider", 1.0, 1.0, 0.0)
    rail = System((body,), (Prismatic("rail", SPACE, "slider"),))
    moving = rail.start().with_velocities(np.array([2.0, 3.0, 4.0, 0.1, 0.2, 0.3]))
    projected = rail.project_velocities(moving)
    check("velocities", projected.velocities, (2, 0, 0, 0, 0, 0), within=1e-14)
    drive = PrescribedPoint("drive", "slider", steady(0.0, 5.0), along=(1, 0, 0))
    driven = rail.with_joints(drive).project_velocities(moving)
    check("driven", driven.velocities, (5, 0, 0, 0, 0, 0), within=1e-13)
    against = PrescribedPoint("brake", "slider", Constant(0.0), along=(1, 0, 0))
    with pytest.raises(InputError, match="contradict each other"):
        rail.with_joints(drive, against).project_velocities(moving)


def test_names_must_be_different_and_known() -> None:
    body = rod("rod", 1.0, 2.0, 1.0)
    joint = PointOnLine("same", SPACE, "rod")
    with pytest.raises(InputError, match="different names.*same"):
        System((body,), (joint, joint))
    system = System((body,), (joint,), (Gravity((1.0,)),))
    with pytest.raises(InputError, match="no force 'lift'"):
        system.with_force_changed("lift", force=3.0)
    assert system.with_force_changed("gravity", acceleration=1.6).forces == (Gravity((1.0,), 1.6),)


def test_system_without_joints_is_free() -> None:
    system = System((rod("rod", 2.0, 1.0, 0.0),), (), (Gravity((2.0,), G),))
    motion = system.start()
    assert system.assemble(motion) is motion
    assert system.project_velocities(motion) is motion
    check(
        "falls", system.accelerations(motion, 0.0).acceleration, (0, 0, -G, 0, 0, 0), within=1e-14
    )


# --- equilibrium, actuator calibration and equivalent mass of systems that can be done by hand ----


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


# --- least squares and null spaces ----------------------------------------------------------------


@pytest.mark.parametrize("rank", [1, 3, 5])
def test_the_smallest_solution_of_a_matrix_of_any_rank(rank: int) -> None:
    rng = np.random.default_rng(rank)
    matrix = rng.normal(size=(7, rank)) @ rng.normal(size=(rank, 5))
    right = rng.normal(size=(7, 2))
    expected = np.linalg.pinv(matrix) @ right
    # Numbers of the order of one, condition numbers below 1e3.
    assert least_squares(matrix, right, 1e-8) == pytest.approx(expected, abs=1e6 * EPS)
    free = null_space(matrix)
    assert free.shape == (5, 5 - rank)
    assert matrix @ free == pytest.approx(np.zeros((7, 5 - rank)), abs=1e3 * EPS)
    assert free.T @ free == pytest.approx(np.eye(5 - rank), abs=1e2 * EPS)


def test_without_equations_all_is_free() -> None:
    assert null_space(np.zeros((0, 3))) == pytest.approx(np.eye(3))
    assert null_space(np.zeros((2, 3))).shape == (3, 3)
