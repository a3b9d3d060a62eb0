"""The loops of a pantograph's step, compiled by Numba: both models, tables, paths.

A pantograph has n coordinates and s strips. Its state are positions, velocities and accelerations
one after the other (3 n,).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.mbs.head.law_kernels import settle
from catenary.solver.base.kernels.compiled import compiled, in_line, inner
from catenary.solver.base.kernels.inverse import invert

# Columns of a row of what a head depends on in a step besides its state. A chain of lumped masses
# has the first three alone, the forces on its last mass and on its head [N] and, of a regulated
# lift, the part that acts, and with laws those of the base; a reduced mechanism has the part of the
# full lift, the head's weight [N], the height of its zero [m], height [m], velocity [m/s] and
# acceleration [m/s2] of the base on top of it, upward forces of the air on its head and on its arm
# [N], and what the air lifts by its bodies in parts of the table's.
FORCE, HEAD_FORCE, PART = range(3)
LIFTED, WEIGHT, ZERO, BASE, BASE_VELOCITY, BASE_ACCELERATION, HEAD_AIR, ARM_AIR, BODIES_AIR = range(
    9
)
N_DRIVE = 9
# Columns of a mechanism's tables: mass, lift, damping, carried mass; of some, what the air lifts.
N_COLUMNS, LIFTED_BY_AIR = 4, 4


class NewmarkFactors(NamedTuple):
    """Factors of Newmark's formulas, the same for all coordinates.

    Attributes
    ----------
    dt : step [s]
    predict_position, predict_velocity : of the acceleration at the start, dt^2 (1/2 - beta) [s2]
        and dt (1 - gamma) [s]
    position, velocity : of the acceleration at the end, beta dt^2 [s2] and gamma dt [s]
    """

    dt: float
    predict_position: float
    predict_velocity: float
    position: float
    velocity: float


class HeadArrays(NamedTuple):
    """Arrays of a head, the head's own.

    Attributes
    ----------
    touch : (2, s, n) by how much each coordinate raises each strip, and how fast that changes
    state : (3 n,) at the end of the latest step
    free : (3 n,) of the coming step without contact
    by_force : (3 n, s) what a unit of each contact force takes off it
    out : (2 s + 2 s^2,) heights and velocities of the strips without contact, and both matrices
        of compliance, row by row
    """

    touch: np.ndarray
    state: np.ndarray
    free: np.ndarray
    by_force: np.ndarray
    out: np.ndarray


class LinearStep(NamedTuple):
    """A step of a linear system without contact, of which forces F are on carrier and head:
    new state = matrix @ state + F_carrier by_drive + F_head by_head.

    Attributes
    ----------
    matrix, by_drive, by_head : (3 n, 3 n), (3 n,), (3 n,)
    inverse : (n, n) of the matrix that gives accelerations
    """

    matrix: np.ndarray
    by_drive: np.ndarray
    by_head: np.ndarray
    inverse: np.ndarray


class RaisedHead(NamedTuple):
    """A head over a reduced mechanism, whose height is the last coordinate.

    Attributes
    ----------
    masses, stiffness, damping : (n,), (n, n), (n, n) of all but the mechanism itself
    push : (n,) what an upward force on the strips' middle does to each coordinate
    breaks, coefficients : (m,), (m - 1, k, 4) tables of mass [kg], lift [N], damping [N s/m],
        carried mass [kg] and, where k is 5, what the air lifts [N] over the mechanism's height [m];
        see `table_at`
    """

    masses: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    push: np.ndarray
    breaks: np.ndarray
    coefficients: np.ndarray


class Chain(NamedTuple):
    """A lumped chain with laws: ``masses`` (n,), ``stiffness`` and ``damping`` (n, n); ``push``
    (n,) what an upward force on the strips' middle does to each coordinate; ``carrier`` (n,) is 1
    for the coordinate that is driven."""

    masses: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    push: np.ndarray
    carrier: np.ndarray


@inner
def respond(inverse, newmark, head):
    """Fill ``head.by_force`` and ``head.out`` for accelerations by ``inverse`` (n, n)."""
    touch, free, by_force, out = head.touch, head.free, head.by_force, head.out
    n, s = inverse.shape[0], touch.shape[1]
    for j in range(s):
        for i in range(n):
            answer = 0.0
            for k in range(n):
                answer += inverse[i, k] * touch[0, j, k]
            by_force[i, j] = newmark.position * answer
            by_force[n + i, j] = newmark.velocity * answer
            by_force[2 * n + i, j] = answer
    for i in range(s):
        height, velocity = 0.0, 0.0
        for k in range(n):
            height += touch[0, i, k] * free[k]
            velocity += touch[0, i, k] * free[n + k] + touch[1, i, k] * free[k]
        out[i], out[s + i] = height, velocity
        for j in range(s):
            height, velocity = 0.0, 0.0
            for k in range(n):
                height += touch[0, i, k] * by_force[k, j]
                velocity += touch[0, i, k] * by_force[n + k, j] + touch[1, i, k] * by_force[k, j]
            at = 2 * s + i * s + j
            out[at], out[at + s * s] = height, velocity


@in_line
def linear_step(linear, newmark, head, drive, added):
    """Step a head without contact, with a row ``drive`` whose first two numbers are forces.

    ``added`` [N] is what a controller adds to the static force.
    """
    state, free = head.state, head.free
    lift = drive[FORCE]
    if added != 0.0:
        lift += drive[PART] * added
    for i in range(state.size):
        value = lift * linear.by_drive[i] + drive[HEAD_FORCE] * linear.by_head[i]
        for k in range(state.size):
            value += linear.matrix[i, k] * state[k]
        free[i] = value
    respond(linear.inverse, newmark, head)


@compiled
def table_at(breaks, coefficients, x, values, slopes):
    """Values and slopes (m,) of m cubic splines at ``x``; their ends go on beyond the breaks.

    ``coefficients`` (n - 1, m, 4), the highest power first.
    """
    i = min(max(np.searchsorted(breaks, x, side="right") - 1, 0), breaks.size - 2)
    d = x - breaks[i]
    for k in range(values.size):
        c3, c2, c1, c0 = coefficients[i, k]
        values[k] = ((c3 * d + c2) * d + c1) * d + c0
        slopes[k] = (3.0 * c3 * d + 2.0 * c2) * d + c1


@compiled
def raising_step(raised, laws, newmark, head, drive, added):
    """Step a head over a mechanism without contact, with a row ``drive`` (N_DRIVE,).

    ``laws`` are `laws.LawArrays`, of none or some; ``added`` [N] is what a controller adds
    to the static force.

    Returns the height of the mechanism at which its tables were taken [m].
    """
    masses, stiffness, damping = raised.masses, raised.stiffness, raised.damping
    state, free = head.state, head.free
    n = masses.size
    last = n - 1
    position, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        acceleration = state[2 * n + i]
        position[i] = state[i] + newmark.dt * state[n + i] + newmark.predict_position * acceleration
        velocity[i] = state[n + i] + newmark.predict_velocity * acceleration
    height = position[last] - drive[ZERO] - drive[BASE]
    speed = velocity[last] - drive[BASE_VELOCITY]
    n_columns = raised.coefficients.shape[1]
    values, slopes = np.empty(n_columns), np.empty(n_columns)
    table_at(raised.breaks, raised.coefficients, height, values, slopes)
    mass, lift, slowing, carried = values[0], values[1], values[2], values[3]
    matrix = np.empty((n, n))
    for i in range(n):
        value = 0.0
        for k in range(n):
            value -= stiffness[i, k] * position[k] + damping[i, k] * velocity[k]
            matrix[i, k] = newmark.velocity * damping[i, k] + newmark.position * stiffness[i, k]
        force[i] = value + drive[HEAD_AIR] * raised.push[i]
        matrix[i, i] += masses[i]
    lifted = drive[LIFTED]
    force[last] += (
        lifted * (lift - drive[WEIGHT] + added) - slowing * speed - 0.5 * slopes[0] * speed**2
    )
    # The base carries the mechanism along, but less of it than what is raised if parts stay low.
    force[last] += (mass - carried) * drive[BASE_ACCELERATION]
    matrix[last, last] += mass + newmark.velocity * (slowing + slopes[0] * speed)
    matrix[last, last] -= newmark.position * lifted * slopes[1]
    force[last] += drive[ARM_AIR]
    if n_columns > N_COLUMNS:
        force[last] += drive[BODIES_AIR] * values[LIFTED_BY_AIR]
        matrix[last, last] -= newmark.position * drive[BODIES_AIR] * slopes[LIFTED_BY_AIR]
    if laws.zero.size:
        base = drive[BASE], drive[BASE_VELOCITY]
        settle(laws, newmark, head, position, velocity, base, force, matrix)
    else:
        invert(matrix)
    for i in range(n):
        acceleration = 0.0
        for k in range(n):
            acceleration += matrix[i, k] * force[k]
        free[i] = position[i] + newmark.position * acceleration
        free[n + i] = velocity[i] + newmark.velocity * acceleration
        free[2 * n + i] = acceleration
    respond(matrix, newmark, head)
    return height


@compiled
def chain_step(chain, laws, newmark, head, drive, added):
    """Step a chain with laws without contact, with a row ``drive`` (N_DRIVE,).

    ``added`` [N] is what a controller adds to the static force.
    """
    state, free = head.state, head.free
    n = chain.masses.size
    lift = drive[FORCE]
    if added != 0.0:
        lift += drive[PART] * added
    position, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        acceleration = state[2 * n + i]
        position[i] = state[i] + newmark.dt * state[n + i] + newmark.predict_position * acceleration
        velocity[i] = state[n + i] + newmark.predict_velocity * acceleration
    matrix = np.empty((n, n))
    for i in range(n):
        value = lift * chain.carrier[i] + drive[HEAD_FORCE] * chain.push[i]
        for k in range(n):
            value -= chain.stiffness[i, k] * position[k] + chain.damping[i, k] * velocity[k]
            matrix[i, k] = (
                newmark.velocity * chain.damping[i, k] + newmark.position * chain.stiffness[i, k]
            )
        force[i] = value
        matrix[i, i] += chain.masses[i]
    base = drive[BASE], drive[BASE_VELOCITY]
    settle(laws, newmark, head, position, velocity, base, force, matrix)
    for i in range(n):
        acceleration = 0.0
        for k in range(n):
            acceleration += matrix[i, k] * force[k]
        free[i] = position[i] + newmark.position * acceleration
        free[n + i] = velocity[i] + newmark.velocity * acceleration
        free[2 * n + i] = acceleration
    respond(matrix, newmark, head)


@compiled
def bend(touch, breaks, coefficients, first, wires, place, rate):
    """Let strips that bend touch at places (s,) that move with a rate [m], [m/s].

    ``touch`` (2, s, n) and the tables of m modes; those of the strips are the coordinates from
    ``first`` on. ``wires`` may touch each strip.
    """
    s, m = touch.shape[1], coefficients.shape[1]
    values, slopes = np.empty(m), np.empty(m)
    for j in range(s):
        table_at(breaks, coefficients, place[j], values, slopes)
        at = first + (j // wires) * m
        for k in range(m):
            touch[0, j, at + k] = values[k]
            touch[1, j, at + k] = slopes[k] * rate[j]


@in_line
def take(head, contact_force):
    """Make ``head.state`` the state under contact forces (s,), after a step without."""
    for i in range(head.state.size):
        value = head.free[i]
        for j in range(contact_force.size):
            value -= contact_force[j] * head.by_force[i, j]
        head.state[i] = value


@compiled
def extrapolate(newmark, head, early):
    """Heights and velocities (2, s) of the strips by Newmark's predictor (paper eq. 2.5)."""
    touch, state = head.touch, head.state
    n = state.size // 3
    for i in range(touch.shape[1]):
        height, velocity = 0.0, 0.0
        for k in range(n):
            acceleration = state[2 * n + k]
            place = state[k] + newmark.dt * state[n + k] + newmark.predict_position * acceleration
            height += touch[0, i, k] * place
            velocity += touch[0, i, k] * (state[n + k] + newmark.predict_velocity * acceleration)
            velocity += touch[1, i, k] * place
        early[0, i], early[1, i] = height, velocity
