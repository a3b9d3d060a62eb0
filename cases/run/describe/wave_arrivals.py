"""Arrival of waves from the start of a run that the ends of the line reflect.

Wires that droppers join carry long waves together, with c = sqrt(sum of tensions / sum of masses);
a conductor rail carries them by bending. The start of the run sends such waves ahead of the train
and behind it; the ends of the line, which are fixed, reflect them. docs/guide/line_length.md
compares what follows with marches.
"""

from __future__ import annotations

import math
from typing import NamedTuple

# Share of an amplitude below which a reflected wave counts as harmless [-].
FELT = 1e-3
# Part of a run's start in the contact force after a distance of D spans, on a line without
# damping, is START_SHARE / D of the standard deviation; measured, see docs/guide/line_length.md.
START_SHARE = 0.8
# Above this share of the standard deviation the run-in counts as short [-].
SHORT_RUN_IN = 0.2


class WaveLine(NamedTuple):
    """A line for long waves.

    Attributes
    ----------
    start, end : of the wires, which are fixed there [m]
    span : usual length [m]
    speed : of waves on both wires together [m/s]
    fastest : of waves on the faster one alone [m/s]
    alpha, beta : proportional damping of the less damped wire [s], [1/s]
    edge : lower edge of the first pass band [rad/s]
    """

    start: float
    end: float
    span: float
    speed: float
    fastest: float
    alpha: float
    beta: float
    edge: float

    @property
    def decay(self) -> float:
        """Least rate at which amplitudes fall [1/s].

        (beta + alpha w^2) / 2 at the lower edge of the first pass band, where a wave is as long as
        two spans: supports hold the wires, and longer waves do not travel.
        """
        return 0.5 * (self.beta + self.alpha * self.edge**2)


class Course(NamedTuple):
    """Course of one pantograph: start and end [m], its speed [m/s] and the evaluated stretch [m];
    ``leader`` and ``rear`` are the starts of the foremost and the last pantograph [m]."""

    start: float
    end: float
    speed: float
    stretch: tuple[float, float]
    leader: float
    rear: float


class Meeting(NamedTuple):
    """Place [m] and time [s] at which a pantograph meets a wave."""

    at: float
    time: float


class Arrivals(NamedTuple):
    """Waves that reach a pantograph, and when.

    Attributes
    ----------
    run_in, run_in_spans : distance from the start to the evaluated stretch [m], in spans [-]
    start_share : rms of the start's remainder in the force history over the standard deviation,
        estimated [-]
    far_end, near_end : first wave from either end of the line, None if none arrives within the run
    far_share : remaining amplitude of the least damped wave from the far end at the end of the
        stretch, over its first one [-]
    """

    run_in: float
    run_in_spans: float
    start_share: float
    far_end: Meeting | None
    near_end: Meeting | None
    far_share: float


def arrivals(line: WaveLine, course: Course) -> Arrivals:
    """Waves that reach a pantograph on its course. Not collective."""
    run_in = course.stretch[0] - course.start
    return Arrivals(
        run_in,
        run_in / line.span,
        start_share(line, course.speed, run_in),
        _within(from_far_end(line, course), course),
        _within(from_near_end(line, course), course),
        far_share(line, course),
    )


def reflection_felt(line: WaveLine, course: Course) -> bool:
    """Whether a wave from the far end is met in the evaluated stretch with an amplitude left."""
    met = from_far_end(line, course)
    return met is not None and met.at < course.stretch[1] and far_share(line, course) >= FELT


def from_far_end(line: WaveLine, course: Course) -> Meeting | None:
    """The first wave that returns from the far end: c t = 2 L - x_leader - x - v t; None if the
    train is as fast."""
    if course.speed >= line.speed:
        return None
    time = (2.0 * line.end - course.leader - course.start) / (line.speed + course.speed)
    return Meeting(course.start + course.speed * time, time)


def from_near_end(line: WaveLine, course: Course) -> Meeting | None:
    """The first wave that the near end reflects and that catches up from behind: c t = x_rear + x +
    v t, from the near end; None if the train is as fast."""
    if course.speed >= line.speed:
        return None
    both = course.rear + course.start - 2.0 * line.start
    time = both / (line.speed - course.speed)
    return Meeting(course.start + course.speed * time, time)


def far_share(line: WaveLine, course: Course) -> float:
    """Share of its amplitude that a wave from the far end has kept at the end of the stretch.

    Of all waves met at x the last one, which the leader sent, has travelled for the shortest time,
    (2 (L - x) - d) / (c - v), d being its distance ahead. [-]
    """
    if course.speed >= line.speed:
        return 0.0
    way = 2.0 * (line.end - course.stretch[1]) - (course.leader - course.start)
    return math.exp(-line.decay * max(way, 0.0) / (line.speed - course.speed))


def start_share(line: WaveLine, speed: float, run_in: float) -> float:
    """Estimated rms of the start's remainder in the force history, over its standard deviation [-].

    At most 1. ``speed`` is the train's [m/s], ``run_in`` the distance from the start to the
    evaluated stretch [m].
    """
    if run_in <= 0.0:
        return 1.0
    return min(1.0, START_SHARE * line.span / run_in * math.exp(-line.decay * run_in / speed))


def run_in_for(line: WaveLine, speed: float) -> float:
    """Run-in after which the start leaves ``SHORT_RUN_IN`` of the standard deviation [m]."""
    from scipy import optimize  # not loaded for runs that are long enough

    def more(run_in: float) -> float:
        return start_share(line, speed, run_in) - SHORT_RUN_IN

    longest = START_SHARE * line.span / SHORT_RUN_IN
    if more(longest) >= 0.0:  # nothing damps, or nothing that round-off leaves
        return longest
    return float(optimize.brentq(more, 0.0, longest))


def end_for(line: WaveLine, course: Course) -> float:
    """Least place of the line's end without a perceptible reflection in the stretch [m]: waves meet
    the pantograph later, or have decayed."""
    time = (course.stretch[1] - course.start) / course.speed
    unmet = 0.5 * ((line.speed + course.speed) * time + course.leader + course.start)
    if line.decay == 0.0:
        return unmet
    way = -math.log(FELT) / line.decay * (line.speed - course.speed)
    faded = course.stretch[1] + 0.5 * (way + course.leader - course.start)
    return min(unmet, faded)


def _within(met: Meeting | None, course: Course) -> Meeting | None:
    return met if met is not None and met.at <= course.end else None
