"""Waves from the start of a run and from the ends of the line, and sentences on them.

Plan, check and result file say how the line ends, when its ends' reflections reach a pantograph,
and whether the run-in is long enough.

Wires that droppers join carry long waves together, with c = sqrt(sum of tensions / sum of masses);
a conductor rail carries them by bending. The start of the run sends such waves ahead of the train
and behind it; the ends of the line, which are fixed, reflect them. docs/guide/line_length.md
compares what follows with marches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from catenary.cases.scene.scene import Scene, problem_of
from catenary.meshgen.line import Line
from catenary.meshgen.slowest_wave import bends, slowest_wave_of, wave_of_two_spans
from catenary.meshgen.wires import Wire
from catenary.postproc.evaluate.wording import capital, counted
from catenary.postproc.files.header import in_sentence, places_on_train
from catenary.solver.effects.all_effects import simulated
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Periodic
from catenary.solver.problem.problem import Problem

# Share of an amplitude below which a reflected wave counts as harmless [-].
FELT = 1e-3
# Part of a run's start in the contact force after a distance of D spans, on a line without
# damping, is START_SHARE / D of the standard deviation; measured, see docs/guide/line_length.md.
START_SHARE = 0.8
# Above this share of the standard deviation the run-in counts as short [-].
SHORT_RUN_IN = 0.2
SIDES = ("start", "end")


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


class Meeting(NamedTuple):
    """Place [m] and time [s] at which a pantograph meets a wave."""

    at: float
    time: float


class Course(NamedTuple):
    """Course of a pantograph along a line, and the waves that reach it on the way.

    Attributes
    ----------
    line : for waves
    start, end, speed : of the pantograph [m], [m/s]
    stretch : that is evaluated [m]
    leader, rear : starts of the foremost and of the last pantograph [m]
    lets_out : whether start and end of the line let waves out
    window : distances behind the last and ahead of the foremost pantograph within which the line
        moves [m], None if all of it does
    name : of the pantograph
    """

    line: WaveLine
    start: float
    end: float
    speed: float
    stretch: tuple[float, float]
    leader: float
    rear: float
    lets_out: tuple[bool, bool] = (False, False)
    window: tuple[float, float] | None = None
    name: str = ""

    @property
    def run_in(self) -> float:
        """From the start to the evaluated stretch [m]."""
        return self.stretch[0] - self.start

    @property
    def run_in_spans(self) -> float:
        """The same in spans [-]."""
        return self.run_in / self.line.span

    @property
    def start_share(self) -> float:
        """What the start leaves in the force history, see `start_share` [-]."""
        return start_share(self.line, self.speed, self.run_in)

    @property
    def far_wave(self) -> Meeting | None:
        """The first wave that returns from the far end, also after the run: c t = 2 L - x_leader -
        x - v t; None if the train is as fast."""
        way = 2.0 * self.line.end - self.leader - self.start
        return self._met(way, self.line.speed + self.speed)

    @property
    def far_end(self) -> Meeting | None:
        """The first wave that the far end reflects within the run. That of a window begins when the
        window reaches it; what the window's own ends send back is in its error."""
        met = None if self.lets_out[1] else self._within(self.far_wave)
        if met is None or self.window is None:
            return met
        # Place of this pantograph when the window reaches the far end, and where it meets what is
        # then reflected there.
        here = self.line.end - self.window[1] - (self.leader - self.start)
        at = here + self.speed * (self.line.end - here) / (self.speed + self.line.fastest)
        later = Meeting(at, (at - self.start) / self.speed)
        return met if at <= met.at else self._within(later)

    @property
    def near_end(self) -> Meeting | None:
        """The first wave that the near end reflects and that catches up from behind within the run:
        c t = x_rear + x + v t, from the near end; None if the train is as fast, or if the near end
        is outside of the window."""
        line = self.line
        outside = self.window is not None and self.rear - self.window[0] >= line.start
        if self.lets_out[0] or outside:
            return None
        way = self.rear + self.start - 2.0 * line.start
        return self._within(self._met(way, line.speed - self.speed))

    @property
    def far_share(self) -> float:
        """Share of its amplitude that a wave from the far end has kept at the end of the stretch.

        Of all waves met at x the last one, which the leader sent, has travelled for the shortest
        time, (2 (L - x) - d) / (c - v), d being its distance ahead. [-]
        """
        line, met = self.line, self.far_wave
        if met is None or self.lets_out[1] or (self._within(met) and not self.far_end):
            return 0.0
        way = 2.0 * (line.end - self.stretch[1]) - (self.leader - self.start)
        return math.exp(-line.decay * max(way, 0.0) / (line.speed - self.speed))

    @property
    def feels_reflection(self) -> bool:
        """Whether a wave from the far end is felt in the evaluated stretch."""
        met = self.far_end
        return met is not None and met.at < self.stretch[1] and self.far_share >= FELT

    @property
    def least_end(self) -> float:
        """Least place of the line's end without a perceptible reflection in the stretch [m]: waves
        meet the pantograph later, or have decayed."""
        line, last = self.line, self.stretch[1]
        time = (last - self.start) / self.speed
        unmet = 0.5 * ((line.speed + self.speed) * time + self.leader + self.start)
        if line.decay == 0.0:
            return unmet
        way = -math.log(FELT) / line.decay * (line.speed - self.speed)
        return min(unmet, last + 0.5 * (way + self.leader - self.start))

    def _met(self, way: float, closing: float) -> Meeting | None:
        """Where a wave that is so far away [m] and comes nearer so fast [m/s] is met."""
        if self.speed >= self.line.speed:
            return None
        time = way / closing
        return Meeting(self.start + self.speed * time, time)

    def _within(self, met: Meeting | None) -> Meeting | None:
        return met if met is not None and met.at <= self.end else None

    def facts(self) -> dict[str, Any]:
        """Facts in SI units and a sentence, plain enough for JSON."""
        far, near = self.far_end or (None, None), self.near_end or (None, None)
        ends = [
            f"from the {side} end "
            + ("not before the run ends" if at is None else f"at {at:.0f} m ({time:.1f} s)")
            for side, (at, time) in (("far", far), ("near", near))
        ]
        return {
            "start_m": self.start,
            "run_in_m": self.run_in,
            "run_in_spans": self.run_in_spans,
            "start_share_of_std": self.start_share,
            "far_end_met_at_m": far[0],
            "far_end_met_at_s": far[1],
            "far_end_share": self.far_share,
            "near_end_met_at_m": near[0],
            "near_end_met_at_s": near[1],
            "says": f"{self.name}: {self.run_in:.0f} m or {self.run_in_spans:.1f} spans from start "
            "to evaluated stretch, where start-up still affects the force by about "
            f"{100 * self.start_share:.2g} % of sigma; reflections reach the pantograph "
            f"{' and '.join(ends)}",
        }


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


def end_sentences(problem: Problem) -> tuple[str, str]:
    """Begin and end of the line, in words."""
    start, end = (f"{side} {_of_end(kind)}" for side, kind in zip(SIDES, problem.ends, strict=True))
    return start, end


def _end_warnings(problem: Problem) -> Iterator[str]:
    """Sentences on how the ends of the line may spoil a run."""
    line, train = problem.line, problem.train
    masts, n = line.support_positions, line.n_spans
    start, end = problem.ends
    rear = train.start - max(place.behind for place in train.placements)
    if isinstance(start, AbsorbingLayer) and rear < masts[start.n_spans]:
        yield _inside("start", f"starts at {rear:g} m", float(masts[start.n_spans]))
    if isinstance(end, AbsorbingLayer) and train.end > masts[n - end.n_spans]:
        yield _inside("end", f"runs to {train.end:g} m", float(masts[n - end.n_spans]))


def _inside(side: str, how: str, inner: float) -> str:
    return (
        f"The train {how}, inside the absorbing layer at the {side} of the line, which begins at "
        f"{inner:g} m: there waves are damped that run beside the pantograph."
    )


def _of_end(end: EndCondition) -> str:
    if isinstance(end, AbsorbingLayer):
        return (
            f"{counted(end.n_spans, 'span')} that absorb waves (damping up to {end.damping:g} 1/s),"
            " then fixed"
        )
    if isinstance(end, Periodic):
        return "as if the line went on for ever like its last span, without slack droppers there"
    return "fixed"


def arrival_facts(scene: Scene, problem: Problem) -> dict[str, Any]:
    """Facts in SI units, sentences about each pantograph, and warnings; plain enough for JSON.

    Not collective.
    """
    line = wave_line(problem)
    courses = _courses(line, problem)
    return {
        "wave_speed_m_per_s": line.speed,
        "fastest_wave_m_per_s": line.fastest,
        "pantographs": [course.facts() for course in courses],
        "ends": list(end_sentences(problem)),
        "warnings": [
            *_end_warnings(problem),
            *_reflections(scene, courses),
            *_short_run_in(problem.line.running_range[0], courses),
            *_short_stretch(line, problem.evaluation),
        ],
    }


def arrival_warnings(scene: Scene) -> list[str]:
    """The warnings among ``arrival_facts``, before a run is made. Not collective."""
    warnings: list[str] = arrival_facts(scene, problem_of(scene))["warnings"]
    return warnings


def wave_line(problem: Problem) -> WaveLine:
    """The line for long waves, a string unless its contact wire is a conductor rail; hardware
    counts with its mean mass per length."""
    line = problem.line
    masts = line.support_positions
    total = float(masts[-1] - masts[0])
    # A wire that is only over a part of the line counts with that part.
    shares = [(wire, wire.length / total) for wire in line.wires]
    mass = sum(share * wire.mass_per_length for wire, share in shares) + _hardware(line)
    damping = simulated(problem).damping
    usual = (damping.alpha, damping.beta)
    pairs = [damping.per_component.get(wire.name, usual) for wire in line.wires]
    span = _span(line)
    bending = {wire.name: _bending(line, wire) for wire in line.wires}
    tension = sum(share * wire.tension for wire, share in shares)
    stiffness = sum(share * bending[wire.name] for wire, share in shares)
    long = wave_of_two_spans(tension, stiffness, mass, span)
    alone = [
        wave_of_two_spans(wire.tension, bending[wire.name], wire.mass_per_length, span)
        for wire in line.wires
    ]
    return WaveLine(
        start=float(masts[0]),
        end=float(masts[-1]),
        span=span,
        speed=long.energy,
        fastest=max(wave.energy for wave in alone),
        alpha=min(pair[0] for pair in pairs),
        beta=min(pair[1] for pair in pairs),
        edge=math.pi * long.phase / span,
    )


def _bending(line: Line, wire: Wire) -> float:
    """Bending stiffness of a wire as far as its waves are not those of a string [N m2]."""
    slowest = slowest_wave_of(line, wire)
    return wire.bending_stiffness if bends(slowest, wire.tension, wire.mass_per_length) else 0.0


def _courses(line: WaveLine, problem: Problem) -> list[Course]:
    """The course of each pantograph of a problem."""
    train, window = problem.train, problem.window
    starts = [train.start - place.behind for place in train.placements]
    lets_out = [isinstance(kind, AbsorbingLayer | Periodic) for kind in problem.ends]
    moves = window.moves and not window.by_motion > 0.0
    return [
        Course(
            line,
            start,
            start + train.end - train.start,
            train.speed,
            problem.evaluation,
            max(starts),
            min(starts),
            (lets_out[0], lets_out[1]),
            (window.spans_behind * line.span, window.spans_ahead * line.span) if moves else None,
            name,
        )
        for start, name in zip(starts, places_on_train(len(starts)), strict=True)
    ]


def _hardware(line: Line) -> float:
    """Mass of droppers and their clamps per length of line [kg/m]."""
    total = 0.0
    for group in line.droppers:
        kind = group.kind
        length = max(line.wire(group.upper).top - line.wire(group.lower).top, 0.0)
        each = kind.mass_per_length * length + kind.upper_clamp_mass + kind.lower_clamp_mass
        total += len(group.lower_x) * each
    return float(total / sum(line.span_lengths))


def _span(line: Line) -> float:
    """Mean length of the running spans [m]."""
    first, last = line.running_range
    n = line.n_spans - sum(line.n_transition)
    return (last - first) / n if n else sum(line.span_lengths) / line.n_spans


def _reflections(scene: Scene, courses: Sequence[Course]) -> Iterator[str]:
    felt = [course for course in courses if course.feels_reflection]
    if not felt:
        return
    line = felt[0].line
    # 1 mm for the rounding of sums.
    more = math.ceil((max(course.least_end for course in felt) - line.end - 1e-3) / line.span)
    wanted = scene.line.n_spans + max(more, 1)
    in_file = "line.span_m" in dict(scene.origin.taken_in)
    longer = f"a line.spans_file of {wanted} spans" if in_file else f"line.n_spans = {wanted}"
    for course in felt:
        met, (first, last) = course.far_end, course.stretch
        assert met is not None  # it is felt
        share = course.far_share
        left = "" if share > 0.9 else f", with up to {100 * share:.2g} % of its amplitude"
        fits = met.at - first >= line.span
        shorter = f", or evaluation.to_m = {math.floor(met.at):g} at most" if fits else ""
        yield (
            f"The reflection from the end of the line reaches {in_sentence(course.name)} at "
            f"{met.at:.0f} m ({met.time:.1f} s){left}, before the evaluated stretch ends "
            f"({first:g} to {last:g} m): its force is not that of a long line. Take {longer}"
            f"{shorter}."
        )


def _short_run_in(first: float, courses: Sequence[Course]) -> Iterator[str]:
    """Sentences on run-ins that are too short; running spans begin at ``first`` [m]."""
    for course in courses:
        if course.start_share <= SHORT_RUN_IN:
            continue
        needed = run_in_for(course.line, course.speed)
        # To a metre, on the safe side.
        start = math.floor(course.stretch[0] - needed + course.leader - course.start)
        begin = math.ceil(course.start + needed)
        fits = start - (course.leader - course.rear) >= first
        remedy = f"train.start_m = {start:g} at most, or " if fits else ""
        yield (
            f"{capital(in_sentence(course.name))} starts {course.run_in:.0f} m, "
            f"{course.run_in_spans:.1f} spans, before the evaluated stretch: start-up still "
            f"affects its force by about {100 * course.start_share:.0f} % of sigma, where "
            f"{100 * SHORT_RUN_IN:.0f} % is the limit. Take {remedy}evaluation.from_m = {begin:g} "
            "at least."
        )


def _short_stretch(line: WaveLine, stretch: tuple[float, float]) -> Iterator[str]:
    first, last = stretch
    if last - first < line.span * (1.0 - 1e-9):
        yield (
            f"The evaluated stretch of {last - first:g} m is shorter than a span ({line.span:g} "
            "m): its statistics leave out what the rest of a span does, and no criterion that they "
            f"pass says much. Take evaluation.to_m = {first + math.ceil(line.span):g} at least."
        )
