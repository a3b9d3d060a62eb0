"""The loops of a time step over a line, compiled by Numba: state updates and droppers.

Each works on this rank's arrays and knows nothing of MPI or PETSc. Not collective.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.compiled import compiled, in_line


@compiled
def predict(displacement, velocity, acceleration, work, dt, c_position, c_velocity, c_work):
    """Predictions of eq. (2.5) in place; ``work`` becomes -(d + ``c_work`` v)."""
    for i in range(displacement.size):
        d = displacement[i] + dt * velocity[i] + c_position * acceleration[i]
        v = velocity[i] + c_velocity * acceleration[i]
        displacement[i] = d
        velocity[i] = v
        work[i] = -(d + c_work * v)


@compiled
def correct(displacement, velocity, acceleration, position_factor, velocity_factor, damping_share):
    """New displacement and velocity from predictions and acceleration (eq. 2.6).

    The acceleration still lacks -``damping_share`` v, the part of damping on mass.
    """
    if damping_share == 0.0:
        # Long lines wait for memory: what does not change is not written.
        for i in range(displacement.size):
            a = acceleration[i]
            velocity[i] += velocity_factor * a
            displacement[i] += position_factor * a
        return
    for i in range(displacement.size):
        # Through locals, so that the loop becomes one of vector instructions.
        v = velocity[i]
        a = acceleration[i] - damping_share * v
        acceleration[i] = a
        velocity[i] = v + velocity_factor * a
        displacement[i] += position_factor * a


@compiled
def shift(start, places, way):
    """Places a way ahead of where they started."""
    for i in range(start.size):
        places[i] = start[i] + way


@in_line
def displacement_at(unknown, motion):
    """Displacement at one of a rank's unknowns; ``motion`` as ``LineState.read``."""
    x, y, z, shares = motion
    return shares[0] * x[unknown] + shares[1] * y[unknown] + shares[2] * z[unknown]


@in_line
def velocity_at(unknown, motion):
    """Velocity at one of a rank's unknowns; ``motion`` as ``LineState.read``."""
    _, y, z, shares = motion
    return shares[3] * y[unknown] + shares[4] * z[unknown]


@compiled
def displacements(motion, result):
    """Fill in all of a rank's displacements; ``motion`` as ``LineState.read``."""
    for i in range(result.size):
        result[i] = displacement_at(i, motion)


@compiled
def displacements_of(unknowns, motion, result):
    """Displacements at some of a rank's unknowns; ``motion`` as ``LineState.read``."""
    for i in range(unknowns.size):
        result[i] = displacement_at(unknowns[i], motion)


@compiled
def velocities(motion, result):
    """Fill in all of a rank's velocities; ``motion`` as ``LineState.read``."""
    for i in range(result.size):
        result[i] = velocity_at(i, motion)


@in_line
def tension_of(dropper, motion, ends, laws):
    """Tension of one of the droppers of ``tension`` [N]."""
    # Unsigned, so that no index is asked whether it counts from the end.
    dropper = np.uint64(dropper)
    upper, lower = np.uint64(ends[dropper, 0]), np.uint64(ends[dropper, 1])
    stretch = displacement_at(upper, motion) - displacement_at(lower, motion)
    speed = velocity_at(upper, motion) - velocity_at(lower, motion)
    return laws[dropper, 0] + laws[dropper, 1] * stretch + laws[dropper, 2] * speed


@compiled
def tension(motion, ends, laws, result):
    """Tension N0 + k e + c e' of droppers as if they could push [N].

    ``ends`` (n, 2) holds local unknowns of upper and lower end, ``laws`` (n, 4) rest force,
    stiffness, damping and place; ``motion`` is ``LineState.read``.
    """
    for d in range(ends.shape[0]):
        result[d] = tension_of(d, motion, ends, laws)


@compiled
def energy_of_pushing(motion, ends, laws):
    """Elastic energy that the droppers of ``tension`` would hold by pushing, were they springs."""
    energy = 0.0
    for d in range(ends.shape[0]):
        upper, lower = ends[d, 0], ends[d, 1]
        stretch = displacement_at(upper, motion) - displacement_at(lower, motion)
        pushing = min(laws[d, 0] + laws[d, 1] * stretch, 0.0)
        energy += pushing**2 / (2.0 * laws[d, 1])
    return energy


@compiled
def show(motion, arms, ends, laws, kept, uplift, force):
    """Displacement at the unknowns ``arms``, and the tension of droppers that keep the share
    ``kept`` of what they would push [N]."""
    for i in range(arms.size):
        uplift[i] = displacement_at(arms[i], motion)
    tension(motion, ends, laws, force)
    for d in range(force.size):
        if force[d] < 0.0:
            force[d] *= kept
