"""A line that something other than its train sets into motion, marched and seen.

The train stands aside: one mass that nothing lifts, under a contact without stiffness. All else is
the line's own, droppers that slacken included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catenary.base.errors import InputError
from catenary.base.options import flag_of
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.waves.seen import NodeMotion
from catenary.mbs.lumped_data import LumpedData
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.solver.contact_problem.coupling import DIVERGED
from catenary.solver.effects.all_effects import move_together
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import BOUNDED, Placement, Problem, Train
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView
from catenary.solver.waves.excitation import (
    FORCE,
    HAMMER,
    PULSE,
    Blow,
    Excitation,
    MovingForce,
    hammer,
)

# A whole (1 - cosine) / 2 of 0.1 s has most of its waves below 20 Hz, half a sine of 0.02 s below
# 75 Hz [s].
DURATIONS = {PULSE: 0.1, HAMMER: 0.02}
# Impulse of a hammer [N s].
IMPULSE = 10.0
_ASIDE = LumpedData((8.0,), (0.0,), (0.0,))


# Kinds that take a setting.
_KINDS = {
    "force": (FORCE, PULSE),
    "frequency": (FORCE,),
    "at": (PULSE, HAMMER),
    "duration": (PULSE, HAMMER),
    "impulse": (HAMMER,),
}


def excitation_of(kind: str, settings: Excited, problem: Problem, dt: float) -> Excitation:
    """The excitation of a kind on the line of a problem.

    Parameters
    ----------
    kind : one of `excitation.KINDS`
    settings : of the excitation
    problem : with the line and its train
    dt : time step, which a blow lasts ten times at least [s]

    Raises
    ------
    InputError
        If something asked for is none of the kind's, or out of range, or if twin wires move as one.
    """
    _refuse_settings(kind, settings)
    if move_together(problem):
        raise InputError(
            f"--excite {kind} acts on one of two contact wires, which move as one without "
            "effects.relative_motion: switch that on"
        )
    if kind == FORCE:
        return _moving_force(settings, problem, dt)
    return _blow(kind, settings, problem, dt)


def _refuse_settings(kind: str, settings: Excited) -> None:
    """Refuse settings that are none of the kind's, or without effect."""
    for name, kinds in _KINDS.items():
        value, option = getattr(settings, name), flag_of(Excited, name)
        if value is None:
            continue
        if kind not in kinds:
            raise InputError(f"{option} belongs to --excite {' or '.join(kinds)}, not to {kind}")
        if not np.isfinite(value):
            raise InputError(f"{option} is {value:g}, but must be finite")
        if value == 0.0 and name in ("force", "impulse"):
            raise InputError(f"{option} is 0, which excites nothing; it may be above or below")


def _force_of(settings: Excited, problem: Problem) -> float:
    """The force of an excitation, that of the first pantograph if none is set [N]."""
    static = problem.train.placements[0].static_force
    return static if settings.force is None else settings.force


def _moving_force(settings: Excited, problem: Problem, dt: float) -> MovingForce:
    """A force that moves with the train."""
    train = problem.train
    frequency = settings.frequency or 0.0
    highest = 0.1 / dt
    if not 0.0 <= frequency <= highest:
        raise InputError(
            f"--frequency-Hz is {frequency:g}, but must be from 0 to {highest:g}, ten time "
            "steps a period"
        )
    force = _force_of(settings, problem)
    _refuse_too_strong("--force-N", force, force)
    return MovingForce(force, frequency, train.start, train.speed, train.raise_time)


def _blow(kind: str, settings: Excited, problem: Problem, dt: float) -> Blow:
    """A pulse, or the blow of a hammer."""
    if problem.window.mode == BOUNDED:
        raise InputError(
            f"window.mode is bounded, which lets move what is near a train, but a {kind} has none: "
            "take exact, or off"
        )
    duration = DURATIONS[kind] if settings.duration is None else settings.duration
    if not 10 * dt <= duration <= 10.0:
        raise InputError(
            f"--duration-s is {duration:g}, but must be from {10 * dt:g}, ten time steps, to 10"
        )
    ends = problem.line.support_positions[[0, -1]]
    at = float(ends.mean()) if settings.at is None else settings.at
    if not ends[0] < at < ends[1]:
        raise InputError(
            f"--at-m is {at:g}, but must lie on the line, from {ends[0]:g} to {ends[1]:g} m"
        )
    if kind == HAMMER:
        impulse = IMPULSE if settings.impulse is None else settings.impulse
        blow = hammer(at, impulse, duration)
        _refuse_too_strong("--impulse-Ns", impulse, blow.peak)
        return blow
    force = _force_of(settings, problem)
    _refuse_too_strong("--force-N", force, force)
    return Blow(at, duration, force, False)


def _refuse_too_strong(option: str, value: float, peak: float) -> None:
    """Raise InputError for a force up to ``peak`` [N] beyond those at which a march ends."""
    if not abs(peak) <= DIVERGED:
        raise InputError(
            f"{option} is {value:g}, a force of up to {abs(peak):g} N, but forces up to "
            f"{DIVERGED:g} N are simulated"
        )


def without_train(problem: Problem, excitation: Excitation) -> Problem:
    """The problem without its train, for as long as waves of the excitation take to the far end.

    A force that moves has the train's course.
    """
    train, ends = problem.train, problem.line.support_positions[[0, -1]]
    place = Placement(_ASIDE, 0.0, 0.0)
    if isinstance(excitation, MovingForce):
        course = Train(train.speed, train.start, train.end, 0.0, (place,))
    else:
        speeds = [slowest_wave_of(problem.line, wire) for wire in problem.line.wires]
        speed, slowest = max(speeds), min(speeds)
        duration = excitation.duration + np.abs(ends - excitation.at).max() / slowest
        # One that creeps: its place is nobody's business, its course is the run's duration.
        creep = 1e-3 * speed
        start = float(ends[0]) + 1e-3 * float(np.ptp(ends))
        course = Train(creep, start, start + creep * float(duration), 0.0, (place,))
    left_out = {"lowering", "vehicle_motion", "several_pantographs", "head_roll"}
    return replace(
        problem,
        train=course,
        contact=LinearLaw(0.0, 0.0),
        effects=problem.effects - left_out,
        numerics=replace(problem.numerics, scheme="one_solve", coupling="implicit"),
    )


class Watch(Observer):
    """Observer that shows the motion of all nodes at every so many steps.

    Parameters
    ----------
    every : steps from one time to the next
    seen : receivers of the motion
    """

    def __init__(self, every: int, seen: Sequence[NodeMotion]) -> None:
        self._every, self._seen = every, seen

    def start(self, stage: Stage) -> None:
        """Match the rows with nodes."""
        self._nodes = stage.owned_nodes
        self._axes = [(k, name) for k, name in enumerate("uvw") if name in stage.unknowns]

    def next_state(self, step: int) -> int:
        """No state is needed."""
        return NEVER

    def next_motion(self, step: int) -> int:
        """The next multiple."""
        return (step // self._every + 1) * self._every

    def observe(self, view: StepView) -> None:
        """Hand over, if it is time."""
        if view.step % self._every == 0:
            moved = np.zeros((self._nodes.size, 3))
            for axis, name in self._axes:
                moved[self._nodes, axis] = view.node_motion(name, False)
            for one in self._seen:
                one.add(view.time, moved)
