"""Mechanics of multibody systems for tests: reactions, energies, masses, states, tables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import integrate, linalg
from scipy.interpolate import CubicSpline

from catenary import InputError
from catenary.mbs.mechanism.reduction import RaisingPantograph, ReducedMechanism
from catenary.mbs.rigid.bodies import Body, Law, Motion, Vector, normalised, point
from catenary.mbs.rigid.forces import BetweenPoints, BumpStop, Force, Gravity, SpringDamper
from catenary.mbs.rigid.joints import ORIGIN, TimeLaw, unit
from catenary.mbs.rigid.system import System, null_space


class LineBetween(NamedTuple):
    """The line between points of two bodies: its length [m], its rate [m/s], d length / d q."""

    length: float
    rate: float
    gradient: np.ndarray


def place_of(motion: Motion, body: str, local: Vector) -> tuple[np.ndarray, np.ndarray]:
    """Place of a point of a body (3,) [m] and its Jacobian (3, 6 n): translations in space axes,
    then turns in body axes, which move it by their cross products with its place in the body."""
    i, (x, y, z) = motion.numbers[body], local
    jacobian = np.zeros((3, 6 * motion.n_bodies + 6))
    turns = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    jacobian[:, 6 * i : 6 * i + 6] = np.hstack([np.eye(3), motion.rotation[i] @ turns])
    return motion.position[i] + motion.rotation[i] @ np.asarray(local), jacobian[:, :-6]


def line_of(force: BetweenPoints, motion: Motion) -> LineBetween:
    """The line along which a force acts, from the kinematics of its points."""
    (start, before), (end, behind) = (
        place_of(motion, body, at) for body, at in ((force.i, force.at_i), (force.j, force.at_j))
    )
    length = float(np.linalg.norm(end - start))
    gradient = (end - start) / length @ (behind - before)
    return LineBetween(length, float(gradient @ motion.velocities), gradient)


def generalised(force: Force, motion: Motion, time: float = 0.0) -> np.ndarray:
    """Generalised forces (6 n,) of a force alone, from the kinematics of its points."""
    if not isinstance(force, BetweenPoints):
        return force.generalised(motion, time)
    line, law = line_of(force, motion), force.pull
    pull = law.stiffness * (line.length - law.free_length) + law.damping * line.rate + law.preload
    pull += 0.0 if law.of_length is None else law.of_length(line.length)
    return np.asarray(-pull * line.gradient)


class Reaction(NamedTuple):
    """Force of a joint on a body, in space axes (3,) [N], and moment about the body's centre of
    mass, in body axes (3,) [N m]."""

    force: np.ndarray
    moment: np.ndarray


def reaction(
    system: System, joint: str, body: str, motion: Motion, multipliers: np.ndarray
) -> Reaction:
    """What a joint does to a body at time 0, of multipliers (m,) of all joints."""
    rows = system.row_ranges[joint]
    jacobian = system.constraints(motion, 0.0).jacobian[rows]
    force = -(jacobian.T @ multipliers[rows]).reshape(-1, 6)[motion.numbers[body]]
    return Reaction(force[:3], force[3:])


def stored_energy(force: Force, motion: Motion) -> float:
    """Elastic or potential energy of a force [J], weights counting from height zero; zero for a
    force that works from outside."""
    if isinstance(force, Gravity):
        return float(force.acceleration * np.dot(force.masses, motion.position[:-1, 2]))
    if isinstance(force, BumpStop):
        length = line_of(force, motion).length
        depth = max(force.shortest - length, length - force.longest, 0.0)
        return 0.5 * force.stiffness * depth**2
    if not isinstance(force, SpringDamper):
        return 0.0
    extension = line_of(force, motion).length - force.free_length
    if callable(force.stiffness):
        closely = {"epsabs": 1e-12, "epsrel": 1e-12, "limit": 200}
        return float(integrate.quad(force.stiffness, 0.0, extension, **closely)[0])
    return 0.5 * force.stiffness * extension**2


def energy(system: System, motion: Motion) -> float:
    """Kinetic energy, and the energy that all forces store [J]."""
    kinetic = 0.5 * float(system.mass @ motion.velocities**2)
    return kinetic + sum(stored_energy(force, motion) for force in system.forces)


def static_force(pantograph: RaisingPantograph, head_height: float, time: float = np.inf) -> float:
    """Force on a wire that holds the strips at this height at rest, fully raised [N].

    The head's springs give way under it. The air acts as it does at a ``time`` [s].
    """
    data, force = pantograph._data, 0.0
    frame, zero = data.frame, data.head.offset + data.base_height
    on_head, on_arm, on_bodies = np.zeros(3)
    if pantograph._air is not None:
        on_head, on_arm, on_bodies = pantograph._air.now(time)
        on_head += data.blown_head * on_bodies
    for _ in range(50):
        previous, below = force, force - on_head
        arm = head_height + below / data.head.stiffness + data.strips.compression(below) - zero
        (_, lift, _), _ = frame.at(arm)
        force = lift - data.head.weight + on_head + on_arm + on_bodies * frame.blown_at(arm)
        if abs(force - previous) <= 1e-10 * abs(force):
            return float(force)
    raise AssertionError("the head's springs give way faster than the lift falls")


def equivalent_mass(
    system: System,
    motion: Motion,
    body: str,
    at: Vector = ORIGIN,
    along: Vector = (0.0, 0.0, 1.0),
) -> float:
    """Mass [kg] that a suddenly growing force on a point feels along a direction in space.

    Bodies behind springs that the joints do not move along stand still and do not count.
    """
    free = null_space(system.constraints(motion, 0.0).jacobian)
    # Velocities of the point per velocity of each free motion.
    way = unit(along) @ point(motion, body, at).jacobian @ free
    if np.abs(way).max(initial=0.0) < 1e-9:
        raise InputError(f"The joints do not let body {body!r} move along {tuple(along)}.")
    mass = free.T @ (system.mass[:, None] * free)
    return float(1.0 / (way @ linalg.solve(mass, way, assume_a="pos")))


def acceleration(
    mechanism: ReducedMechanism, height: float, speed: float, push: float = 0.0
) -> float:
    """Acceleration upward [m/s^2] of a reduced mechanism at a height [m] and speed upward [m/s].

    ``push`` [N] is a further force on the point, upward.
    """
    (mass, lift, damping), (mass_slope, _, _) = mechanism.at(height)
    force = lift - damping * speed - 0.5 * mass_slope * speed**2 + push
    return float(force / mass)


def quaternion_product(p: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Euler parameters (..., 4) of the rotation r, in axes already rotated by p."""
    p0, p1, p2, p3 = np.moveaxis(p, -1, 0)
    r0, r1, r2, r3 = np.moveaxis(r, -1, 0)
    return np.stack(
        [
            p0 * r0 - p1 * r1 - p2 * r2 - p3 * r3,
            p0 * r1 + p1 * r0 + p2 * r3 - p3 * r2,
            p0 * r2 + p2 * r0 + p3 * r1 - p1 * r3,
            p0 * r3 + p3 * r0 + p1 * r2 - p2 * r1,
        ],
        axis=-1,
    )


def parameter_rates(parameters: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """dp/dt = 1/2 L^T omega' (..., 4) [1/s] of angular velocities in body axes (..., 3) [rad/s].

    Keeps p^T p for any p: the norm changes by the errors of integration only.
    """
    as_quaternion = np.concatenate([np.zeros((*spin.shape[:-1], 1)), spin], axis=-1)
    return 0.5 * quaternion_product(parameters, as_quaternion)


def place_rates(motion: Motion) -> np.ndarray:
    """Rates of positions and Euler parameters, shape (7 n,)."""
    rates = parameter_rates(motion.parameters, motion.spin)
    return np.hstack([motion.velocity, rates])[:-1].ravel()


def from_vector(pattern: Motion, state: np.ndarray) -> Motion:
    """The motion of an integrated ``state`` (13 n,), Euler parameters normalised."""
    n = pattern.n_bodies
    places = state[: 7 * n].reshape(n, 7).copy()
    places[:, 3:] = normalised(places[:, 3:])
    return pattern.restored(np.concatenate([places.ravel(), state[7 * n :]]))


def tabulated(times: Vector, values: Vector) -> TimeLaw:
    """A prescribed number from a table, by a cubic spline with free ends."""
    spline = CubicSpline(times, values, bc_type="natural")
    return lambda time: Law(*(float(spline(time, k)) for k in range(3)))


def rod(name: str, mass: float, length: float, x: float) -> Body:
    """A thin rod along x."""
    moment = mass * length**2 / 12
    return Body(name, mass, (1e-3 * moment, moment, moment), (x, 0.0, 0.0))
