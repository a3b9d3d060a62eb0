"""The compiled loops that let a window follow the train.

Stations outside of the window are at rest: no step reads or writes them, but for the ones beside
it, which are held where they are. Not collective.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import called, compiled, in_line, inner
from catenary.solver.linear.factors.meeting_station import middle_of, turn

# Numbers of ``WindowArrays.state``.
STEP, IS_FRESH = 0, 1
# Looks from one search for the largest motion to the next, once it has grown for as many.
_PEAK_EVERY = 64
# Shares of a window that fade, of what is behind the train and of what is ahead.
_BEHIND, _AHEAD = 0.85, 0.6
# Profile of what fades (Manolopoulos, 2002): where it would be infinite, its numbers, and how much
# of its length is taken.
_C = 2.62206
_A, _B = 1.0 - 16.0 / _C**3, (1.0 - 17.0 / _C**3) / _C**2
_TAKEN = 0.98
# Stations of the smallest window.
LEAST = 64


class WindowArrays(NamedTuple):
    """A window as kernels take it; without ``state`` there is none.

    Attributes
    ----------
    state : (2,) int, steps taken, and whether the whole line is still alive
    every, guard : steps between two looks, and stations that are looked at
    rule : (5,) share of the largest motion below which stations rest, 0 if spans decide; spans
        behind and ahead; how much fades at a look, see ``fade`` [m2]; 1 if what rests is made zero,
        0 if it stays where it is
    peak : (2,) largest of x and y of the motion
    contacts : (n,) where contacts are [m], by reference
    loaded : (2,) first and last place with a load [m]
    margin : how far around both a step and what switches in it reach [m]
    masts : (k,) where spans end [m]
    low, high : (n,) of stations, see ``Unknowns``
    starts : (n + 1,) first unknown of each station
    links_before : (n + 1,) how many links stand before each
    edges : (2, n + 1) where a window that is to begin, or end, at a station does so
    ends, kinds, turning : of ``StationFactors``
    links : (2,) the first link that may switch and the one after the last
    ranges : (2, 2) the same for the pass back, see ``two_pass_kernels.left_behind``
    known : what the motion keeps besides x, y and z, or nothing
    """

    state: np.ndarray
    every: int
    guard: int
    rule: np.ndarray
    peak: np.ndarray
    contacts: np.ndarray
    loaded: np.ndarray
    margin: float
    masts: np.ndarray
    low: np.ndarray
    high: np.ndarray
    starts: np.ndarray
    links_before: np.ndarray
    edges: np.ndarray
    ends: np.ndarray
    kinds: np.ndarray
    turning: tuple[np.ndarray, np.ndarray, np.ndarray]
    links: np.ndarray
    ranges: np.ndarray
    known: np.ndarray


_NO_NUMBERS = np.zeros(0, dtype=np.int64)
_NOTHING = np.zeros(0)
NO_WINDOW = WindowArrays(
    state=_NO_NUMBERS,
    every=1,
    guard=1,
    rule=_NOTHING,
    peak=_NOTHING,
    contacts=_NOTHING,
    loaded=_NOTHING,
    margin=0.0,
    masts=_NOTHING,
    low=_NOTHING,
    high=_NOTHING,
    starts=_NO_NUMBERS,
    links_before=_NO_NUMBERS,
    edges=np.zeros((2, 0), dtype=np.int64),
    ends=_NO_NUMBERS,
    kinds=np.zeros(0, dtype=np.int32),
    turning=(np.zeros(0, dtype=np.int32),) * 3,
    links=_NO_NUMBERS,
    ranges=np.zeros((0, 2), dtype=np.int64),
    known=_NOTHING,
)


@called
def look(window, motion):
    """Let the window follow contacts and motion, at some steps; whether it was the first look."""
    state = window.state
    step = state[STEP]
    state[STEP] = step + 1
    if step % window.every:
        return False
    is_fresh = state[IS_FRESH] != 0
    state[IS_FRESH] = 0
    n, rule, margin = window.low.size, window.rule, window.margin
    first, last = window.loaded[0], window.loaded[1]
    for i in range(window.contacts.size):
        first, last = min(first, window.contacts[i]), max(last, window.contacts[i])
    begin = np.searchsorted(window.high, first - margin)
    end = np.searchsorted(window.low, last + margin, side="right")
    if rule[0] > 0.0:
        looks = step // window.every
        if is_fresh or looks < _PEAK_EVERY or looks % _PEAK_EVERY == 0:
            find_peak(window, motion)
        begin, end = follow_motion(window, motion, begin, end)
    else:
        behind = place_of_span(window.masts, span_of(window.masts, first) - rule[1])
        ahead = place_of_span(window.masts, span_of(window.masts, last) + rule[2])
        begin = min(begin, np.searchsorted(window.high, behind))
        end = max(end, np.searchsorted(window.low, ahead, side="right"))
    end = window.edges[1, min(n, max(end, begin + LEAST))]
    begin = window.edges[0, max(0, min(begin, end - LEAST))]
    move(window, motion, begin, end)
    if rule[3] > 0.0:
        fade(window, motion, first, last)
    return is_fresh


@called
def span_of(masts, x):
    """Span in which a place [m] is, as a number with a fraction."""
    i = min(max(np.searchsorted(masts, x, side="right") - 1, 0), masts.size - 2)
    return i + (x - masts[i]) / (masts[i + 1] - masts[i])


@called
def place_of_span(masts, number):
    """Place [m] of a number with a fraction of spans; beyond the line if there are not as many."""
    i = min(max(int(np.floor(number)), 0), masts.size - 2)
    return masts[i] + (number - i) * (masts[i + 1] - masts[i])


@called
def find_peak(window, motion):
    """Find the largest motion in the window."""
    x, y = motion[0], motion[1]
    largest_x = largest_y = 0.0
    for i in range(window.starts[window.ends[0]], window.starts[window.ends[1]]):
        largest_x, largest_y = max(largest_x, abs(x[i])), max(largest_y, abs(y[i]))
    window.peak[0], window.peak[1] = largest_x, largest_y


@called
def moves(window, motion, begin, end):
    """Whether any of the stations from ``begin`` to ``end`` moves, or holds what is no number."""
    x, y = motion[0], motion[1]
    of_x, of_y = window.rule[0] * window.peak[0], window.rule[0] * window.peak[1]
    begin, end = max(begin, window.ends[0]), min(end, window.ends[1])
    for i in range(window.starts[begin], window.starts[max(begin, end)]):
        if not (abs(x[i]) <= of_x and abs(y[i]) <= of_y):
            return True
    return False


@called
def follow_motion(window, motion, begin, end):
    """Range of stations that move, at least from ``begin`` to ``end``."""
    n, guard, ends = window.low.size, window.guard, window.ends
    low, high = ends[0], ends[1]
    if moves(window, motion, low, low + guard):
        low = max(0, low - guard)
    else:
        while low + guard <= begin and not moves(window, motion, low + guard, low + 2 * guard):
            low += guard
    if moves(window, motion, high - guard, high):
        high = min(n, high + guard)
    else:
        while high - guard >= end and not moves(window, motion, high - 2 * guard, high - guard):
            high -= guard
    return min(low, begin), max(high, end)


@inner
def rest(window, motion, begin, end):
    """Bring the stations from ``begin`` to ``end`` to rest."""
    x, y, z, shares = motion
    for i in range(window.starts[begin], window.starts[max(begin, end)]):
        # Where the station is, see ``LineState``.
        d = shares[0] * x[i] + shares[1] * y[i] + shares[2] * z[i]
        x[i] = 0.0 if window.rule[4] else d / shares[0]
        y[i] = z[i] = 0.0
        if window.known.size > 0:
            window.known[i] = 0.0


@called
def move(window, motion, begin, end):
    """Make the window that from station ``begin`` to ``end``; what leaves it comes to rest."""
    ends = window.ends
    rest(window, motion, ends[0], min(begin, ends[1]))
    rest(window, motion, max(end, ends[0]), ends[1])
    turn_to(window, begin, end)


@compiled
def turn_to(window, begin, end):
    """Let steps take on the stations from ``begin`` to ``end``, and links between these move."""
    ends = window.ends
    middle = middle_of(begin, end)
    turn(window.kinds, window.turning, ends[4], middle)
    ends[0] = ends[2] = begin
    ends[1] = ends[3] = end
    ends[4] = middle
    # What a link that switches moves stays within the window; those at its ends do not switch.
    inner = min(begin + window.guard, window.low.size) if begin > 0 else begin
    outer = max(end - window.guard, inner) if end < window.low.size else end
    first, last = window.links_before[inner], window.links_before[outer]
    window.links[0], window.links[1] = first, last
    # The pass back looks at all links at its end.
    window.ranges[:] = first
    window.ranges[1, 1] = last


@called
def fade(window, motion, first, last):
    """Slow down the outer part of what is behind the place ``first`` and ahead of ``last`` [m].

    Waves whose group velocity is nearly the train's stay there for long. In its frame their
    envelope obeys Schroedinger's equation, i a_t = -D / 2 a_xx, and damping that begins at once
    sends them back, however little it is. It grows as the potential does that sends back least (D.
    E. Manolopoulos, J. Chem. Phys. 117, 2002), by as much as the length lets it.
    """
    ends, low, high = window.ends, window.low, window.high
    begin, end = ends[0], ends[1]
    behind, ahead = _BEHIND * (first - low[begin]), _AHEAD * (high[end - 1] - last)
    i = begin
    while begin > 0 and i < end and high[i] < low[begin] + behind:
        into = 1.0 - (high[i] - low[begin]) / behind
        slow_down(window, motion, i, window.rule[3] / behind**2 * damping(into))
        i += 1
    i = end - 1
    while end < low.size and i >= begin and low[i] > high[end - 1] - ahead:
        into = 1.0 - (high[end - 1] - low[i]) / ahead
        slow_down(window, motion, i, window.rule[3] / ahead**2 * damping(into))
        i -= 1


@inner
def damping(into):
    """Damping at a share ``into`` of the way into what fades, in terms of its scale."""
    x = _TAKEN * _C * into
    return _A * x - _B * x**3 + 4.0 / (_C - x) ** 2 - 4.0 / (_C + x) ** 2


@inner
def slow_down(window, motion, station, decay):
    """Let the velocity of a station decay, by so much for little; it stays where it is."""
    x, y, z, shares = motion
    loss = decay / (1.0 + decay)
    for i in range(window.starts[station], window.starts[station + 1]):
        change = -loss * (shares[3] * y[i] + shares[4] * z[i])
        y[i] += change
        x[i] -= shares[1] / shares[0] * change


@in_line
def take_in(now, ends):
    """Let a range of stations ``now`` take in what moves."""
    now[0], now[1] = min(now[0], ends[0]), max(now[1], ends[1])
