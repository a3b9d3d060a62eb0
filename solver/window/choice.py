"""Number of spans that move with the train, its cost in accuracy, and lines that allow none.

Waves that outrun the train come back from the end of a window. How many spans it takes until that
is negligible follows from how waves fade on the way, and for how long they are on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.slowest_wave import slowest_wave, slowest_wave_of
from catenary.meshgen.wires import Role
from catenary.solver.effects import all_effects as effects
from catenary.solver.problem.ends import Periodic
from catenary.solver.problem.problem import BOUNDED, EXACT, ROUND_OFF, Problem, WindowChoice

# Case by which the error was measured: en50318_2002 at 250 km/h, its rate of fading at 2 Hz [1/s].
_OMEGA = 2.0 * math.pi * 2.0
_RATE, _SPEED_RATIO = 0.0141, 0.57
# Spans ahead there, and error of the force history below 20 Hz [% of sigma].
_AHEAD = (5.0, 9.0, 14.0, 18.0, 20.0, 22.0, 26.0, 30.0)
_ERROR = (11.0, 5.3, 1.6, 0.39, 0.17, 0.080, 0.052, 0.032)
# So many times as many spans ahead are needed as behind.
_BEHIND = 1.25
# Times at which what moves is counted.
_SAMPLES = 200
_FEWEST, _WANTED = 4, 22.0
# Rate of fading below which the ends of a window are damped on mass [1/s], and by how much, in wave
# speeds times spans: the change of group velocity with wavenumber, some 0.08 of that, is a scale of
# 2 of it (`fade` in `kernels/motion/two_passes.cpp`). Without that damping more spans are taken.
_SLOW, _FADING, _WANTED_WITHOUT = 0.1, 2.0, 30.0
# Spans beyond the front of the fastest transverse wave within which motion is found. Bending makes
# short waves faster, damping ends them: in exact windows on en50318_2002 and ambrosio2012 (200
# spans, 17 to 20 s) displacements above 1e-6 of the largest reached 30 m further than that front.
_BEYOND_FRONT = 2.0


class Reach(NamedTuple):
    """Largest extent of the motion of a line with a window.

    Attributes
    ----------
    behind, ahead : of the last and of the first pantograph [m]
    wave_speed : of the waves that also leave the places where these started [m/s]; 0 if a number of
        spans bounds the motion
    """

    behind: float
    ahead: float
    wave_speed: float = 0.0


def window_sentence(problem: Problem) -> str:
    """Moving part of the line, in words; empty if all of it moves. Not collective."""
    window = problem.window
    if not window.moves:
        return ""
    if window.mode == EXACT:
        return (
            "whatever a wave has reached moves, down to "
            f"{ROUND_OFF:g} of the largest motion (window.mode = exact)"
        )
    if window.tolerance is not None:
        return (
            f"stations rest whose motion is below {window.tolerance:g} of the largest "
            "(window.mode = bounded)"
        )
    error = estimated_error(problem, window.spans_ahead, window.spans_behind)
    return (
        f"{window.spans_ahead:g} spans move ahead of the train and {window.spans_behind:g} behind "
        f"(window.mode = bounded); error of the force below 20 Hz some {error:.2g} % of its "
        "standard deviation (estimate); what the line's own ends send back from beyond is left out"
    )


def spans_of_window(
    problem: Problem, ahead: float | None = None, behind: float | None = None
) -> WindowChoice:
    """A window of ``ahead`` and ``behind`` spans ahead of and behind the train.

    Both follow from damping and speed unless both are given.
    """
    fades = _fading_rate(problem) < _SLOW
    if ahead is None or behind is None:
        wanted = _WANTED if fades else _WANTED_WITHOUT
        ahead = max(_FEWEST, math.ceil(wanted / _worth(problem)))
        behind = max(_FEWEST, math.ceil(ahead / _BEHIND))
    return WindowChoice(BOUNDED, None, ahead, behind, _fading(problem) if fades else 0.0)


def moving_share(problem: Problem) -> float:
    """Share of the line that moves, its mean over a run: 1 without a window.

    Where motion decides it is what waves could have reached by then; that which has faded rests
    before. Not collective.
    """
    window, train = problem.window, problem.train
    masts = np.asarray(problem.line.support_positions, dtype=float)
    begin, end = float(masts[0]), float(masts[-1])
    if not window.moves or end <= begin:
        return 1.0
    last = train.start - max(placement.behind for placement in train.placements)
    time = np.linspace(0.0, (train.end - train.start) / train.speed, _SAMPLES)
    if window.by_motion > 0.0:
        speed = max(slowest_wave_of(problem.line, wire) for wire in problem.line.wires)
        low, high = last - speed * time, train.start + speed * time
    else:
        span = (end - begin) / (masts.size - 1)
        low = last + train.speed * time - window.spans_behind * span
        high = train.start + train.speed * time + window.spans_ahead * span
    alive = np.clip(np.minimum(high, end) - np.maximum(low, begin), 0.0, None)
    return float(alive.mean() / (end - begin))


def reach_of_motion(problem: Problem) -> Reach | None:
    """Extent of the line's motion around the train, None if all of it may move. Not collective.

    All of it may without a window, under gusts, with incidents, whose loads stay where they are,
    and where motion bounds the window and waves of the wires' stretch leave the train behind.
    """
    window = problem.window
    if not window.moves or problem.incidents:
        return None
    laws, wires = effects.simulated(problem), problem.line.wires
    if laws.wind is not None and laws.wind.gusts is not None:
        return None
    span = float(np.diff(problem.line.support_positions).max())
    if window.by_motion == 0.0:
        return Reach(window.spans_behind * span, window.spans_ahead * span)
    groups = effects.unknown_groups(effects.active(problem), wires)
    if any("u" in names for group in groups for names in group.values()):
        return None  # waves along the track are far faster
    margin = _BEYOND_FRONT * span
    return Reach(margin, margin, max(slowest_wave_of(problem.line, wire) for wire in wires))


def estimated_error(problem: Problem, ahead: float, behind: float) -> float:
    """Error of the force history below 20 Hz by a window [% of its standard deviation].

    ``ahead`` and ``behind`` are its spans ahead of and behind the train. The estimate interpolates
    errors measured on one line, scaled by the time of waves to an end and back and by their decay.
    Not collective.
    """
    spans = min(ahead, _BEHIND * behind) * _worth(problem)
    slope = math.log(_ERROR[-1] / _ERROR[-3]) / (_AHEAD[-1] - _AHEAD[-3])
    beyond = slope * max(0.0, spans - _AHEAD[-1])
    return float(np.exp(np.interp(spans, _AHEAD, np.log(_ERROR)) + beyond))


def _fading(problem: Problem) -> float:
    """Damping at the ends of a window times the square of their length [m2/s]."""
    masts = problem.line.support_positions
    span = float(masts[-1] - masts[0]) / (len(masts) - 1)
    return _FADING * slowest_wave(problem.line) * span


def _worth(problem: Problem) -> float:
    """For how many spans of the line that was measured one of this line stands."""
    ratio = min(problem.train.speed / slowest_wave(problem.line), 0.95)
    way = (1.0 - _SPEED_RATIO**2) / (1.0 - ratio**2)
    return way * math.sqrt(_fading_rate(problem) / _RATE)


def _fading_rate(problem: Problem) -> float:
    """Rate at which the amplitude of waves of 2 Hz fades [1/s], by the contact wires' damping."""
    names = [wire.name for wire in problem.line.wires_of(Role.CONTACT)]
    usual = problem.damping.alpha, problem.damping.beta
    dampings = [problem.damping.per_component.get(name, usual) for name in names]
    return max(min(0.5 * (alpha * _OMEGA**2 + beta) for alpha, beta in dampings), 1e-4)


def why_no_window(problem: Problem) -> str:
    """Reason why steps of a problem take on the whole line, "" if they need not. Not collective."""
    numerics = problem.numerics
    if numerics.scheme != "one_solve":
        return f"numerics.scheme is {numerics.scheme}"
    if numerics.coupling == "explicit":
        return "numerics.coupling is explicit"
    if numerics.adaptive_tolerance is not None:
        return "numerics.adaptive_tolerance_N lets steps be halved"
    if any(isinstance(end, Periodic) for end in problem.ends):
        return "an end of the line is periodic, and remembers every step"
    return ""


def opens_window(problem: Problem, n_ranks: int, by_stations: bool) -> bool:
    """Whether steps of a problem are taken in a window.

    Parameters
    ----------
    problem : Problem
        Problem of the run.
    n_ranks : int
        Number of ranks that step the line.
    by_stations : bool
        Whether steps are taken in two passes over stations.

    Raises
    ------
    InputError
        If the problem wants a window that is not possible.
    """
    if not problem.window.moves:
        return False
    why = why_no_window(problem)
    if not why and n_ranks > 1:
        why = f"the run has {n_ranks} ranks, and all that moves is on one: start it without mpirun"
    if not why and not by_stations:
        why = "this line, or an option of PETSc, does not let it be stepped by stations"
    if why and not problem.window.optional:
        raise InputError(f"window.mode is {problem.window.mode}, which cannot be here, as {why}")
    return not why
