"""The compiled loops of a step where the train is: places on the wire, and what the line answers.

A touch is a record of ``TOUCH``, a node of the contact wire one of ``NODE``: a loop takes them as
one argument each, and what it reads of one stands together. Not collective; see `base.compiled` for
how they are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import in_line, inner
from catenary.solver.contact.link_kernels import watch
from catenary.solver.integrators.state_kernels import displacement_at, velocity_at
from catenary.solver.model.elements.shape_functions import shape_slopes, shape_values

# Far more than the round-off of a position, far less than an element [m].
SLIP = 1e-6

# A node of a contact wire: where it is along the track and across it [m]; what its unknowns (w,
# theta_y) are at rest [m], [-]; where its columns of A^-1 for both begin, one after the other,
# ``width`` long each, for local unknowns from ``begin`` on; of its unknowns the numbers on this
# rank, 0 where another rank owns them, and whether this one does; whether an element joins it to
# the next one. As short as can be, since a line has very many.
NODE = np.dtype(
    [
        ("x", np.float64),
        ("y", np.float64),
        ("rest", np.float64, (2,)),
        ("at", np.int64),
        ("begin", np.int32),
        ("width", np.int32),
        ("local", np.int32, (2,)),
        ("owned", np.int8, (2,)),
        ("joined", np.int8),
    ],
    align=True,
)

# A sample of the running surface of a contact wire: where along the track [m], its height above the
# wire's axis [m] and its slope [-].
SAMPLE = np.dtype([("x", np.float64), ("height", np.float64), ("slope", np.float64)])

# A place of a strip on a contact wire, which is a candidate for a contact: the wire's first node
# and the one after its last; the strip's half length [m]; 1 if the wire is there on the strip, else
# 0, and so are then all functions; where it is along the track [m], and the number of the first
# node of its element; of the element's four unknowns the numbers on this rank, 0 where another rank
# owns them, the Hermite functions N and dN/dx, 0 where not owned here and without regard to that,
# and what they are at rest [m], [-]; of the samples of the wire's running surface the first, the
# one after the last and the one before the place; height [m] and slope [-] of that surface here;
# the first and one after the last of the local unknowns that answer to a force here.
TOUCH = np.dtype(
    [
        ("first", np.int64),
        ("end", np.int64),
        ("half_length", np.float64),
        ("present", np.float64),
        ("x", np.float64),
        ("element", np.int64),
        ("local", np.int64, (4,)),
        ("value", np.float64, (4,)),
        ("slope", np.float64, (4,)),
        ("whole_value", np.float64, (4,)),
        ("whole_slope", np.float64, (4,)),
        ("rest", np.float64, (4,)),
        ("samples", np.int64, (2,)),
        ("sample", np.int64),
        ("surface", np.float64, (2,)),
        ("filled", np.int64, (2,)),
    ]
)


class WireShapes(NamedTuple):
    """What there is of contact wires: ``nodes`` (n,) of ``NODE`` wire by wire, and samples of their
    running ``surface`` (m,) of ``SAMPLE``, ascending in each wire, none of a wire that has none."""

    nodes: np.ndarray
    surface: np.ndarray


class Answers(NamedTuple):
    """The line's accelerations by a unit force at each of n contacts.

    ``by_force`` (n, n_local); their derivatives along the track, ``slope`` of the same shape, or
    without columns where no law needs rates.
    """

    by_force: np.ndarray
    slope: np.ndarray


class Gains(NamedTuple):
    """What answers are worth within a step: of an acceleration ``position`` [s2] and ``velocity``
    [s]; the ``train_speed`` [m/s] of the convective part of rates; how far off links answer to a
    force, ``reach`` [m]."""

    train_speed: float
    position: float
    velocity: float
    reach: float


class ContactWork(NamedTuple):
    """Work of contact forces on the line, summed step by step.

    With load vectors b of unit forces at the contacts, velocities v and weights p, q a step adds

        h (p f_n b_n + q f_n+1 b_n+1) . (v_n + v_n+1) / 2,

    the work of the discrete motion by average acceleration. ``total`` (1,) [J], of what this rank
    owns of the wires; ``force`` (n,) [N] after the step before; ``local`` and ``value`` (n, 4) of
    the contacts then; ``before`` (n,) their b_n . v_n, and ``ahead`` (n,) b_n+1 . v_n [m/s];
    ``weights`` (3,) p, q and the step h [s].
    """

    total: np.ndarray
    force: np.ndarray
    local: np.ndarray
    value: np.ndarray
    before: np.ndarray
    ahead: np.ndarray
    weights: np.ndarray


@inner
def find_surface(place, surface, touch):
    """Height and slope of the running surface at a place, cubic between samples, zero beyond."""
    first, last = touch.samples[0], touch.samples[1] - 1
    touch.surface[0], touch.surface[1] = 0.0, 0.0
    if not (last > first and surface[first].x <= place <= surface[last].x):
        return
    # Mostly the interval of the step before, or one of the next.
    s = touch.sample
    while s < last - 1 and surface[s + 1].x < place:
        s += 1
    while s > first and surface[s].x >= place:
        s -= 1
    touch.sample = s
    before, after = surface[s], surface[s + 1]
    length = after.x - before.x
    xi = (place - before.x) / length
    values, slopes = shape_values(xi, length), shape_slopes(xi, length)
    touch.surface[0] = values[0] * before.height + values[1] * before.slope
    touch.surface[0] += values[2] * after.height + values[3] * after.slope
    touch.surface[1] = slopes[0] * before.height + slopes[1] * before.slope
    touch.surface[1] += slopes[2] * after.height + slopes[3] * after.slope


@in_line
def locate(x, wires, touches):
    """Make ``touches`` those at places ``x`` (n,) [m], each on its own of the ``WireShapes``.

    A node belongs to the element that it ends.
    """
    nodes, surface = wires
    for i in range(x.size):
        touch = touches[i]
        place, first, last = x[i], touch.first, touch.end - 1
        # Mostly the element of the step before, or the next one.
        e = touch.element
        while e < last - 1 and nodes[e + 1].x < place:
            e += 1
        while e > first and nodes[e].x >= place:
            e -= 1
        length = nodes[e + 1].x - nodes[e].x
        inside = nodes[first].x - SLIP <= place <= nodes[last].x + SLIP
        if nodes[e].joined == 0.0:
            length, inside = 1.0, False
        xi = (place - nodes[e].x) / length
        lateral = nodes[e].y + xi * (nodes[e + 1].y - nodes[e].y)
        present = 1.0 if inside and abs(lateral) <= touch.half_length else 0.0
        values, slopes = shape_values(xi, length), shape_slopes(xi, length)
        for k in range(4):
            values[k] *= present
            slopes[k] *= present
        touch.x, touch.element, touch.present = place, e, present
        for k in range(4):
            node, unknown = nodes[e + k // 2], k % 2
            touch.local[k] = node.local[unknown]
            touch.rest[k] = node.rest[unknown]
            touch.whole_value[k], touch.whole_slope[k] = values[k], slopes[k]
            touch.value[k] = values[k] * node.owned[unknown]
            touch.slope[k] = slopes[k] * node.owned[unknown]
        if surface.size:
            find_surface(place, surface, touch)


@inner
def put_columns(nodes, data, weights, answer, filled):
    """Make ``answer`` the weighted columns of two ``nodes`` beside each other, two of each, and
    zero elsewhere.

    ``filled`` is the range outside of which it is zero, before and after.
    """
    first, second = nodes[0], nodes[1]
    low, high = first.begin, first.begin + first.width
    last, end = second.begin, second.begin + second.width
    if not low <= last < high <= end:
        # One without columns, as beyond a run, or windows that do not overlap.
        clear(answer, filled[0], filled[1])
        filled[0], filled[1] = answer.size, 0
        for side in range(2):
            add_columns(nodes[side], data, weights[2 * side], weights[2 * side + 1], answer)
            if nodes[side].width > 0:
                filled[0] = min(filled[0], nodes[side].begin)
                filled[1] = max(filled[1], nodes[side].begin + nodes[side].width)
        filled[0] = min(filled[0], filled[1])
        return
    # Windows of neighbours are nearly the same: what both fill is written once.
    clear(answer, filled[0], min(filled[1], low))
    clear(answer, max(filled[0], end), filled[1])
    at, after = first.at, second.at
    a, b = data[at : at + first.width], data[at + first.width : at + 2 * first.width]
    c, d = data[after : after + second.width], data[after + second.width : after + 2 * second.width]
    before, both = last - low, high - last
    alone = answer[low:last]
    for j in range(alone.size):
        alone[j] = weights[0] * a[j] + weights[1] * b[j]
    shared, a, b = answer[last:high], a[before:], b[before:]
    for j in range(shared.size):
        of_first = weights[0] * a[j] + weights[1] * b[j]
        shared[j] = of_first + (weights[2] * c[j] + weights[3] * d[j])
    rest, c, d = answer[high:end], c[both:], d[both:]
    for j in range(rest.size):
        rest[j] = weights[2] * c[j] + weights[3] * d[j]
    filled[0], filled[1] = low, end


@inner
def add_columns(node, data, by_height, by_slope, answer):
    """Add the weighted columns of a node's two unknowns."""
    # Slices, whose indices are never negative: such loops become vector instructions.
    width, begin, at = node.width, node.begin, node.at
    changed = answer[begin : begin + width]
    first, second = data[at : at + width], data[at + width : at + 2 * width]
    for j in range(width):
        changed[j] += by_height * first[j] + by_slope * second[j]


@inner
def clear(answer, low, high):
    """Make the numbers from ``low`` to ``high`` zero, if there are any."""
    if low < high:
        cleared = answer[low:high]
        for j in range(cleared.size):
            cleared[j] = 0.0


@in_line
def place(x, wires, data, touches, answers):
    """Make ``touches`` those at places ``x`` (n,) [m], and ``answers`` those to forces there.

    ``data`` holds the columns of the nodes.
    """
    nodes = wires.nodes
    by_force, slope = answers
    locate(x, wires, touches)
    for i in range(x.size):
        touch = touches[i]
        if touch.present == 0.0:
            # Where there is no wire on a strip nothing answers.
            clear(by_force[i], touch.filled[0], touch.filled[1])
            if slope.shape[1] > 0:
                clear(slope[i], touch.filled[0], touch.filled[1])
            touch.filled[0] = touch.filled[1] = 0
            continue
        pair = nodes[touch.element : touch.element + 2]
        if slope.shape[1] > 0:
            low, high = touch.filled
            put_columns(pair, data, touch.whole_slope, slope[i], touch.filled)
            touch.filled[0], touch.filled[1] = low, high
        put_columns(pair, data, touch.whole_value, by_force[i], touch.filled)


@in_line
def heights(motion, touches, train_speed, height, rate):
    """Owned share of the wire's height and of its total rate dw/dt + V dw/dx at each touch."""
    for i in range(touches.size):
        touch = touches[i]
        w, rising, steep = 0.0, 0.0, 0.0
        for k in range(4 if touch.present != 0.0 else 0):
            total = touch.rest[k]
            if motion[0].size:
                total += displacement_at(touch.local[k], motion)
                rising += touch.value[k] * velocity_at(touch.local[k], motion)
            w += touch.value[k] * total
            steep += touch.slope[k] * total
        # Of the running surface the same share: functions of heights add up to one.
        share = touch.value[0] + touch.value[2]
        height[i] = w + share * touch.surface[0]
        rate[i] = rising + train_speed * (steep + share * touch.surface[1])


@inner
def answer_at(local, weights, answer):
    """Interpolation of an answer (n_local,), which may have no numbers."""
    total = 0.0
    if answer.size:
        for k in range(4):
            total += weights[k] * answer[local[k]]
    return total


@inner
def meet(motion, touches, gains, answers, line):
    """A rank's share of heights, rates and what forces add to both, into ``line`` (``Affine``).

    Returns whether heights and rates are finite.
    """
    by_force, by_slope = answers
    heights(motion, touches, gains.train_speed, line.place, line.rate)
    total = 0.0
    for i in range(touches.size):
        touch = touches[i]
        total += line.place[i] + line.rate[i]
        for j in range(touches.size):
            if touch.present == 0.0 or touches[j].present == 0.0:
                line.by_force[i, j] = line.rate_by_force[i, j] = 0.0
                continue
            by_value = answer_at(touch.local, touch.value, by_force[j])
            line.by_force[i, j] = gains.position * by_value
            if by_slope.shape[1] > 0:
                along = answer_at(touch.local, touch.slope, by_force[j])
                line.rate_by_force[i, j] = (
                    gains.train_speed * gains.position * along + gains.velocity * by_value
                )
    return np.isfinite(total)


@in_line
def respond(motion, touches, gains, answers, bounds, followed, share):
    """A rank's share of the small problem; links as for ``watch``."""
    for i in range(touches.size):
        share.present[i] = touches[i].present
    finite = meet(motion, touches, gains, answers, share.line)
    # A NaN elsewhere reaches the reserve of a link one step later and is caught there.
    count = -1
    if finite:
        count = watch(motion, followed, bounds, touches, answers, gains, share.rows)
    room, flags = share.rows.number.size, share.flags[0]
    flags.rows = min(max(count, 0), room)
    flags.broken = count < 0
    flags.missing = count if count > room else 0


@inner
def add_answer(force, answer, begin, motion, gains):
    """Add the answer to a force, of the unknowns from ``begin`` on, to the state."""
    size = answer.size
    x, y, z = (
        motion[0][begin : begin + size],
        motion[1][begin : begin + size],
        motion[2][begin : begin + size],
    )
    for j in range(size):
        change = force * answer[j]
        z[j] += gains[2] * change
        x[j] += gains[0] * change
        y[j] += gains[1] * change


@in_line
def superpose(force, answers, touches, motion, gains):
    """Add the answers to contact forces to the state.

    ``answers`` and ``touches`` are those of ``place``; ``motion`` and ``gains`` those of
    ``LineState``, the former as it is read.
    """
    by_force = answers.by_force
    for i in range(force.size):
        f = force[i]
        if f != 0.0:
            low, high = touches[i].filled
            add_answer(f, by_force[i, low:high], low, motion, gains)


@in_line
def compensate(numbers, compensation, start, at, width, data, motion, gains):
    """Add the answers to compensations of some links to the state.

    ``data[at[d] : at[d] + width[d]]`` is the column of link d from the local unknown ``start[d]``
    on; the rest as for ``superpose``.
    """
    for k in range(numbers.size):
        d, f = numbers[k], compensation[k]
        if f != 0.0:
            add_answer(-f, data[at[d] : at[d] + width[d]], start[d], motion, gains)


@inner
def velocity_of(local, value, motion):
    """This rank's share of the velocity of a place on a wire [m/s]."""
    total = 0.0
    if motion[0].size:
        for k in range(4):
            total += value[k] * velocity_at(local[k], motion)
    return total


@in_line
def begin_work(touches, motion, work):
    """Keep the velocities at the coming step's contacts; ``motion`` is that before the step."""
    for i in range(touches.size):
        touch = touches[i]
        work.ahead[i] = velocity_of(touch.local, touch.value, motion)


@in_line
def add_work(force, touches, motion, work):
    """Add the work that contact forces have done in the step which has ended; see ``ContactWork``.

    The wire's own velocity counts, without the convective part: the train pays for that part.
    """
    added = 0.0
    for i in range(force.size):
        touch = touches[i]
        behind = velocity_of(work.local[i], work.value[i], motion)
        now = velocity_of(touch.local, touch.value, motion)
        added += work.weights[0] * work.force[i] * (work.before[i] + behind)
        added += work.weights[1] * force[i] * (work.ahead[i] + now)
        work.force[i], work.before[i] = force[i], now
        for k in range(4):
            work.local[i, k], work.value[i, k] = touch.local[k], touch.value[k]
    work.total[0] += 0.5 * work.weights[2] * added
