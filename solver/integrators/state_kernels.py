"""The loops of a time step over a line, compiled by Numba: state updates and links.

Each works on this rank's arrays and knows nothing of MPI or PETSc. Not collective.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import called, compiled, in_line, inner


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


@in_line
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
def velocities(motion, result):
    """Fill in all of a rank's velocities; ``motion`` as ``LineState.read``."""
    for i in range(result.size):
        result[i] = velocity_at(i, motion)


@inner
def reserve_of_pair(vectors, shares, unknowns, weights, law, link):
    """Reserve of a link between two unknowns, in terms of these vectors with ``shares``."""
    x, y, z = vectors
    i, j = np.uint64(unknowns[link, 0]), np.uint64(unknowns[link, 1])
    u, v = weights[link, 0], weights[link, 1]
    of_x, of_y, of_z = u * x[i] + v * x[j], u * y[i] + v * y[j], u * z[i] + v * z[j]
    stretch = shares[0] * of_x + shares[1] * of_y + shares[2] * of_z
    speed = shares[3] * of_y + shares[4] * of_z
    return law.rest + law.stiffness * stretch + law.damping * speed


@inner
def reserve_of_many(vectors, shares, unknowns, weights, law, link):
    """The same of a link between any number of unknowns."""
    x, y, z = vectors
    of_x, of_y, of_z = 0.0, 0.0, 0.0
    for k in range(unknowns.shape[1]):
        at, u = unknowns[link, k], weights[link, k]
        of_x, of_y, of_z = of_x + u * x[at], of_y + u * y[at], of_z + u * z[at]
    stretch = shares[0] * of_x + shares[1] * of_y + shares[2] * of_z
    speed = shares[3] * of_y + shares[4] * of_z
    return law.rest + law.stiffness * stretch + law.damping * speed


@called
def reserves_within(motion, links, begin, end, result):
    """Reserves of the links from ``begin`` to ``end``, as ``reserves``."""
    x, y, z, shares = motion
    unknowns, weights, laws = links
    known = shares[0], shares[1], shares[2], shares[3], shares[4]
    if unknowns.shape[1] == 2:
        # Droppers alone, mostly: without a loop over unknowns this takes half the time.
        for number in range(begin, end):
            # Unsigned, so that no index is checked for counting from the end.
            link = np.uint64(number)
            law = laws[link]
            result[link] = reserve_of_pair((x, y, z), known, unknowns, weights, law, link)
        return
    for number in range(begin, end):
        link = np.uint64(number)
        law = laws[link]
        result[link] = reserve_of_many((x, y, z), known, unknowns, weights, law, link)


@compiled
def reserves(motion, links, result):
    """What is left to each of ``links`` until it switches [N]: for a dropper its tension as if it
    could push.

    ``links`` are ``LinkArrays`` of local unknowns; ``motion`` is ``LineState.read``.
    """
    reserves_within(motion, links, 0, result.size, result)


@compiled
def motion_within(motion, begin, end, displacement, velocity):
    """Fill in displacements and velocities of the unknowns from ``begin`` to ``end``; ``motion`` as
    ``LineState.read``."""
    x, y, z, shares = motion
    # Counted from zero, so that loops become such of vector instructions.
    part = x[begin:end], y[begin:end], z[begin:end], shares
    displacements(part, displacement[begin:end])
    velocities(part, velocity[begin:end])


class Riders(NamedTuple):
    """What goes with links that switch: ``links`` (``LinkArrays``) of m riders, of which those from
    ``begin[d]`` to ``begin[d + 1]`` go with link d, ``begin`` (n + 1,)."""

    links: Any
    begin: np.ndarray


@compiled
def energy_of_switching(displacement, links, riders, begin, end):
    """What elastic energy lacks where links from ``begin`` to ``end`` have switched, and what goes
    with them [J], were they springs."""
    energy = 0.0
    unknowns, weights, laws = links
    for link in range(begin, end):
        law, stretch = laws[link], 0.0
        for k in range(unknowns.shape[1]):
            stretch += weights[link, k] * displacement[unknowns[link, k]]
        if law.stiffness == 0.0:  # of what slips nothing is stored
            continue
        beyond = min(law.rest + law.stiffness * stretch, 0.0)
        energy -= law.released * beyond**2 / (2.0 * law.stiffness)
        if beyond < 0.0:
            for r in range(riders.begin[link], riders.begin[link + 1]):
                own, across = riders.links.law[r], 0.0
                for k in range(riders.links.unknowns.shape[1]):
                    at = riders.links.unknowns[r, k]
                    across += riders.links.weights[r, k] * displacement[at]
                energy -= 0.5 * own.released * own.stiffness * across**2
    return energy


@inner
def share_of(law, reserve):
    """Share of its reserve with which a link pulls."""
    return law.carried - law.released if reserve < 0.0 else law.carried


@called
def forces_within(motion, links, begin, end, result):
    """Force of each of the links from ``begin`` to ``end`` [N], positive where it pulls."""
    x, y, z, shares = motion
    unknowns, weights, laws = links
    known = shares[0], shares[1], shares[2], shares[3], shares[4]
    if unknowns.shape[1] == 2:
        for number in range(begin, end):
            link = np.uint64(number)
            law = laws[link]
            reserve = reserve_of_pair((x, y, z), known, unknowns, weights, law, link)
            result[link] = reserve * share_of(law, reserve)
        return
    for number in range(begin, end):
        link = np.uint64(number)
        law = laws[link]
        reserve = reserve_of_many((x, y, z), known, unknowns, weights, law, link)
        result[link] = reserve * share_of(law, reserve)


class Shown(NamedTuple):
    """What is shown of a rank's part of the line at the end of a step.

    Attributes
    ----------
    motion : ``LineState.read``
    arms : (k,) int, unknowns of vertical displacement at steady arms
    droppers, others : ``LinkArrays`` of droppers and of all other links
    other_force : (m,) room for the forces of the latter [N]
    columns : ``Columns`` of arms, droppers and others
    """

    motion: tuple[Any, ...]
    arms: np.ndarray
    droppers: Any
    others: Any
    other_force: np.ndarray
    columns: Any


@compiled
def show(shown, uplift, dropper_force, begin, end):
    """Displacement at arms, forces of droppers and of other links [N], as far as they follow from
    stations from ``begin`` to ``end``; ``shown`` is ``Shown``."""
    motion, arms = shown.motion, shown.arms
    first, last = shown.columns.first[begin], shown.columns.last[end]
    for i in range(first[0], last[0]):
        uplift[i] = displacement_at(arms[i], motion)
    forces_within(motion, shown.droppers, first[1], last[1], dropper_force)
    if shown.other_force.size:
        forces_within(motion, shown.others, first[2], last[2], shown.other_force)
