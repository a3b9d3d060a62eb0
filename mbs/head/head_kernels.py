"""The loops of a pantograph's step, compiled by Numba: both models, tables, paths.

A pantograph has n coordinates and s strips. Its state are positions, velocities and accelerations
one after the other (3 n,). ``touch`` (2, s, n) says by how much each coordinate raises each strip,
and how fast that changes; ``out`` (2 s + 2 s^2,) takes the strips' heights and velocities and both
matrices of compliance, row by row. Numba keeps the compiled code beside the sources (or in the
user's cache), so that only the first run waits.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.compiled import compiled


@compiled
def respond(inverse, by_place, by_speed, touch, free, by_force, out):
    """Answer (3 n, s) of the state to contact forces, and the strips without and with them.

    ``inverse`` (n, n) gives accelerations; positions and velocities are ``by_place`` and
    ``by_speed`` times these. ``free`` (3 n,) is the state without contact.
    """
    n, s = inverse.shape[0], touch.shape[1]
    for j in range(s):
        for i in range(n):
            answer = 0.0
            for k in range(n):
                answer += inverse[i, k] * touch[0, j, k]
            by_force[i, j] = by_place * answer
            by_force[n + i, j] = by_speed * answer
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


@compiled
def linear_step(
    step, by_drive, inverse, by_place, by_speed, touch, state, free, by_force, out, drive
):
    """A step without contact of a linear system: ``free`` = ``step`` state + drive by_drive."""
    for i in range(state.size):
        value = drive * by_drive[i]
        for k in range(state.size):
            value += step[i, k] * state[k]
        free[i] = value
    respond(inverse, by_place, by_speed, touch, free, by_force, out)


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
def raising_step(
    newmark,
    drive,
    masses,
    stiffness,
    damping,
    breaks,
    coefficients,
    touch,
    state,
    free,
    by_force,
    out,
):
    """A step without contact of a head over a mechanism, whose height is the last coordinate.

    Returns the height of the mechanism at which its tables were taken.

    Parameters
    ----------
    newmark : dt, dt^2 (1/2 - beta), dt (1 - gamma), beta dt^2, gamma dt
    drive : part of the full lift, the head's weight [N], height of the mechanism's zero [m], and
        height [m], velocity [m/s] and acceleration [m/s^2] of the base on top of it
    masses, stiffness, damping : (n,), (n, n), (n, n) of all but the mechanism itself
    coefficients : of mass [kg], lift [N], damping [N s/m] and carried mass [kg]; see `table_at`
    """
    dt, ahead, faster, by_place, by_speed = newmark
    raised, weight, zero, base, base_speed, base_acceleration = drive
    n = masses.size
    last = n - 1
    position, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        position[i] = state[i] + dt * state[n + i] + ahead * state[2 * n + i]
        velocity[i] = state[n + i] + faster * state[2 * n + i]
    height = position[last] - zero - base
    speed = velocity[last] - base_speed
    values, slopes = np.empty(4), np.empty(4)
    table_at(breaks, coefficients, height, values, slopes)
    mass, lift, slowing, carried = values
    matrix = np.empty((n, n))
    for i in range(n):
        value = 0.0
        for k in range(n):
            value -= stiffness[i, k] * position[k] + damping[i, k] * velocity[k]
            matrix[i, k] = by_speed * damping[i, k] + by_place * stiffness[i, k]
        force[i] = value
        matrix[i, i] += masses[i]
    force[last] += raised * (lift - weight) - slowing * speed - 0.5 * slopes[0] * speed**2
    # The base carries the mechanism along, but less of it than what is raised if parts stay low.
    force[last] += (mass - carried) * base_acceleration
    matrix[last, last] += mass + by_speed * (slowing + slopes[0] * speed)
    matrix[last, last] -= by_place * raised * slopes[1]
    invert(matrix)
    for i in range(n):
        acceleration = 0.0
        for k in range(n):
            acceleration += matrix[i, k] * force[k]
        free[i] = position[i] + by_place * acceleration
        free[n + i] = velocity[i] + by_speed * acceleration
        free[2 * n + i] = acceleration
    respond(matrix, by_place, by_speed, touch, free, by_force, out)
    return height


@compiled
def invert(matrix):
    """Invert in place a matrix whose masses outweigh all else, or that is positive definite."""
    n = matrix.shape[0]
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        matrix[k, k] = 1.0
        for j in range(n):
            matrix[k, j] *= pivot
        for i in range(n):
            if i != k:
                share = matrix[i, k]
                matrix[i, k] = 0.0
                for j in range(n):
                    matrix[i, j] -= share * matrix[k, j]


@compiled
def take(free, by_force, contact_force, state):
    """The state under contact forces (s,)."""
    for i in range(state.size):
        value = free[i]
        for j in range(contact_force.size):
            value -= contact_force[j] * by_force[i, j]
        state[i] = value


@compiled
def extrapolate(newmark, touch, state, early):
    """Heights and velocities (2, s) of the strips by Newmark's predictor (paper eq. 2.5)."""
    dt, ahead, faster, _, _ = newmark
    n = state.size // 3
    for i in range(touch.shape[1]):
        height, velocity = 0.0, 0.0
        for k in range(n):
            place = state[k] + dt * state[n + k] + ahead * state[2 * n + k]
            height += touch[0, i, k] * place
            velocity += touch[0, i, k] * (state[n + k] + faster * state[2 * n + k])
            velocity += touch[1, i, k] * place
        early[0, i], early[1, i] = height, velocity
