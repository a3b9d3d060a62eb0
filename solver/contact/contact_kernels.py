"""The compiled loops of a step where the train is: places on the wire, and what the line answers.

A touch is a record of ``TOUCH``, a node of the contact wire one of ``NODE``: a loop takes them as
one argument each, and what it reads of one stands together. Not collective; see `base.compiled` for
how they are compiled.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.contact.line_response import COUPLINGS, FLAGS, NUMBER, TENSION
from catenary.solver.integrators.state_kernels import (
    compiled,
    displacement_at,
    in_line,
    velocity_at,
)
from catenary.solver.model.shape_functions import shape_slopes, shape_values

# A node of the contact wire: where it is along the track [m]; of its unknowns (w, theta_y) the
# numbers on this rank, 0 where another rank owns them, whether this one does, and what they are at
# rest [m], [-]; the columns of A^-1 for both, one after the other from ``at`` on and ``width`` long
# each, for the local unknowns from ``begin`` on.
NODE = np.dtype(
    [
        ("x", np.float64),
        ("local", np.int64, (2,)),
        ("owned", np.float64, (2,)),
        ("rest", np.float64, (2,)),
        ("begin", np.int64),
        ("at", np.int64),
        ("width", np.int64),
    ]
)

# A place on the contact wire: where it is along the track [m], and the number of its element along
# the wire; of the element's four unknowns the numbers on this rank, 0 where another rank owns them,
# the Hermite functions N and dN/dx, 0 where not owned here and without regard to that, and what
# they are at rest [m], [-]; the first and one after the last of the local unknowns that answer to a
# force here.
TOUCH = np.dtype(
    [
        ("x", np.float64),
        ("element", np.int64),
        ("local", np.int64, (4,)),
        ("value", np.float64, (4,)),
        ("slope", np.float64, (4,)),
        ("whole_value", np.float64, (4,)),
        ("whole_slope", np.float64, (4,)),
        ("rest", np.float64, (4,)),
        ("filled", np.int64, (2,)),
    ]
)


@compiled
def locate(x, nodes, touches):
    """Make ``touches`` those at places ``x`` (n,) [m].

    A node belongs to the element that it ends.
    """
    for i in range(x.size):
        touch = touches[i]
        place = x[i]
        # Mostly the element of the step before, or the next one.
        e = touch.element
        while e < nodes.size - 2 and nodes[e + 1].x < place:
            e += 1
        while e > 0 and nodes[e].x >= place:
            e -= 1
        length = nodes[e + 1].x - nodes[e].x
        xi = (place - nodes[e].x) / length
        values, slopes = shape_values(xi, length), shape_slopes(xi, length)
        touch.x, touch.element = place, e
        for k in range(4):
            node, unknown = nodes[e + k // 2], k % 2
            touch.local[k] = node.local[unknown]
            touch.rest[k] = node.rest[unknown]
            touch.whole_value[k], touch.whole_slope[k] = values[k], slopes[k]
            touch.value[k] = values[k] * node.owned[unknown]
            touch.slope[k] = slopes[k] * node.owned[unknown]


@in_line
def add_columns(node, data, by_height, by_slope, answer):
    """Add the weighted columns of a node's two unknowns."""
    width, begin, at = node.width, node.begin, node.at
    for j in range(width):
        answer[begin + j] += by_height * data[at + j] + by_slope * data[at + width + j]


@in_line
def clear(answer, low, high):
    """Make the numbers from ``low`` to ``high`` zero."""
    for j in range(low, high):
        answer[j] = 0.0


@compiled
def place(x, nodes, data, touches, answers, slope_answers):
    """Make ``touches`` those at places ``x`` (n,) [m], and ``answers`` (n, n_local) the line's
    accelerations by a unit force at each.

    ``slope_answers`` are the answers' derivatives along the track, left alone if it has no columns;
    ``data`` holds the columns of the nodes.
    """
    for i in range(x.size):
        low, high = touches[i].filled
        clear(answers[i], low, high)
        if slope_answers.shape[1] > 0:
            clear(slope_answers[i], low, high)
    locate(x, nodes, touches)
    for i in range(x.size):
        touch = touches[i]
        low, high = answers.shape[1], 0
        for side in range(2):
            node = nodes[touch.element + side]
            if node.width == 0:
                continue
            by_height, by_slope = touch.whole_value[2 * side], touch.whole_value[2 * side + 1]
            add_columns(node, data, by_height, by_slope, answers[i])
            if slope_answers.shape[1] > 0:
                by_height, by_slope = touch.whole_slope[2 * side], touch.whole_slope[2 * side + 1]
                add_columns(node, data, by_height, by_slope, slope_answers[i])
            low = min(low, node.begin)
            high = max(high, node.begin + node.width)
        touch.filled[0], touch.filled[1] = min(low, high), high


@compiled
def heights(motion, touches, train_speed, height, rate):
    """Owned share of the wire's height and of its total rate dw/dt + V dw/dx at each touch."""
    for i in range(touches.size):
        touch = touches[i]
        w, rising, steep = 0.0, 0.0, 0.0
        for k in range(4):
            total = touch.rest[k]
            if motion[0].size:
                total += displacement_at(touch.local[k], motion)
                rising += touch.value[k] * velocity_at(touch.local[k], motion)
            w += touch.value[k] * total
            steep += touch.slope[k] * total
        height[i] = w
        rate[i] = rising + train_speed * steep


@in_line
def answer_at(local, weights, answer):
    """Interpolation of an answer (n_local,), which may have no numbers."""
    total = 0.0
    if answer.size:
        for k in range(4):
            total += weights[k] * answer[local[k]]
    return total


@compiled
def meet(
    motion,
    touches,
    train_speed,
    position_factor,
    velocity_factor,
    answers,
    slope_answers,
    numbers,
):
    """A rank's share of heights, rates and what forces change of both; ``numbers`` as for
    ``inner_kernels.gap``.

    Returns whether heights and rates are numbers.
    """
    n = touches.size
    height, rate, by_force, rate_by_force = parts(numbers, n)
    heights(motion, touches, train_speed, height, rate)
    total = 0.0
    for i in range(n):
        touch = touches[i]
        total += height[i] + rate[i]
        for j in range(n):
            by_value = answer_at(touch.local, touch.value, answers[j])
            by_force[i, j] = position_factor * by_value
            if slope_answers.shape[1] > 0:
                by_slope = answer_at(touch.local, touch.slope, answers[j])
                rate_by_force[i, j] = (
                    train_speed * position_factor * by_slope + velocity_factor * by_value
                )
    return np.isfinite(total)


@in_line
def n_beyond(force, margin):
    """How many forces are below a margin, or no numbers."""
    count = 0
    for d in range(force.size):
        count += not (margin <= force[d] < np.inf)
    return count


@compiled
def watch(
    force,
    limits,
    numbers,
    ends,
    laws,
    touches,
    reach,
    answers,
    slope_answers,
    train_speed,
    position_factor,
    velocity_factor,
    rows,
):
    """Number of droppers whose tension may fall below a margin; a row each, as far as they fit.

    ``force`` (n,) is their tension if they could push; they stand in the order along the track.
    Contact i may press with up to ``limits[i]``, and touches those within ``reach`` of it; the last
    of the limits is the margin. -1 if a tension is no number.
    """
    count, n, uses_rate = 0, touches.size, slope_answers.shape[1] > 0
    margin = limits[n]
    low, high = touches[0].x, touches[0].x
    for i in range(1, n):
        low, high = min(low, touches[i].x), max(high, touches[i].x)
    first = np.searchsorted(laws[:, 3], low - reach)
    last = np.searchsorted(laws[:, 3], high + reach, side="right")
    # Mostly none is near its margin by itself: then those beyond reach are not looked at.
    begin, end = first, last
    if n_beyond(force, margin):
        begin, end = 0, force.size
    for d in range(begin, end):
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
                if abs(laws[d, 3] - touches[i].x) <= reach:
                    spread = answers[i, upper] - answers[i, lower]
                    if force[d] + per_acceleration * spread * limits[i] < margin:
                        candidate = True
                        break
        if not candidate:
            continue
        if count < rows.shape[0]:
            row = rows[count]
            row[NUMBER], row[TENSION] = numbers[d], force[d]
            for i in range(n):
                spread = answers[i, upper] - answers[i, lower]
                row[COUPLINGS + i] = per_acceleration * spread
                row[COUPLINGS + n + i] = position_factor * spread
                row[COUPLINGS + 2 * n + i] = 0.0
                if uses_rate:
                    slopes = slope_answers[i, upper] - slope_answers[i, lower]
                    row[COUPLINGS + 2 * n + i] = (
                        velocity_factor * spread + train_speed * position_factor * slopes
                    )
        count += 1
    return count


@compiled
def respond(
    motion,
    touches,
    train_speed,
    position_factor,
    velocity_factor,
    reach,
    answers,
    slope_answers,
    limits,
    numbers,
    ends,
    laws,
    force,
    summed,
    rows,
):
    """A rank's share of the inner problem, see ``LineResponse``; droppers as for ``watch``."""
    n = touches.size
    finite = meet(
        motion, touches, train_speed, position_factor, velocity_factor, answers, slope_answers,
        summed[FLAGS : FLAGS + 2 * n * (1 + n)],
    )  # fmt: skip
    # What is no number anywhere is one at the next dropper in the step after.
    count = -1
    if finite:
        count = watch(
            force, limits, numbers, ends, laws, touches, reach, answers, slope_answers,
            train_speed, position_factor, velocity_factor, rows,
        )  # fmt: skip
    room = rows.shape[0]
    summed[0] = min(max(count, 0), room)
    summed[2] = count < 0
    summed[3] = count if count > room else 0


@compiled
def superpose(force, answers, touches, motion, gains):
    """Add the answers to contact forces to the state.

    ``answers`` and ``touches`` are those of ``place``; ``motion`` and ``gains`` those of
    ``LineState``, the former as it is read.
    """
    x, y, z, _ = motion
    for i in range(force.size):
        f = force[i]
        if f != 0.0:
            low, high = touches[i].filled
            for j in range(low, high):
                change = f * answers[i, j]
                z[j] += gains[2] * change
                x[j] += gains[0] * change
                y[j] += gains[1] * change


@compiled
def compensate(numbers, compensation, start, offset, data, motion, gains):
    """Add the answers to compensations of some droppers to the state.

    ``data[offset[d] : offset[d + 1]]`` is the column of dropper d from the local unknown
    ``start[d]`` on; the rest as for ``superpose``.
    """
    x, y, z, _ = motion
    for k in range(numbers.size):
        d, f = numbers[k], compensation[k]
        begin = start[d] - offset[d]
        if f != 0.0:
            for j in range(offset[d], offset[d + 1]):
                change = f * data[j]
                z[begin + j] -= gains[2] * change
                x[begin + j] -= gains[0] * change
                y[begin + j] -= gains[1] * change


@compiled
def parts(numbers, n):
    """Depth, rate, by_force and rate_by_force of n contacts from what ``gap`` filled."""
    compliances = numbers[2 * n :].reshape((2, n, n))
    return numbers[:n], numbers[n : 2 * n], compliances[0], compliances[1]


@compiled
def write_outputs(force, reported, heads, depth, ends, outputs):
    """Contact force, head height and wire height of each pantograph, then the force of each strip.

    These are the 3 n_pantographs + n numbers of ``outputs``; ``heads`` are those of ``gap``.
    Pantograph p has the contacts from ``ends[p]`` to ``ends[p + 1]``: the sum of their forces, and
    the means of their heights.
    """
    n = ends.size - 1
    head_height, _, compliance, _ = parts(heads, force.size)
    for p in range(n):
        total, mean, mean_of_wire = 0.0, 0.0, 0.0
        for i in range(ends[p], ends[p + 1]):
            height = head_height[i]
            for j in range(ends[p], ends[p + 1]):
                height -= compliance[i, j] * force[j]
            total += reported[i]
            mean += height
            mean_of_wire += height - depth[i]
            outputs[3 * n + i] = reported[i]
        strips = ends[p + 1] - ends[p]
        outputs[p], outputs[n + p], outputs[2 * n + p] = total, mean / strips, mean_of_wire / strips
