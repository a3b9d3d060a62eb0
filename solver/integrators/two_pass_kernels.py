"""Compiled loops ahead of a step in two passes and along with it; see ``two_pass_step``."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import addressed, compiled, inner
from catenary.solver.base.kernels.pointers import held_at
from catenary.solver.integrators.state_kernels import reserves_within
from catenary.solver.window.window_kernels import look


@compiled
def predict_velocities(motion, changes, begin, end):
    """Fill in the velocities that the generalized-alpha method predicts from unknown ``begin`` to
    ``end``, if products read them."""
    _, y, z, _, known, predicted = motion
    # Slices, whose indices are never negative: such a loop becomes vector instructions.
    ahead = predicted[begin : min(end, predicted.size)]
    velocity, latest, before = y[begin:end], z[begin:end], known[begin:end]
    for i in range(ahead.size):
        ahead[i] = velocity[i] + changes[6] * latest[i] + changes[7] * before[i]


@inner
def is_within(unknowns, begin, end):
    """Whether all of a link's unknowns are in [begin, end)."""
    return begin <= unknowns.min() and unknowns.max() < end


@compiled
def left_behind(low, high, stretch, starts, unknowns):
    """Links that the pass back has left behind with each stretch, (n_stretches + 1, 2).

    They are those from the first of both numbers to the second, and have all their ``unknowns``
    (n, m) among what is known by then. Unknowns of a station begin at its ``starts`` (n_own + 1,),
    so that few wait for the next stretch. The last stretch is all that is left.
    """
    n, own, pairs = unknowns.shape[0], high - low, (high - low - 1) // 2
    middle = own // 2
    ranges = np.empty((1 + max(1, (pairs + stretch - 1) // stretch), 2), dtype=np.int64)
    first = last = np.searchsorted(unknowns[:, 0], starts[middle])
    ranges[0] = first
    for number in range(1, ranges.shape[0]):
        reach = min(number * stretch, pairs)
        begin, end = starts[middle - reach], starts[middle + reach + 1]
        if number == ranges.shape[0] - 1:
            begin, end = 0, starts[own]
        while first > 0 and is_within(unknowns[first - 1], begin, end):
            first -= 1
        while last < n and is_within(unknowns[last], begin, end):
            last += 1
        ranges[number, 0], ranges[number, 1] = first, last
    return ranges


@addressed
def follow(place):
    """Find the reserve of links that the next stretch of the pass back has left behind; how many
    stretches were followed is in ``count`` (1,)."""
    motion, links, reserve, ranges, count = held_at(place)
    before, now = ranges[count[0]], ranges[count[0] + 1]
    count[0] += 1
    reserves_within(motion, links, now[0], before[0], reserve)
    reserves_within(motion, links, before[1], now[1], reserve)


@addressed
def predict(place):
    """Predict the velocities that products read, in the ``window`` if there is one, which is moved
    on before where it has to be. No stretch is followed by then."""
    motion, changes, links, reserve, count, window = held_at(place)
    count[0] = 0
    first, last = 0, motion[0].size
    if window.state.size > 0:
        if look(window, motion[:4]):
            reserves_within(motion[:4], links, 0, reserve.size, reserve)
        first, last = window.starts[window.ends[0]], window.starts[window.ends[1]]
    predict_velocities(motion, changes, first, last)
