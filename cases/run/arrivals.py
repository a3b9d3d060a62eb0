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
        _within(_from_near_end(line, course), course),
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


def _from_near_end(line: WaveLine, course: Course) -> Meeting | None:
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


def end_sentences(problem: Problem) -> tuple[str, str]:
    """Begin and end of the line, in words."""
    start, end = (f"{side} {_of_end(kind)}" for side, kind in zip(SIDES, problem.ends, strict=True))
    return start, end


def _end_warnings(problem: Problem) -> list[str]:
    """Sentences on how the ends of the line may spoil a run."""
    line, train = problem.line, problem.train
    masts, n = line.support_positions, line.n_spans
    start, end = problem.ends
    rear = train.start - max(place.behind for place in train.placements)
    sentences = []
    if isinstance(start, AbsorbingLayer) and rear < masts[start.n_spans]:
        sentences.append(_inside("start", f"starts at {rear:g} m", float(masts[start.n_spans])))
    if isinstance(end, AbsorbingLayer) and train.end > masts[n - end.n_spans]:
        sentences.append(_inside("end", f"runs to {train.end:g} m", float(masts[n - end.n_spans])))
    return sentences


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


class Traced(NamedTuple):
    """A line for waves, the course of each pantograph, what reaches it, and how it is called."""

    line: WaveLine
    courses: tuple[Course, ...]
    found: tuple[Arrivals, ...]
    names: tuple[str, ...]


def arrival_facts(scene: Scene, problem: Problem) -> dict[str, Any]:
    """Facts in SI units, sentences about each pantograph, and warnings; plain enough for JSON.

    Not collective.
    """
    traced = _traced(problem)
    rows = zip(traced.names, traced.found, traced.courses, strict=True)
    return {
        "wave_speed_m_per_s": traced.line.speed,
        "fastest_wave_m_per_s": traced.line.fastest,
        "pantographs": [
            {
                "start_m": course.start,
                "run_in_m": found.run_in,
                "run_in_spans": found.run_in_spans,
                "start_share_of_std": found.start_share,
                "far_end_met_at_m": None if found.far_end is None else found.far_end.at,
                "far_end_met_at_s": None if found.far_end is None else found.far_end.time,
                "far_end_share": found.far_share,
                "near_end_met_at_m": None if found.near_end is None else found.near_end.at,
                "near_end_met_at_s": None if found.near_end is None else found.near_end.time,
                "says": _sentence(name, found),
            }
            for name, found, course in rows
        ],
        "ends": list(end_sentences(problem)),
        "warnings": [
            *_end_warnings(problem),
            *_reflections(scene, traced),
            *_short_run_in(problem, traced),
            *_short_stretch(problem, traced),
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


def _traced(problem: Problem) -> Traced:
    line, train = wave_line(problem), problem.train
    starts = [train.start - place.behind for place in train.placements]
    duration = (train.end - train.start) / train.speed
    courses = tuple(
        Course(
            start,
            start + train.speed * duration,
            train.speed,
            problem.evaluation,
            max(starts),
            min(starts),
        )
        for start in starts
    )
    found = tuple(
        _in_window(_without_let_out(arrivals(line, course), problem.ends), line, course, problem)
        for course in courses
    )
    return Traced(line, courses, found, tuple(places_on_train(len(starts))))


def _without_let_out(found: Arrivals, ends: tuple[EndCondition, EndCondition]) -> Arrivals:
    """Drop waves from ends that let them out."""
    start, end = (isinstance(kind, AbsorbingLayer | Periodic) for kind in ends)
    if start:
        found = found._replace(near_end=None)
    return found._replace(far_end=None, far_share=0.0) if end else found


def _in_window(found: Arrivals, line: WaveLine, course: Course, problem: Problem) -> Arrivals:
    """Drop waves that the ends of the line do not reflect, as they lie outside of a
    window of so many spans; what the window's own ends send back is in its error."""
    window = problem.window
    if not window.moves or window.by_motion > 0.0:
        return found
    if course.rear - window.spans_behind * line.span >= line.start:
        found = found._replace(near_end=None)
    if found.far_end is None:
        return found
    # Place of this pantograph when the window reaches the far end, and where it meets what is then
    # reflected there.
    leader_then = line.end - window.spans_ahead * line.span
    here = leader_then - (course.leader - course.start)
    met = here + course.speed * (line.end - here) / (course.speed + line.fastest)
    if met <= found.far_end.at:
        return found
    if met > course.end:
        return found._replace(far_end=None, far_share=0.0)
    return found._replace(far_end=Meeting(met, (met - course.start) / course.speed))


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


def _sentence(name: str, found: Arrivals) -> str:
    ends = []
    for what, met in (("far", found.far_end), ("near", found.near_end)):
        ends.append(
            f"from the {what} end at {met.at:.0f} m ({met.time:.1f} s)"
            if met is not None
            else f"from the {what} end not before the run ends"
        )
    return (
        f"{name}: {found.run_in:.0f} m or {found.run_in_spans:.1f} spans from start to evaluated "
        f"stretch, where start-up still affects the force by about {100 * found.start_share:.2g} % "
        f"of sigma; reflections reach the pantograph {' and '.join(ends)}"
    )


def _reflections(scene: Scene, traced: Traced) -> list[str]:
    felt = [
        i
        for i, course in enumerate(traced.courses)
        if (far := traced.found[i].far_end) is not None
        and far.at < course.stretch[1]
        and reflection_felt(traced.line, course)
    ]
    if not felt:
        return []
    ends = [end_for(traced.line, traced.courses[i]) for i in felt]
    # 1 mm for the rounding of sums.
    more = math.ceil((max(ends) - traced.line.end - 1e-3) / traced.line.span)
    wanted = scene.line.n_spans + max(more, 1)
    in_file = "line.span_m" in dict(scene.origin.taken_in)
    longer = f"a line.spans_file of {wanted} spans" if in_file else f"line.n_spans = {wanted}"
    sentences = []
    for i in felt:
        met = traced.found[i].far_end
        assert met is not None  # a stretch lies within the run
        share = traced.found[i].far_share
        left = "" if share > 0.9 else f", with up to {100 * share:.2g} % of its amplitude"
        first, last = traced.courses[i].stretch
        fits = met.at - first >= traced.line.span
        shorter = f", or evaluation.to_m = {math.floor(met.at):g} at most" if fits else ""
        sentences.append(
            f"The reflection from the end of the line reaches {in_sentence(traced.names[i])} at "
            f"{met.at:.0f} m ({met.time:.1f} s){left}, before the evaluated stretch ends "
            f"({first:g} to {last:g} m): its force is not that of a long line. Take {longer}"
            f"{shorter}."
        )
    return sentences


def _short_run_in(problem: Problem, traced: Traced) -> list[str]:
    speed, line = problem.train.speed, traced.line
    short = [i for i, found in enumerate(traced.found) if found.start_share > SHORT_RUN_IN]
    if not short:
        return []
    needed = run_in_for(line, speed)
    leader = max(course.leader for course in traced.courses)
    first = problem.line.running_range[0]
    sentences = []
    for i in short:
        course, found = traced.courses[i], traced.found[i]
        # To a metre, on the safe side.
        start = math.floor(course.stretch[0] - needed + leader - course.start)
        begin = math.ceil(course.start + needed)
        fits = start - (leader - course.rear) >= first
        remedy = f"train.start_m = {start:g} at most, or " if fits else ""
        sentences.append(
            f"{capital(in_sentence(traced.names[i]))} starts {found.run_in:.0f} m, "
            f"{found.run_in_spans:.1f} spans, before the evaluated stretch: start-up still affects "
            f"its force by about {100 * found.start_share:.0f} % of sigma, where "
            f"{100 * SHORT_RUN_IN:.0f} % is the limit. Take {remedy}evaluation.from_m = {begin:g} "
            "at least."
        )
    return sentences


def _short_stretch(problem: Problem, traced: Traced) -> list[str]:
    first, last = problem.evaluation
    if last - first >= traced.line.span * (1.0 - 1e-9):
        return []
    return [
        f"The evaluated stretch of {last - first:g} m is shorter than a span ({traced.line.span:g} "
        "m): its statistics leave out what the rest of a span does, and no criterion that they "
        f"pass says much. Take evaluation.to_m = {first + math.ceil(traced.line.span):g} at least."
    ]
