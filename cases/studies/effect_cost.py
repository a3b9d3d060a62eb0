"""Cost of each effect of a scene, and the change of results by it.

Runs and steps stand beside those of the scene as it is. Figures are those of whole runs over a
stretch, costs those of steps on the same stretch, which marches take again and again, several of
them in turns. Other programs slow all contenders alike, and the least of many rounds is what a step
takes when none does.

Each effect gets a sentence of advice; all of them get a table for a terminal, as CSV and as JSON.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.mpi import MPI
from catenary.cases.process.interrupts import Phase
from catenary.cases.run.at_rest import rest_of
from catenary.cases.scene.checks.effects import RELATIVE_MOTION, needs_relative_motion
from catenary.cases.scene.input.case_files import Assigned
from catenary.cases.scene.input.faults import shown_word
from catenary.cases.scene.load import load_scene, read_draft
from catenary.cases.scene.scene import Scene, end_of, problem_of
from catenary.cases.studies.sweep.jobs import Job, RunOptions, interrupted, statistics_of
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.evaluate.wording import counted, fixed
from catenary.postproc.files.disk import plain
from catenary.postproc.report.study_table import Column, Content, StudyTable, remark_lines
from catenary.solver.effects import all_effects as effects
from catenary.solver.problem.problem import Problem, steps_of
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

# Data that an effect lacks, if it does not name them itself.
_NO_DATA = "the scene has no data for it"
# The scene as it is, among the names of runs: no effect has a hyphen in its name.
AS_IT_IS = "as-it-is"
# Steps of a round at least, some milliseconds, and at most; a span between them.
_FEWEST, _MOST = 200, 4000
# The statistics that are compared, of a pantograph and of the line: heads of their columns, and
# their names in sentences.
UPLIFT = "max_uplift_mm"
_FIGURES = {
    "mean_N": ("mean", "the mean"),
    "std_N": ("sigma", "sigma"),
    "max_N": ("max", "the maximum"),
    "min_N": ("min", "the minimum"),
    UPLIFT: ("uplift", "the uplift"),
}
TABLE, RECORD, TEXT = "cost.csv", "cost.json", "cost.txt"
# In the column "simulated": the scene simulates the effect.
LEFT_OUT = "left out"
# A ratio of times that is none: what clocks and caches make of equal steps.
_SAME_COST = 0.03
# A share of a figure below which digits are noise of no use to anybody.
_NOTHING = 5e-5


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
            raise InputError(
                f"--only {shown_word(name)} is no effect; there are {', '.join(known)}"
            )
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
    draft = read_draft(options.case, options.overrides, options.shortened)
    return draft.with_words(varied).scene()


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
    outcomes = refused | {one.variant.name: one.outcome for one in others}
    pairs = zip(jobs[1:], others, strict=True)
    done = {one.variant.name: (job.scene, one) for job, one in pairs if one.done}
    rows = []
    with (
        Phase(comm, "steps were timed", "runs are kept where -o names a folder") as phase,
        RepeatedMarch(comm, rest_of(scene), first, n_steps) as as_it_is,
    ):
        step = in_turns({AS_IT_IS: as_it_is}, options.rounds)[AS_IT_IS]
        for number, switch in enumerate(effects.switches, start=1):
            phase.next(f"steps without or with {switch.name} were timed")
            say(f"[{number}/{len(effects.switches)}] steps: {switch.name}")
            if switch.name not in done:
                rows.append(Measured(switch, outcomes[switch.name]))
                continue
            own_scene, one = done[switch.name]
            with RepeatedMarch(comm, rest_of(own_scene), first, n_steps) as march:
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


class Size(NamedTuple):
    """Unknowns of a line, of its stations (fewest, most), and of a cross-section by planes."""

    n_unknowns: int
    of_a_station: tuple[int, int]
    planes: tuple[int, ...]


class RepeatedMarch(AbstractContextManager["RepeatedMarch"]):
    """A march over some steps that starts again and again from one of its states.

    Collective to make. A context manager that destroys the march.

    Parameters
    ----------
    comm : mpi4py communicator
    at_rest : line that is marched
    first : step from which rounds start, which the march runs to once
    n_steps : of a round; those to the end of the run if there are fewer

    Raises
    ------
    RunBroken
        If the march does not come to the end of the first round.
    """

    def __init__(self, comm: Any, at_rest: LineAtRest, first: int = 0, n_steps: int = NEVER):
        problem = at_rest.problem
        train, dt = problem.train, problem.numerics.dt
        last = min(first + n_steps, steps_of(problem))
        if last < steps_of(problem):
            end = train.start + (last + 0.5) * dt * train.speed
            problem = replace(problem, train=replace(train, end=end))
        self._comm = comm
        self._march = March(comm, problem, at_rest.model, at_rest.form, at_rest.lift)
        numbering = at_rest.model.numbering
        of_stations = list(map(len, numbering.station_types))
        fewest_and_most = min(of_stations), max(of_stations)
        self.size = Size(numbering.n_unknowns, fewest_and_most, self._march.station_widths)
        kept = _Kept(first)
        outcome = self._march.run([kept])
        if outcome.outcome != "done":
            self._march.destroy()
            raise RunBroken(outcome.outcome)
        self._state = comm.bcast(kept.state)

    def step_cost(self) -> float:
        """Time of a step of one more round [us], on the slowest rank. Collective."""
        self._march.restore(self._state)
        outcome = self._march.run([])
        cost = 1e6 * outcome.wall / max(1, outcome.n_steps)
        return float(max(self._comm.allgather(cost)))

    def destroy(self) -> None:
        """Collective."""
        self._march.destroy()

    def __exit__(self, *error: object) -> None:
        self.destroy()


class _Kept(Observer):
    """Observer that keeps the state of one step."""

    def __init__(self, step: int) -> None:
        self._step = step
        self.state: dict[str, Any] | None = None

    def next_state(self, step: int) -> int:
        """The step that is kept, then none."""
        return self._step if step < self._step else NEVER

    def observe(self, view: StepView) -> None:
        """Keep the state of the step."""
        if view.step == self._step:
            self.state = view.checkpoint()


class Beside(NamedTuple):
    """Steps of a march beside those of another: least times [us], and their ratio."""

    least: float
    least_of_other: float
    ratio: float


def beside(march: RepeatedMarch, other: RepeatedMarch, rounds: int) -> Beside:
    """Time of steps of a march over the time of steps of an ``other`` one. Collective.

    A round marches both twice, as in a b b a, and takes the lesser of each. The ratio is the median
    of rounds: where the machine slows down for some of them, it does so for both.
    """
    found = np.empty((rounds, 2))
    for number in range(rounds):
        a, b, again, last = (m.step_cost() for m in (march, other, other, march))
        found[number] = min(a, last), min(b, again)
    least = found.min(axis=0)
    return Beside(float(least[0]), float(least[1]), float(np.median(found[:, 0] / found[:, 1])))


def in_turns(marches: Mapping[str, RepeatedMarch], rounds: int) -> dict[str, float]:
    """Least time of a step of each of several marches, by name [us]. Collective.

    In each of ``rounds`` rounds the marches take turns.
    """
    least = dict.fromkeys(marches, np.inf)
    for _ in range(rounds):
        for name, march in marches.items():
            least[name] = min(least[name], march.step_cost())
    return least


class Change(NamedTuple):
    """A figure of a pantograph that an effect changes.

    ``share`` is the change, switched against as it is: of sigma in sigma, of the uplift in the
    uplift, of the mean force in the others; infinite where a figure comes or goes.
    """

    figure: str
    pantograph: int
    share: float


def _share(before: dict[str, Any], after: dict[str, Any], name: str) -> float | None:
    a, b = before[name], after[name]
    if a is None and b is None:
        return None
    of = before[name if name in ("std_N", UPLIFT) else "mean_N"]
    if a is None or b is None or not of:
        return 0.0 if a == b else math.inf
    return float((b - a) / abs(of))


def _largest(found: Costs, row: Measured) -> Change | None:
    """The largest change of a figure of a pantograph by the switch of a ``row``, None if no figure
    is known."""
    pairs = enumerate(zip(found.as_it_is.figures, row.figures, strict=False))
    changes = (
        Change(name, number, share)
        for number, (before, after) in pairs
        for name in _FIGURES
        if (share := _share(before, after, name)) is not None
    )
    return max(changes, key=lambda change: abs(change.share), default=None)


def advice(found: Costs, row: Measured) -> str:
    """One sentence on whether to simulate the effect of a ``row``."""
    verb = "leave it out" if row.switch.on else "switch it on"
    if not row.done:
        return f"it was not measured, for you cannot {verb} here: {row.outcome.rstrip('.')}."
    change = _largest(found, row)
    if change is None:
        return f"it {_price(row.cost)}; the stretch gives no figures to compare."
    what = _words(found, change)
    if abs(change.share) >= found.options.tolerance:
        if row.switch.on:
            return f"it {_price(row.cost)}; without it {what}: keep it."
        return f"it {_price(row.cost)}, and with it {what}: switch it on if its data are sound."
    within = f"{100 * found.options.tolerance:g} %"
    if not row.switch.on:
        return f"it {_price(row.cost)}; with it {what}: leave it out for figures within {within}."
    if row.cost <= 1.0 + _SAME_COST:
        return f"it {_price(row.cost)}; without it {what}: keep it, or leave it out."
    return f"it {_price(row.cost)}; without it {what}: leave it out for figures within {within}."


def _price(cost: float) -> str:
    if abs(cost - 1.0) <= _SAME_COST:
        return "has no measurable cost"
    return f"makes a step {cost:.2f} times as long"


def _words(found: Costs, change: Change) -> str:
    whose = f" of {found.names[change.pantograph]}" if len(found.names) > 1 else ""
    what = _FIGURES[change.figure][1] + (whose if change.figure != UPLIFT else "")
    if math.isinf(change.share):
        return f"{what} comes or goes"
    if abs(change.share) < _NOTHING:
        return "no figure changes"
    of = " of the mean" if change.figure in ("max_N", "min_N") else ""
    percent = 100 * change.share
    number = f"{percent:+.0f}" if abs(percent) >= 10 else f"{percent:+.2g}"
    return f"{what} changes most, by {number} %{of}"


def width_text(size: Size) -> str:
    """Unknowns of a station: by planes, or of the smallest to the largest."""
    low, high = size.of_a_station
    if len(size.planes) > 1 and low == high:
        return "+".join(map(str, size.planes))
    return f"{low}" if low == high else f"{low} to {high}"


def as_text(found: Costs, *, whole: bool = False) -> str:
    """The table: switched against as it is, then advice, then what is not measured; ``whole``, for
    a file, whatever the width of the terminal."""
    (start, end), rounds = found.stretch, found.options.rounds
    table = table_of(found)
    mine = ("", found.names[0])
    leading = replace(table, rows=[row for row in table.rows if row["pantograph"] in mine])
    lines = [
        f"{found.case}: evaluated from {start:g} to {end:g} m; {counted(rounds, 'repetition')} of "
        f"{counted(found.n_steps, 'step')} in turns.",
        "Forces in N, uplift in mm; the row of an effect shows the changes when it is switched.",
        "cost: time of a step with the effect over that without, the median of the repetitions.",
    ]
    if len(found.names) > 1:
        lines.append(f"Forces are those of {found.names[0]}, which leads.")
    lines += ["", leading.text(whole=whole), "", "Advice:"]
    width = max(len(row.switch.name) for row in found.rows) if found.rows else 0
    lines += [f"  {row.switch.name:{width}}  {_sentence(found, row)}" for row in found.rows]
    remarks = remark_lines((_run(one), one.remarks) for one in (found.as_it_is, *found.rows))
    lines += ["", *remarks] if remarks else []
    if found.options.only:
        return "\n".join(lines)
    if found.effects.always:
        lines += ["", f"Part of every scene: {', '.join(found.effects.always)}."]
    if found.effects.lacking:
        lines += ["", "Could be switched on with data that the scene lacks:"]
        wide = max(map(len, found.effects.lacking))
        lines += [f"  {name:{wide}}  {data}" for name, data in found.effects.lacking.items()]
    return "\n".join(lines)


def table_of(found: Costs) -> StudyTable:
    """A row of each switch and pantograph, the scene as it is first.

    People read rows of the leading pantograph, with changes of its figures.
    """
    changed = [part for name in _FIGURES for part in (name, f"change_of_{name}")]
    files = ["effect", "simulated", "together", "outcome", "n_unknowns", "unknowns_of_a_station"]
    files += ["pantograph", *changed, "us_per_step", "cost", "from_m", "to_m", "advice", "remarks"]
    people = [
        ("run", "run", ""),
        ("n_unknowns", "unknowns", "d"),
        ("unknowns_of_a_station", "station", ">"),
        ("us_per_step", "us/step", ".1f"),
        ("cost", "cost", ".2f"),
        *((f"shown_{name}", head, ">") for name, (head, _) in _FIGURES.items()),
    ]
    columns = [*map(Column, files), *(Column(*one, in_files=False) for one in people)]
    rows = [row for one in (found.as_it_is, *found.rows) for row in _rows(found, one)]
    return StudyTable(columns, rows)


def _rows(found: Costs, one: Measured) -> list[dict[str, Any]]:
    """The rows of a switch, or of the scene as it is, one of each pantograph."""
    switch, size = one.switch, one.size
    switched = LEFT_OUT if switch.on else "switched on"
    head: dict[str, Any] = {
        "run": _run(one),
        "effect": switch.name,
        "simulated": switched if switch.name else "as it is",
        "together": list(switch.together),
        "outcome": one.outcome,
        "n_unknowns": size and size.n_unknowns,
        "unknowns_of_a_station": width_text(size) if size else "",
        "us_per_step": plain(found.step * one.ratio),
        "cost": one.cost if switch.name and one.done else None,
        "from_m": found.stretch[0],
        "to_m": found.stretch[1],
        "advice": _sentence(found, one) if switch.name else "",
        "remarks": one.remarks,
    }
    rows = []
    for number, own in enumerate(one.figures or [{}]):
        row = {**head, "pantograph": found.names[number] if one.figures else ""}
        for name in _FIGURES:
            value, first = own.get(name), found.as_it_is.figures[number][name]
            change = None if value is None or first is None else value - first
            shown = None if change is None else f"{change:+.2f}"
            if not switch.name and value is not None:
                shown = fixed(value, 2)
            row |= {name: value, f"change_of_{name}": change, f"shown_{name}": shown}
        rows.append(row)
    return rows


def _run(row: Measured) -> str:
    """A run's name as in the table."""
    if not row.switch.name:
        return "as it is"
    return f"{'without' if row.switch.on else 'with'} {row.switch.name}"


def _sentence(found: Costs, row: Measured) -> str:
    """The advice on the effect of a ``row``, and the effects that are switched with it."""
    text = advice(found, row)
    if not row.switch.together:
        return text
    others = ", ".join(row.switch.together)
    return f"{text} Switched with it, since one requires the other: {others}."


def record_of(found: Costs) -> dict[str, Any]:
    """Record of the study, for JSON."""
    return {
        "case": found.case,
        "assignments": list(found.options.overrides),
        "evaluation_m": list(found.stretch),
        "rounds": found.options.rounds,
        "steps_of_a_round": found.n_steps,
        "always": found.effects.always,
        "lacking_data": found.effects.lacking,
        "rows": table_of(found).records(),
    }


def files_of(found: Costs) -> dict[str, Content]:
    """Table, record and text. Not collective."""
    return {
        TABLE: table_of(found),
        RECORD: record_of(found),
        TEXT: as_text(found, whole=True) + "\n",
    }
