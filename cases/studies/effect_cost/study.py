"""Cost of each effect of a scene, and the change by it: runs and steps beside the scene as it is.

Figures are those of whole runs over a stretch, costs those of steps in turns on the same stretch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError, RunBroken
from catenary.base.mpi import MPI
from catenary.cases.process.interrupts import Phase
from catenary.cases.run.prepared import rest_of
from catenary.cases.scene.checks.effects import RELATIVE_MOTION, needs_relative_motion
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.input.toml_input import Assigned
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.problem import end_of, problem_of
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.effect_cost.step_timing import RepeatedMarch, Size, beside, in_turns
from catenary.cases.studies.sweep.jobs import (
    Ended,
    Job,
    RunOptions,
    interrupted,
    statistics_of,
)
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant
from catenary.solver.effects import all_effects as effects
from catenary.solver.problem.problem import Problem, steps_of

# Data that an effect lacks, if it does not name them itself.
_NO_DATA = "the scene has no data for it"


@dataclass(frozen=True)
class Switch:
    """One effect switched the other way.

    Attributes
    ----------
    name, title : of the effect
    on : whether the scene simulates it
    keys : all effects that are written into the scene, each with whether it is then on
    together : further effects that begin or end with it, since one requires the other
    """

    name: str
    title: str
    on: bool
    keys: dict[str, bool]
    together: tuple[str, ...]

    @property
    def assignments(self) -> list[str]:
        """The keys as after ``--set``."""
        return [f"effects.{name}={str(on).lower()}" for name, on in self.keys.items()]


UNSWITCHED = Switch("", "", True, {}, ())


@dataclass(frozen=True)
class SwitchableEffects:
    """Effects of a scene that can be switched, and why others cannot.

    Attributes
    ----------
    switches : effects that can be switched, those that are simulated first
    always : names of those that no scene leaves out
    lacking : data that a scene lacks for the others, by their names
    """

    switches: list[Switch]
    always: list[str]
    lacking: dict[str, str]


def switchable_effects(scene: Scene) -> SwitchableEffects:
    """Find the effects of a scene that can be switched. Not collective."""
    problem, known = problem_of(scene), effects.registry()
    active = {effect.name for effect in effects.active(problem)}
    is_on = scene.switches()
    switches, lacking = [], {}
    for name, effect in known.items():
        if effect.always:
            continue
        if name in active:
            on = {n: e for n, e in known.items() if is_on[n]}
            others = _taken_along(name, on, lambda a, b: a in known[b].requires)
            ended = tuple(n for n in others if n in active)
            keys = dict.fromkeys([name, *others], False)
            switches.append(Switch(name, effect.title, True, keys, ended))
        elif effect.applies(problem):
            off = {n: e for n, e in known.items() if not is_on[n]}
            others = _taken_along(name, off, lambda a, b: b in known[a].requires)
            if needs_relative_motion(problem, name):
                others.append(RELATIVE_MOTION)
            keys = dict.fromkeys([name, *others], True)
            switches.append(Switch(name, effect.title, False, keys, tuple(others)))
        else:
            lacking[name] = effect.data or _NO_DATA
    switches.sort(key=lambda switch: not switch.on)
    return SwitchableEffects(switches, [n for n, e in known.items() if e.always], lacking)


def _taken_along(name: str, among: Iterable[str], takes: Callable[[str, str], bool]) -> list[str]:
    """Effects that one takes along, directly and through others, in the registry's order."""
    found, ahead, left = set(), [name], [other for other in among if other != name]
    while ahead:
        one = ahead.pop()
        new = [other for other in left if takes(one, other) and other not in found]
        found.update(new)
        ahead += new
    return [other for other in left if other in found]


# The scene as it is, among the names of runs: no effect has a hyphen in its name.
AS_IT_IS = "as-it-is"
# Steps of a round at least, some milliseconds, and at most; a span between them.
_FEWEST, _MOST = 200, 4000
# The statistics that are compared, of a pantograph and of the line.
FIGURES = ("mean_N", "std_N", "max_N", "min_N")
UPLIFT = "max_uplift_mm"


@dataclass(frozen=True)
class CostOptions:
    """Effects to be measured, and how long.

    Attributes
    ----------
    case, overrides, shortened : as ``load_scene`` takes them
    stretch : length that is evaluated at most [m]
    rounds : how often steps are timed
    tolerance : share below which a change is none to speak of
    only : names of the effects, all if empty
    """

    case: str
    overrides: Sequence[str] = ()
    shortened: bool = False
    stretch: float = 200.0
    rounds: int = 10
    tolerance: float = 0.01
    only: Sequence[str] = ()


@dataclass(frozen=True)
class Measured:
    """A scene with one effect switched, beside the scene as it is; or the latter.

    Attributes
    ----------
    switch : the switched effect, ``UNSWITCHED`` of the scene as it is
    outcome : "done", or the sentence of what is not possible or broke
    size : of the line
    ratio : time of a step over that of the scene as it is
    figures : of each pantograph, as ``statistics_of`` gives them
    remarks : sentences about what decides the run's results
    """

    switch: Switch
    outcome: str
    size: Size | None = None
    ratio: float = math.nan
    figures: list[dict[str, Any]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    @property
    def done(self) -> bool:
        """Whether the run came to its end and its steps were timed."""
        return self.outcome == "done"

    @property
    def cost(self) -> float:
        """Ratio of the times of a step with the effect and without."""
        return 1.0 / self.ratio if self.switch.on else self.ratio


@dataclass(frozen=True)
class Costs:
    """Result of the study.

    Attributes
    ----------
    case : name of the case
    options, effects : the wanted effects, and those that can be switched
    stretch : evaluated, from and to [m]
    n_steps : of a timed round
    step : least time of a step of the scene as it is [us]
    names : of the pantographs
    as_it_is : the scene as it is
    rows : one of each switch
    """

    case: str
    options: CostOptions
    effects: SwitchableEffects
    stretch: tuple[float, float]
    n_steps: int
    step: float
    names: list[str]
    as_it_is: Measured
    rows: list[Measured]


def jobs_of(options: CostOptions) -> tuple[SwitchableEffects, list[Job], dict[str, str]]:
    """Effects that can be switched, the runs for them, and why others cannot. Not collective.

    The first run is of the scene as it is; those of switches have the names of their effects.

    Raises
    ------
    InputError
        If the scene is wrong, or has no such effect to switch.
    """
    whole = load_scene(options.case, options.overrides, options.shortened)
    shorter = _shortened(whole, options.stretch)
    scene = _scene(options, shorter)
    effects = switchable_effects(scene)
    if options.only:
        effects = SwitchableEffects(_named(effects, options.only), effects.always, effects.lacking)
    jobs, refused = [_job(AS_IT_IS, scene)], {}
    for switch in effects.switches:
        try:
            jobs.append(_job(switch.name, _scene(options, [*shorter, *switch.assignments])))
        except InputError as error:
            refused[switch.name] = str(error)
    return effects, jobs, refused


def _named(effects: SwitchableEffects, names: Sequence[str]) -> list[Switch]:
    known = {switch.name: switch for switch in effects.switches}
    for name in names:
        if name in effects.lacking:
            raise InputError(
                f"--only {name}: the scene has no data for it: {effects.lacking[name]}"
            )
        if name in effects.always:
            raise InputError(f"--only {name}: it is part of every scene and cannot be left out")
        if name not in known:
            told = shown(name)[1:-1] or shown(name)
            raise InputError(f"--only {told} is no effect; there are {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(names)]


def _shortened(scene: Scene, stretch: float) -> list[str]:
    """Keys that end a run behind the first ``stretch`` [m] that is evaluated, if it is longer."""
    start, end = scene.evaluation.from_m, scene.evaluation.to_m
    if end - start <= stretch:
        return []
    behind = max(place.behind_m for place in scene.train.pantographs)
    stop = min(start + stretch + behind, end_of(scene))
    dt, speed = scene.numerics.dt_s, scene.train.speed_km_h / 3.6
    last = scene.train.start_m + speed * max((one.at_s for one in scene.incidents), default=0.0)
    stop = max(stop, min(end_of(scene), last + 2 * dt * speed))  # incidents stay inside the run
    return [f"evaluation.to_m={start + stretch!r}", f"train.end_m={stop!r}"]


def _scene(options: CostOptions, further: Sequence[str]) -> Scene:
    varied = [Assigned(text, "--cost", "by plan --cost") for text in further]
    return load_scene(options.case, options.overrides, options.shortened, varied)


def _job(name: str, scene: Scene) -> Job:
    return Job(Variant(name, ()), scene, keep_results=False)


def measure(
    options: CostOptions,
    folder: Path,
    say: Callable[[str], None],
    force: bool = False,
    n_jobs: int = 1,
) -> Costs | None:
    """Run the scene with each effect switched and time its steps; None if a signal ended that.

    Not collective: on this rank alone.

    Parameters
    ----------
    folder : for the runs; what is done there already is not run again
    say : called with lines on the progress
    force : whether other runs there may be replaced
    n_jobs : runs at the same time, 0 for one on each core; steps are timed when these are over

    Raises
    ------
    InputError, RunBroken
        If the scene is wrong; if it breaks as it is, or a signal comes while steps are timed.
    """
    effects, jobs, refused = jobs_of(options)
    comm = MPI.COMM_SELF
    ended = run_jobs(jobs, folder, comm, RunOptions(force, (), say, n_jobs))
    if interrupted(ended):
        return None
    whole, *others = ended
    if not whole.done:
        raise RunBroken(f"the scene as it is breaks: {whole.outcome}")
    scene = jobs[0].scene
    problem = problem_of(scene)
    first, n_steps = _round_of(problem)
    runs: dict[str, tuple[Job, Ended]] = {
        one.variant.name: (job, one) for job, one in zip(jobs[1:], others, strict=True)
    }
    rows = []
    with (
        Phase(comm, "steps were timed", "runs are kept where -o names a folder") as phase,
        RepeatedMarch(comm, rest_of(scene), first, n_steps) as as_it_is,
    ):
        step = in_turns({AS_IT_IS: as_it_is}, options.rounds)[AS_IT_IS]
        for number, switch in enumerate(effects.switches, start=1):
            phase.next(f"steps without or with {switch.name} were timed")
            say(f"[{number}/{len(effects.switches)}] steps: {switch.name}")
            job, one = runs.get(switch.name, (None, None))
            if job is None or one is None or not one.done:
                outcome = refused[switch.name] if one is None else one.outcome
                rows.append(Measured(switch, outcome))
                continue
            with RepeatedMarch(comm, rest_of(job.scene), first, n_steps) as march:
                timed, own = beside(march, as_it_is, options.rounds), march.size
            figures = statistics_of(one.summary)
            rows.append(Measured(switch, "done", own, timed.ratio, figures, one.remarks))
            step = min(step, timed.least_of_other)
    size = as_it_is.size
    unchanged = Measured(UNSWITCHED, "done", size, 1.0, statistics_of(whole.summary), whole.remarks)
    names = [one["name"] for one in whole.summary["pantographs"]]
    stretch = scene.evaluation.from_m, scene.evaluation.to_m
    return Costs(scene.case.name, options, effects, stretch, n_steps, step, names, unchanged, rows)


def _round_of(problem: Problem) -> tuple[int, int]:
    """Step at which rounds begin, where the evaluation does, and the steps of one: some span's."""
    train, dt = problem.train, problem.numerics.dt
    line = problem.line
    span = (line.support_positions[-1] - line.support_positions[0]) / line.n_spans
    n_steps = min(max(round(span / train.speed / dt), _FEWEST), _MOST)
    begin = round((problem.evaluation[0] - train.start) / train.speed / dt)
    first = max(0, min(begin, steps_of(problem) - n_steps))
    return first, min(n_steps, steps_of(problem) - first)
