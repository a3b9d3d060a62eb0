"""Compiled loops of a step in two passes; see ``two_pass_step``.

They take what belongs together as tuples, named as in ``StationPasses``.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import addressed, compiled, inner
from catenary.solver.base.kernels.pointers import call_held, held_at, pointed
from catenary.solver.integrators.state_kernels import reserves_within
from catenary.solver.linear.factors.substitution import eliminate, meet, solved
from catenary.solver.linear.stations.lanes import (
    add,
    add_scaled,
    is_by_mass,
    load,
    remembers,
    same_part,
    store,
    widened,
    zero,
)
from catenary.solver.linear.stations.make_ups import by_make_up, start_of
from catenary.solver.linear.stations.station_products import read_station, row_sums
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
def go_on(layout, at, solution, motion, changes):
    """Take the rank's own station, whose first unknown is ``at``, from one prediction to the next:
    ``kernels.correct`` and ``predict`` at once. What was solved for is its acceleration but for
    damping on mass, and for its share of x if the right-hand side was made by M."""
    x, y, z = motion[:3]
    if is_by_mass(layout):
        solution = add_scaled(solution, changes[10], load(layout, x, at))
    if remembers(layout):
        go_on_by_alpha(layout, at, solution, motion, changes)
        return
    dt, by_position, by_velocity, damping_share = changes[:4]
    v = load(layout, y, at)
    a = add_scaled(solution, -damping_share, v)
    store(layout, z, at, a)
    ahead = add_scaled(add_scaled(load(layout, x, at), -dt, v), by_position, a)
    store(layout, x, at, ahead)
    store(layout, y, at, add_scaled(v, by_velocity, a))


@inner
def go_on_by_alpha(layout, at, solution, motion, changes):
    """The same for the generalized-alpha method; see ``AlphaAhead``."""
    x, y, z, _, known, _ = motion
    before, then = load(layout, z, at), load(layout, known, at)
    known_now = add_scaled(add_scaled(zero(layout), changes[4], before), changes[5], then)
    v = add_scaled(add_scaled(load(layout, y, at), changes[6], before), changes[7], then)
    b = add_scaled(solution, -changes[3], v)
    total = add_scaled(add_scaled(zero(layout), changes[8], b), changes[9], known_now)
    ahead = add_scaled(add_scaled(load(layout, x, at), -changes[0], v), changes[1], b)
    store(layout, known, at, known_now)
    store(layout, x, at, add_scaled(ahead, -1.0, total))
    store(layout, y, at, add_scaled(v, changes[2], b))
    store(layout, z, at, total)


@by_make_up
def eliminate_row(
    layout,
    places,
    station,
    multiplied,
    factored,
    loads,
    towards_end,
    states,
    outward,
    answer,
):
    """``eliminate`` with the right-hand side from a row of the product, and of ``loads`` if there
    are any; ``states`` are what ``read_station`` gives to the start, at and to the end of it."""
    to_start, here, to_end = states
    positions, velocities = (to_start[0], here[0], to_end[0]), (to_start[1], here[1], to_end[1])
    of_product = same_part(multiplied[0], layout)
    sums = row_sums(of_product, multiplied, station, positions, velocities)
    if loads[1]:
        loaded = load(layout, loads[0], start_of(layout, places, station))
        sums = add(sums[0], loaded), sums[1]
    return eliminate(layout, factored, sums, station, towards_end, outward, answer)


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


@by_make_up
def go_back(layout, places, station, factored, inward, answer, motion, changes):
    """Solve for an own station from those ``inward`` of it, and take its motion on."""
    own = solved(layout, factored, station, inward, answer)
    at = start_of(layout, places, station) - start_of(layout, places, factored.low)
    go_on(layout, at, own, motion, changes)
    return widened(layout, own)


@by_make_up
def begin_back(layout, places, middle, factored, answer, motion, changes):
    """Take the motion of the middle station on, for which ``meet`` has solved."""
    here = start_of(layout, places, middle)
    own = load(layout, answer, here)
    go_on(layout, here - start_of(layout, places, factored.low), own, motion, changes)
    return widened(layout, own)


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


@inner
def ends_of(ends):
    """Ends of the stations that are solved for and of the own ones, and the middle."""
    return ends[0], ends[1], ends[2], ends[3], ends[4]


@inner
def end_after(layout, pairs, ends, chain, x, y):
    """Go back after as many ``pairs`` of stations through those that one side has more: one, or as
    many as the middle lies off."""
    _, known, _, found, moved, changes = chain
    _, _, low, high, middle = ends
    for i in range(middle - pairs - 1, low - 1, -1):
        x = go_back(layout, known.places, i, known, x, found, moved, changes)
    for j in range(middle + pairs + 1, high):
        y = go_back(layout, known.places, j, known, y, found, moved, changes)


@addressed
def forth_and_back(place):
    """Both passes, over the stations in a window if there is one; see ``StationPasses``.

    Forth they leave in ``answer`` what elimination leaves of the right-hand side. Back they take
    the rank's own motion on, and let ``following`` find the reserve of its links after each
    ``stretch`` of stations. What is ``ahead``, ``predict``, comes first. Both are called by their
    addresses: they are the same for all layouts, and take as long to compile as the passes.
    """
    multiplied, factored, loads, answer, motion, changes, stretch, ahead, following = held_at(place)
    call_held(ahead)
    layout, ends = factored.layout, ends_of(factored.ends)
    begin, end, low, high, middle = ends
    product, known, found, moved = pointed((multiplied, factored, answer, motion))
    added, places = (pointed(loads), loads.size > 0), known.places
    chain = product, known, added, found, moved, changes
    pairs = min(middle - begin, end - 1 - middle)
    x = y = zero(layout)
    before, here = read_station(product, begin - 1), read_station(product, begin)
    beyond, there = read_station(product, end), read_station(product, end - 1)
    for k in range(pairs):
        i, j = begin + k, end - 1 - k
        after, ahead = read_station(product, i + 1), read_station(product, j - 1)
        states, others = (before, here, after), (ahead, there, beyond)
        x = eliminate_row(layout, places, i, product, known, added, False, states, x, found)
        y = eliminate_row(layout, places, j, product, known, added, True, others, y, found)
        before, here, beyond, there = here, after, there, ahead
    # Written out: as a function of its own this costs 2 % of a step.
    for j in range(end - 1 - pairs, middle, -1):
        ahead = read_station(product, j - 1)
        others = ahead, there, beyond
        y = eliminate_row(layout, places, j, product, known, added, True, others, y, found)
        beyond, there = there, ahead
    for i in range(begin + pairs, middle + 1):
        after = read_station(product, i + 1)
        states = before, here, after
        x = eliminate_row(layout, places, i, product, known, added, False, states, x, found)
        before, here = here, after
    meet(layout, places, middle, known, y, found)

    pairs = min(middle - low, high - 1 - middle)
    x = y = begin_back(layout, places, middle, known, found, moved, changes)
    for start in range(1, pairs + 1, stretch):
        for k in range(start, min(start + stretch, pairs + 1)):
            x = go_back(layout, places, middle - k, known, x, found, moved, changes)
            y = go_back(layout, places, middle + k, known, y, found, moved, changes)
        if start + stretch <= pairs:
            call_held(following)
    end_after(layout, pairs, ends, chain, x, y)
    call_held(following)
