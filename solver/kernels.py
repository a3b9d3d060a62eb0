"""The loops of a time step, compiled by Numba: state updates, contacts, droppers, superposition.

Each works on this rank's arrays and knows nothing of MPI or PETSc. Not collective. Numba keeps
the compiled code beside the sources (or in the user's cache), so that only the first run waits.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from catenary.solver.elements import shape_slopes, shape_values

# Cancellation-free arithmetic matters more than the last per cent: no fastmath, same answer as
# the formulas and on every rank.
compiled = njit(cache=True, error_model="numpy")
# For the few lines that a loop is made of: no call is left of them.
in_line = njit(cache=True, error_model="numpy", forceinline=True)


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
def locate(
    start,
    way,
    x,
    nodes,
    local_of_node,
    owned,
    rest_of_node,
    element,
    local,
    value,
    slope,
    whole_value,
    whole_slope,
    rest,
):
    """Position ``x``, element, Hermite functions and unknowns after a ``way`` from each ``start``.

    See ``contact.Touches``.
    """
    for i in range(x.size):
        x[i] = start[i] + way
        e = min(max(np.searchsorted(nodes, x[i]) - 1, 0), nodes.size - 2)
        length = nodes[e + 1] - nodes[e]
        xi = (x[i] - nodes[e]) / length
        element[i] = e
        whole_value[i] = shape_values(xi, length)
        whole_slope[i] = shape_slopes(xi, length)
        for k in range(4):
            node, unknown = e + k // 2, k % 2
            local[i, k] = local_of_node[node, unknown]
            rest[i, k] = rest_of_node[node, unknown]
            value[i, k] = whole_value[i, k] * owned[node, unknown]
            slope[i, k] = whole_slope[i, k] * owned[node, unknown]


@in_line
def displacement_at(unknown, motion):
    """Displacement at one of a rank's unknowns; ``motion`` as ``Motion.read``."""
    x, y, z, shares = motion
    return shares[0] * x[unknown] + shares[1] * y[unknown] + shares[2] * z[unknown]


@in_line
def velocity_at(unknown, motion):
    """Velocity at one of a rank's unknowns; ``motion`` as ``Motion.read``."""
    _, y, z, shares = motion
    return shares[3] * y[unknown] + shares[4] * z[unknown]


@compiled
def heights(motion, local, value, slope, rest, train_speed, height, rate):
    """Owned share of the wire's height and of its total rate dw/dt + V dw/dx at each touch."""
    for i in range(local.shape[0]):
        w, rising, steep = 0.0, 0.0, 0.0
        for k in range(4):
            total = rest[i, k]
            if motion[0].size:
                total += displacement_at(local[i, k], motion)
                rising += value[i, k] * velocity_at(local[i, k], motion)
            w += value[i, k] * total
            steep += slope[i, k] * total
        height[i] = w
        rate[i] = rising + train_speed * steep


@compiled
def combine(elements, weights, first_node, start, offset, data, answers, filled):
    """Answer to a unit force in each element: columns of its four unknowns, weighted.

    ``data[offset[k] : offset[k + 1]]`` holds the two columns of node k one after the other, which
    begin at the local unknown ``start[k]``. ``answers`` (n, n_local) is cleared where it was
    ``filled`` (n, 2) and filled anew.
    """
    for i in range(elements.size):
        answers[i, filled[i, 0] : filled[i, 1]] = 0.0
        low, high = answers.shape[1], 0
        for side in range(2):
            node = elements[i] - first_node + side
            width = (offset[node + 1] - offset[node]) // 2
            if width == 0:
                continue
            begin, at = start[node], offset[node]
            by_height, by_slope = weights[i, 2 * side], weights[i, 2 * side + 1]
            for j in range(width):
                answers[i, begin + j] += by_height * data[at + j] + by_slope * data[at + width + j]
            low = min(low, begin)
            high = max(high, begin + width)
        filled[i, 0] = min(low, high)
        filled[i, 1] = high


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
    stiffness, damping and place; ``motion`` is ``Motion.read``.
    """
    for d in range(ends.shape[0]):
        result[d] = tension_of(d, motion, ends, laws)


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


@compiled
def influence(answers, local, weights, factor, result):
    """``result[i, j]`` = ``factor`` times the interpolation at touch i of the answer to force j."""
    for i in range(local.shape[0]):
        for j in range(answers.shape[0]):
            total = 0.0
            if answers.shape[1] > 0:
                for k in range(4):
                    total += weights[i, k] * answers[j, local[i, k]]
            result[i, j] = factor * total


@compiled
def meet(
    motion,
    local,
    value,
    slope,
    rest,
    train_speed,
    answers,
    slope_answers,
    uses_rate,
    position_factor,
    velocity_factor,
    height,
    rate,
    height_by_force,
    rate_by_force,
):
    """A rank's share of heights, rates and compliances at the touches.

    Returns whether the heights are numbers.
    """
    heights(motion, local, value, slope, rest, train_speed, height, rate)
    influence(answers, local, value, 1.0, height_by_force)
    if uses_rate:
        influence(answers, local, slope, train_speed * position_factor, rate_by_force)
    for i in range(height.size):
        for j in range(height.size):
            if uses_rate:
                rate_by_force[i, j] += velocity_factor * height_by_force[i, j]
            height_by_force[i, j] *= position_factor
    return np.isfinite(height.sum() + rate.sum())


@compiled
def watch(
    force,
    margin,
    bound,
    numbers,
    ends,
    laws,
    contact_x,
    reach,
    answers,
    slope_answers,
    uses_rate,
    train_speed,
    position_factor,
    velocity_factor,
    rows,
):
    """Number of droppers whose tension may fall below ``margin``; a row each, as far as they fit.

    ``force`` (n,) is their tension if they could push; they stand in the order along the track.
    Contact i may press with up to ``bound[i]`` and touches those within ``reach`` of it. -1 if a
    tension is no number.
    """
    count, n = 0, contact_x.size
    first = np.searchsorted(laws[:, 3], contact_x.min() - reach)
    last = np.searchsorted(laws[:, 3], contact_x.max() + reach, side="right")
    for d in range(force.size):
        # Also true for what is no number.
        candidate = not (margin <= force[d] < np.inf)
        if not (candidate or first <= d < last):
            continue
        if not np.isfinite(force[d]):
            return -1
        per_acceleration = laws[d, 1] * position_factor + laws[d, 2] * velocity_factor
        upper, lower = ends[d, 0], ends[d, 1]
        if not candidate:
            for i in range(n):
                if abs(laws[d, 3] - contact_x[i]) <= reach:
                    spread = answers[i, upper] - answers[i, lower]
                    if force[d] + per_acceleration * spread * bound[i] < margin:
                        candidate = True
                        break
        if not candidate:
            continue
        if count < rows.shape[0]:
            row = rows[count]
            row[0], row[1] = numbers[d], force[d]
            for i in range(n):
                spread = answers[i, upper] - answers[i, lower]
                row[2 + i] = per_acceleration * spread
                row[2 + n + i] = position_factor * spread
                row[2 + 2 * n + i] = 0.0
                if uses_rate:
                    slopes = slope_answers[i, upper] - slope_answers[i, lower]
                    row[2 + 2 * n + i] = (
                        velocity_factor * spread + train_speed * position_factor * slopes
                    )
        count += 1
    return count


@compiled
def respond(
    motion,
    local,
    value,
    slope,
    rest,
    contact_x,
    train_speed,
    answers,
    slope_answers,
    uses_rate,
    position_factor,
    velocity_factor,
    reach,
    bound,
    margin,
    numbers,
    ends,
    laws,
    may_slacken,
    force,
    height,
    rate,
    height_by_force,
    rate_by_force,
    rows,
):
    """A rank's share of the inner problem, see ``LineResponse``; ``force`` as for ``watch``.

    Returns the number of droppers that may slacken, -1 if something is no number.
    """
    finite = meet(
        motion, local, value, slope, rest, train_speed, answers, slope_answers, uses_rate,
        position_factor, velocity_factor, height, rate, height_by_force, rate_by_force,
    )  # fmt: skip
    if not finite:
        return -1
    # What is no number anywhere is one at the next dropper in the step after.
    if not may_slacken:
        return 0 if np.isfinite(force.sum()) else -1
    return watch(
        force, margin, bound, numbers, ends, laws, contact_x, reach, answers, slope_answers,
        uses_rate, train_speed, position_factor, velocity_factor, rows,
    )  # fmt: skip


@compiled
def superpose(
    force,
    answers,
    filled,
    numbers,
    compensation,
    start,
    offset,
    data,
    motion,
    gains,
):
    """Add the answers to contact forces and to compensations of some droppers to the state.

    ``data[offset[d] : offset[d + 1]]`` is the column of dropper d from the local unknown
    ``start[d]`` on; ``motion`` and ``gains`` are ``Motion.read`` and ``Motion.gains``.
    """
    x, y, z, _ = motion
    for i in range(force.size):
        f = force[i]
        if f != 0.0:
            for j in range(filled[i, 0], filled[i, 1]):
                change = f * answers[i, j]
                z[j] += change
                x[j] += gains[0] * change
                y[j] += gains[1] * change
    for k in range(numbers.size):
        d, f = numbers[k], compensation[k]
        begin = start[d] - offset[d]
        if f != 0.0:
            for j in range(offset[d], offset[d + 1]):
                change = f * data[j]
                z[begin + j] -= change
                x[begin + j] -= gains[0] * change
                y[begin + j] -= gains[1] * change


def warm_up() -> None:
    """Compile all kernels, or load them from Numba's cache, before the clock of a march starts."""
    reals, numbers = np.zeros(4), np.zeros(1, dtype=np.int64)
    one, table, places = np.zeros(1), np.zeros((1, 4)), np.zeros((1, 4), dtype=np.int64)
    nodes, range_filled = np.array([0.0, 1.0]), np.zeros((1, 2), dtype=np.int64)
    pairs, columns = np.zeros((2, 2)), np.zeros(0)
    predict(reals, reals, reals, reals, 1.0, 1.0, 1.0, 1.0)
    correct(reals, reals, reals, 1.0, 1.0, 1.0)
    locate(
        one,
        1.0,
        one,
        nodes,
        np.zeros((2, 2), dtype=np.int64),
        pairs,
        pairs,
        numbers,
        places,
        table,
        table,
        table,
        table,
        table,
    )
    motion = reals, reals, reals, np.zeros(5)
    heights(motion, places, table, table, table, 1.0, one, one)
    bounds = np.zeros(3, dtype=np.int64)
    combine(numbers, table, 0, bounds, bounds, columns, table, range_filled)
    square, none = np.zeros((1, 1)), np.zeros((1, 0))
    ends, laws = np.zeros((1, 2), dtype=np.int64), np.zeros((1, 4))
    tension(motion, ends, laws, one)
    show(motion, numbers, ends, laws, 0.0, one, one)
    respond(
        motion, places, table, table, table, one, 1.0, table, none, False, 1.0, 1.0, 1.0,
        one, 1.0, numbers, ends, laws, True, one, one, one, square, square, np.zeros((1, 5)),
    )  # fmt: skip
    superpose(
        one, table, range_filled, numbers, one, numbers, bounds, columns, motion, np.zeros(2)
    )  # fmt: skip
