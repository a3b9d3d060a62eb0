"""Multibody systems against closed forms and minimal coordinates, by all constraint methods."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import energy, reaction, rod
from constraint_handling import (
    AugmentedLagrangian,
    Baumgarte,
    ConstraintHandling,
    CoordinatePartitioning,
)
from driven_angle import DrivenAngle
from measuring import check
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from variable_steps import integrate

from catenary.mbs.rigid.bodies import SPACE, Body, point
from catenary.mbs.rigid.forces import Gravity, SpringDamper
from catenary.mbs.rigid.joints import Prismatic, Revolute, RevolutePrismatic, Spherical, steady
from catenary.mbs.rigid.system import System

G = 9.81
METHODS: list[ConstraintHandling] = [
    Baumgarte(),
    AugmentedLagrangian(),
    CoordinatePartitioning(),
]
each_method = pytest.mark.parametrize("handling", METHODS, ids=lambda m: type(m).__name__)


@each_method
def test_period_of_a_pendulum_that_swings_far(handling: ConstraintHandling) -> None:
    """A rod let go level: T = 4 K(sin(45 deg)) sqrt(2 L / (3 g)); after T it is back, at rest.

    Integrated to 1e-10 a step, some 100 steps.
    """
    length = 1.2
    period = 4 * ellipk(0.5) * np.sqrt(2 * length / (3 * G))
    system = System(
        (rod("rod", 2.0, length, length / 2),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (Gravity((2.0,), G),),
    )
    times = np.linspace(0.0, period, 9)
    way = integrate(system, handling, system.start(), times, rtol=1e-10, atol=1e-10)
    height = [motion.position[0, 2] for motion in way.motions]
    check("at T / 4, lowest [m]", height[2], -length / 2, within=1e-8)
    check("at T / 2, level again [m]", height[4], 0.0, within=1e-8)
    tip = point(way.motions[4], "rod", (length / 2, 0, 0)).value
    check("at T / 2, tip [m]", tip, (-length, 0, 0), within=1e-8)
    tip = point(way.motions[8], "rod", (length / 2, 0, 0)).value
    check("at T, tip [m]", tip, (length, 0, 0), within=1e-8)
    energies = [energy(system, motion) for motion in way.motions]
    check("energy [J]", energies, 0.0, within=2.0 * G * length * 1e-8)


@each_method
def test_double_pendulum_moves_like_its_two_angles(handling: ConstraintHandling) -> None:
    """Two rods from level, against SciPy on angles a, b below x: all within 1e-8 for 1.5 s.

    I_a a'' + c cos(a - b) b'' + c sin(a - b) b'^2 = (m_1 / 2 + m_2) g l_1 cos a, and
    I_b b'' + c cos(a - b) a'' - c sin(a - b) a'^2 = m_2 g l_2 / 2 cos b,
    with I_a = m_1 l_1^2 / 3 + m_2 l_1^2, I_b = m_2 l_2^2 / 3, c = m_2 l_1 l_2 / 2.
    """
    m1, m2, l1, l2 = 1.5, 0.8, 0.7, 1.1
    inertia_a, inertia_b, c = (m1 / 3 + m2) * l1**2, m2 * l2**2 / 3, m2 * l1 * l2 / 2

    def angles(time: float, y: np.ndarray) -> np.ndarray:
        a, b, da, db = y
        cosine, sine = c * np.cos(a - b), c * np.sin(a - b)
        right = [
            (m1 / 2 + m2) * G * l1 * np.cos(a) - sine * db**2,
            m2 * G * l2 / 2 * np.cos(b) + sine * da**2,
        ]
        second = np.linalg.solve([[inertia_a, cosine], [cosine, inertia_b]], right)
        return np.array([da, db, *second])

    times = np.linspace(0.0, 1.5, 7)
    exact = solve_ivp(
        angles, (0, times[-1]), np.zeros(4), "DOP853", t_eval=times, rtol=1e-12, atol=1e-12
    ).y
    system = System(
        (rod("upper", m1, l1, l1 / 2), rod("lower", m2, l2, l1 + l2 / 2)),
        (
            Revolute("hinge", SPACE, "upper", at_j=(-l1 / 2, 0, 0)),
            Revolute("elbow", "upper", "lower", (l1 / 2, 0, 0), (-l2 / 2, 0, 0)),
        ),
        (Gravity((m1, m2), G),),
    )
    way = integrate(system, handling, system.start(), times, rtol=1e-11, atol=1e-11)
    elbow = np.array([point(m, "lower", (-l2 / 2, 0, 0)).value for m in way.motions])
    tip = np.array([point(m, "lower", (l2 / 2, 0, 0)).value for m in way.motions])
    a, b = exact[0], exact[1]
    at_elbow = l1 * np.stack([np.cos(a), 0 * a, -np.sin(a)], axis=1)
    at_tip = at_elbow + l2 * np.stack([np.cos(b), 0 * b, -np.sin(b)], axis=1)
    check("elbow [m]", elbow, at_elbow, within=1e-8)
    check("tip [m]", tip, at_tip, within=1e-8)
    spins = np.array([motion.spin[:2, 1] for motion in way.motions])
    check("angular velocities [rad/s]", spins, exact[2:].T, within=1e-7)
    print(f"{way.n_evaluations} evaluations, joints open by {way.position_error.max():.1e} m")


@each_method
def test_slider_crank_at_constant_speed(handling: ConstraintHandling) -> None:
    """x = r cos(wt) + sqrt(l^2 - r^2 sin^2(wt)); the crank's angle is prescribed."""
    r, length, speed = 0.3, 0.8, 5.0
    crank, link = rod("crank", 1.0, r, r / 2), rod("link", 1.0, length, r + length / 2)
    slider = Body("slider", 2.0, (0.01, 0.01, 0.01), (r + length, 0, 0))
    system = System(
        (crank, link, slider),
        (
            Revolute("main", SPACE, "crank", at_j=(-r / 2, 0, 0)),
            Revolute("pin", "crank", "link", (r / 2, 0, 0), (-length / 2, 0, 0)),
            Spherical("gudgeon", "link", "slider", (length / 2, 0, 0)),
            Prismatic("guide", SPACE, "slider"),
            DrivenAngle("drive", SPACE, "crank", steady(0.0, speed)),
        ),
    )
    start = system.start()
    # A plane mechanism held by hinges: the guide alone already keeps the slider in the plane.
    assert system.redundant(start) == ("guide (1)",)
    assert system.n_degrees_of_freedom(start) == 0
    times = np.linspace(0.0, 2 * np.pi / speed, 13)
    way = integrate(system, handling, start, times)
    turn = speed * times
    root = np.sqrt(length**2 - (r * np.sin(turn)) ** 2)
    expected = r * np.cos(turn) + root
    found = np.array([motion.position[2, 0] for motion in way.motions])
    # Corrected at these times: to the tolerance of the projection.
    check("slider [m]", found, expected, within=1e-11)
    velocity = -r * speed * np.sin(turn) * (1 + r * np.cos(turn) / root)
    found = np.array([motion.velocity[2, 0] for motion in way.motions])
    check("its velocity [m/s]", found, velocity, within=1e-10)
    # At the outer dead centre the slider has the acceleration - r w^2 (1 + r / l), along the link.
    solution = system.accelerations(way.motions[0], 0.0)
    dead_centre = -r * speed**2 * (1 + r / length)
    check("at dead centre [m/s^2]", solution.acceleration[12], dead_centre, within=1e-10)
    force = reaction(system, "gudgeon", "slider", way.motions[0], solution.multipliers).force
    check("force on the slider [N]", force[0], 2.0 * dead_centre, within=1e-9)


@each_method
def test_four_bar_linkage_turns_its_rocker_as_freudenstein_says(
    handling: ConstraintHandling,
) -> None:
    """Crank a, coupler b, rocker c, frame d: the rocker's end is where two circles meet."""
    a, b, c, d = 0.3, 0.9, 0.7, 0.8
    speed = 4.0

    def rocker_pin(angle: np.ndarray) -> np.ndarray:
        """End of the rocker (n, 2): distance b from the crank's pin, c from (d, 0), above."""
        pin = a * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        to_foot = np.array([d, 0.0]) - pin
        far = np.linalg.norm(to_foot, axis=-1, keepdims=True)
        way = to_foot / far
        forward = (b**2 - c**2 + far**2) / (2 * far)
        up = np.stack([-way[:, 1], way[:, 0]], axis=-1)
        return pin + forward * way + np.sqrt(b**2 - forward**2) * up

    end = rocker_pin(np.zeros(1))[0]

    def between(name: str, start: np.ndarray, stop: np.ndarray) -> Body:
        """A rod in the x-z plane; turning by -angle about y brings x up to the angle."""
        length = float(np.linalg.norm(stop - start))
        angle = np.arctan2(stop[1] - start[1], stop[0] - start[0])
        centre = (start + stop) / 2
        moment = length**2 / 12
        turn = (0, -np.sin(angle / 2), 0)
        return Body(name, 1.0, (1e-3, moment, moment), (centre[0], 0, centre[1]), turn)

    system = System(
        (
            between("crank", np.zeros(2), np.array([a, 0.0])),
            between("coupler", np.array([a, 0.0]), end),
            between("rocker", np.array([d, 0.0]), end),
        ),
        (
            Revolute("foot of the crank", SPACE, "crank", at_j=(-a / 2, 0, 0)),
            Revolute("crank pin", "crank", "coupler", (a / 2, 0, 0), (-b / 2, 0, 0)),
            Revolute("foot of the rocker", SPACE, "rocker", (d, 0, 0), (-c / 2, 0, 0)),
            Spherical("rocker pin", "coupler", "rocker", (b / 2, 0, 0), (c / 2, 0, 0)),
            DrivenAngle("drive", SPACE, "crank", steady(0.0, -speed)),
        ),
    )
    assert system.n_degrees_of_freedom(system.start()) == 0
    times = np.linspace(0.0, 2 * np.pi / speed, 13)
    way = integrate(system, handling, system.start(), times)
    found = np.array([point(m, "rocker", (c / 2, 0, 0)).value for m in way.motions])
    expected = rocker_pin(speed * times)
    check("rocker pin [m]", found[:, [0, 2]], expected, within=1e-11)
    assert np.ptp(expected[:, 0]) > 0.3, "the rocker swings far"


def test_free_body_keeps_angular_momentum_and_energy() -> None:
    """Spun near its middle axis it tumbles; L in space and T are kept to the integration's error.

    1e-11 a step, some hundred steps, angular velocities of 8 rad/s, inertias to 3 kg m^2.
    """
    inertia = np.array([1.0, 2.0, 3.0])
    system = System((Body("box", 2.0, inertia),), ())
    start = system.start().with_velocities(np.array([0, 0, 0, 0.1, 8.0, 0.1]))
    way = integrate(system, Baumgarte(), start, np.linspace(0, 4, 21), rtol=1e-11, atol=1e-11)
    momenta = np.array([m.rotation[0] @ (inertia * m.spin[0]) for m in way.motions])
    check("L [kg m^2/s]", momenta, inertia * start.spin[0], within=1e-7)
    energies = [energy(system, motion) for motion in way.motions]
    check("energy [J]", energies, energy(system, start), within=1e-7)
    middle = [motion.spin[0, 1] for motion in way.motions]
    assert min(middle) < -7.0, "it tumbles"
    check("norm of Euler parameters", 1.0 + way.norm_error, 1.0, within=1e-9)


@each_method
def test_sprung_slider_swings_like_the_damped_oscillator(handling: ConstraintHandling) -> None:
    """A mass on an upright guide that may turn: z = y exp(-d t) (cos wt + d / w sin wt)."""
    mass, stiffness, damping, free, start = 2.0, 500.0, 8.0, 1.0, 0.06
    rest = free - mass * G / stiffness
    body = Body("head", mass, (0.1, 0.1, 0.1), (0, 0, rest + start))
    system = System(
        (body,),
        (RevolutePrismatic("guide", SPACE, "head"),),
        (
            Gravity((mass,), G),
            SpringDamper("strut", SPACE, "head", (0, 0, 0), (0, 0, 0), stiffness, free, damping),
        ),
    )
    assert system.n_degrees_of_freedom(system.start()) == 2
    decay = damping / (2 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)
    times = np.linspace(0, 1.0, 11)
    way = integrate(system, handling, system.start(), times, rtol=1e-10, atol=1e-11)
    swing = np.cos(omega * times) + decay / omega * np.sin(omega * times)
    exact = rest + start * np.exp(-decay * times) * swing
    heights = [motion.position[0, 2] for motion in way.motions]
    # Some 1e-11 a step, 40 steps.
    check("height [m]", heights, exact, within=1e-8)


@pytest.mark.study
def test_methods_keep_the_joints_without_corrections() -> None:
    """Uncorrected, a pendulum's joint opens by integration errors only, by any method.

    Without feedback (Baumgarte's constants zero) it opens further: errors grow like t^2.
    """
    length = 1.0
    system = System(
        (rod("rod", 1.0, length, length / 2),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (Gravity((1.0,), G),),
    )
    times = np.array([0.0, 10.0])
    opened = {}
    for handling in (Baumgarte(0.0, 0.0), *METHODS):
        way = integrate(
            system, handling, system.start(), times, rtol=1e-6, atol=1e-6, correct=False
        )
        name = type(handling).__name__ if handling in METHODS else "no feedback"
        opened[name] = float(way.position_error.max())
        print(f"{name}: open by {opened[name]:.2e} m after 10 s, {way.n_evaluations} evaluations")
    for name in ("Baumgarte", "AugmentedLagrangian"):
        assert opened[name] < opened["no feedback"] / 10
        assert opened[name] < 1e-4
