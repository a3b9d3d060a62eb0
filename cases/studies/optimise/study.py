"""An optimisation from its task to its tables, and the checks of its optimum.

An optimum is checked on the whole stretch, with finer numerics, and under errors that no search has
seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.process.workers import Pool
from catenary.cases.scene.input.case_files import REMOVED, parse_assignment, value_at
from catenary.cases.scene.load import Draft
from catenary.cases.scene.scene import line_of
from catenary.cases.scene.turned import DIRECTIONS, FORWARD, has_mirrored_line, turned
from catenary.cases.studies.optimise.search import Point, Problem, dropper_table, search
from catenary.cases.studies.optimise.task import OptimiseTask, Variables, variables_of
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.scene_sets import (
    BROKE,
    ErrorSamples,
    Evaluation,
    Member,
    SceneSet,
    Wanted,
    members_of,
    refuse_shared,
)
from catenary.cases.studies.sweep.jobs import statistics_of
from catenary.cases.studies.sweep.variants import share_a_value
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.report.study_table import StudyTable

AS_IS, FINER_MESH, SHORTER_STEP, UNSEEN = "as it is", "mesh x 2", "step / 2", "unseen errors"
# Statistics that are compared, and the direction in which each gets worse.
COMPARED = {"std_N": 1.0, "max_N": 1.0, "min_N": -1.0, "loss_percent": 1.0, "max_uplift_mm": 1.0}
# Changes below this share, or this much of a percentage, are no change.
_SAME = 0.005
# Shares of an optimum's changes that are tried in whole units.
_SHARES = (1.0, 0.97, 0.94, 0.9, 0.8)


@dataclass(frozen=True)
class Plan:
    """An optimisation whose scenes are all checked."""

    name: str
    task: OptimiseTask
    scenes: SceneSet
    variables: Variables
    checks: Mapping[str, SceneSet]
    warnings: Sequence[str]


@dataclass(frozen=True)
class Optimum:
    """Result of a method.

    Attributes
    ----------
    method : "gradient" or "cma"
    shipped, found : the unchanged case and the best point, rounded if a rounded point is allowed
    values : values of the scene's keys at the optimum
    beyond : sentences on the constraints that the best point does not keep
    is_rounded : whether its changes are whole multiples of the task's units
    n_runs : runs of the search
    history : all points of the search
    rows : figures under all checks
    droppers : lengths to which they are cut
    """

    method: str
    shipped: Point
    found: Point
    values: Mapping[str, Any]
    beyond: Sequence[str]
    is_rounded: bool
    n_runs: int
    history: Sequence[Point]
    rows: Sequence[Row]
    droppers: StudyTable

    @property
    def remarks(self) -> list[str]:
        """Sentences on what it did not improve, constraints and the unseen direction first."""
        sentences = list(self.beyond)
        if self.beyond:
            sentences.append(
                f"no point of {len(self.history)} keeps all constraints: this is the one that "
                "violates them least"
            )
        if not self.found.change.any():
            sentences.append(self._nothing_found)
        elif unseen := unseen_direction(self.rows):
            sentences.append(unseen)
        if not self.is_rounded:
            sentences.append("changes in whole units violate constraints: round_to is not kept")
        return sentences + not_improved(self.rows)

    @property
    def _nothing_found(self) -> str:
        others = [point for point in self.history if point.change.any()]
        if not others:
            return "nothing but the case as shipped was run: search.most_runs allows no more"
        text = f"none of {counted(len(others), 'other point')} is better than the case as shipped"
        broke = [point.broke for point in others if point.broke]
        if broke:
            text += f"; {len(broke)} of them broke, the first as {broke[0].rstrip('.')}"
        if len(broke) == len(others):
            text += ": narrow the bounds of the variables, or give them a smaller step"
        return text


def make_plan(draft: Draft, task: OptimiseTask) -> Plan:
    """The plan of a task for a case. Not collective.

    Raises
    ------
    InputError
        If a variable is none of the case, or a scene of the set is wrong.
    """
    whole = draft.scene()
    searched = _shortened(draft) if task.search.short else draft
    is_shortened = searched.raw != draft.raw
    own = [parse_assignment(text, "search.values:") for text in task.search.values]
    searched = searched.assigned((key, value, "in search.values") for key, value in own)
    scenes = _of_any_values(SceneSet(searched, members_of(task.set)).checked())
    variables = variables_of(task.variables, whole)
    for number, table in enumerate(task.variables):
        refuse_shared(scenes.members, table.key, f"variables.{number}")
        for key, _ in own:
            if share_a_value(key, table.key):
                raise InputError(
                    f"search.values give {key}, which variables.{number} vary; leave it out"
                )
    checks = {name: _of_any_values(own) for name, own in _checks_of(draft, task).items()}
    warnings = []
    if is_shortened:
        warnings.append(
            "the search runs the case shortened by its [test] table; figures of the optimum are "
            "those of the whole stretch"
        )
    if task.search.values:
        warnings.append(
            f"the search runs the case with {', '.join(task.search.values)}; figures of checks are "
            "those of the case itself"
        )
    warnings += _narrow(task, scenes, variables)
    return Plan(whole.case.name, task, scenes, variables, checks, warnings)


def _of_any_values(scenes: SceneSet) -> SceneSet:
    """A set that has been checked, whose variables may be of any size: a sag that a search takes
    to 0.1 mm is no slip of a unit."""
    accepted = ("case.accept_unusual", True, "in the search")
    return SceneSet(scenes.draft.assigned([accepted]), scenes.members)


def _shortened(draft: Draft) -> Draft:
    """The case with its ``[test]`` table, to which values that were assigned do not give way."""
    own = [(key, value_at(draft.raw, key), where) for key, where in draft.given]
    given = ((key, REMOVED if value is None else value, where) for key, value, where in own)
    return draft.shortened().assigned(given)


def _narrow(task: OptimiseTask, scenes: SceneSet, variables: Variables) -> list[str]:
    """Warnings of a set that is too narrow to hold elsewhere."""
    found = []
    one_way = len(task.set.directions) == 1
    if one_way and _may_lean(scenes, variables):
        found.append(
            f"the set has the direction {task.set.directions[0]} alone: a line that is good one "
            "way may gain nothing, or lose, the other way; name both in set.directions unless no "
            "train runs back"
        )
    speeds = task.set.speeds_km_h or [0.0]
    if len(speeds) == 1 and len(task.set.trains) < 2:
        found.append(
            "the set has one speed and one train: an optimum may be worse at others; name more in "
            "set.speeds_km_h or set.trains"
        )
    return found


def _may_lean(scenes: SceneSet, variables: Variables) -> bool:
    """Whether some change within bounds makes a line that differs from its mirror image, or has
    none."""
    random = np.random.default_rng(1).uniform(0.0, 0.1, variables.low.size)
    change = random * np.where(variables.high > 0.0, variables.high, variables.low)
    member = scenes.members[0]._replace(direction=FORWARD)
    try:
        scene = scenes.scene(member, variables.values(change))
        return not has_mirrored_line(scene, turned(scene))
    except InputError:
        return True


def optimise(
    plan: Plan,
    pool: Pool[Any] | None = None,
    kept: KeptRows | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> list[Optimum]:
    """Search by each method of the task and check what it finds. Not collective.

    Parameters
    ----------
    pool : processes that share the runs, None for this one
    kept : runs that are not made again
    say : called with lines on the way

    Raises
    ------
    InputError
        If the case as shipped has no figures to begin with.
    """
    evaluation = Evaluation(pool, kept)
    return [_optimum_by(method, plan, evaluation, say) for method in plan.task.search.methods]


def _optimum_by(
    method: str, plan: Plan, evaluation: Evaluation, say: Callable[[str], None]
) -> Optimum:
    task, variables = plan.task, plan.variables
    n_variables = counted(variables.low.size, "variable")
    say(f"{method}: {n_variables}, {counted(len(plan.scenes.members), 'scene')}")
    first = evaluation.n_runs
    problem = Problem(
        plan.scenes,
        variables,
        task.objective,
        task.constraints,
        task.least_dropper_force_N,
        evaluation,
        task.search.most_runs,
        say,
    )
    best = search(problem, method, task.search)
    n_runs, history = evaluation.n_runs - first, tuple(problem.history)
    problem.most_runs = None
    found = _rounded(problem, best)
    shipped = problem.shipped
    values = variables.values(found.change)
    say(f"{method}: {shipped.value:.4g} to {found.value:.4g} in {n_runs} runs; checks")
    rows = _compare(plan.checks, task.set.directions, variables.shipped, values, evaluation)
    droppers = _dropper_lengths(plan, values)
    whole = bool(np.array_equal(variables.rounded(found.change), found.change))
    beyond = problem.beyond(found)
    return Optimum(method, shipped, found, values, beyond, whole, n_runs, history, rows, droppers)


def _rounded(problem: Problem, best: Point) -> Point:
    """The best point in whole units, moved towards the case as shipped if it violates constraints
    more than the best point; the best point itself if no such point is found."""
    for share in _SHARES:
        point = problem.points([problem.variables.rounded(share * best.change)])[0]
        if point.violation <= best.violation:
            return point
    return best


def _dropper_lengths(plan: Plan, values: Mapping[str, Any]) -> StudyTable:
    """Lengths of the whole line's droppers, before and after."""
    scenes = plan.checks[AS_IS]
    member = scenes.members[0]._replace(direction=FORWARD)
    try:
        return dropper_table(scenes.scene(member), scenes.scene(member, values))
    except InputError as error:
        raise InputError(f"the line of the optimum cannot hang: {error}") from error


class Row(NamedTuple):
    """A pantograph of a scene under a check: figures as shipped and at the optimum.

    Attributes
    ----------
    check, scene, direction, pantograph : their names
    searched : whether the search included the direction
    shipped, optimum : statistics of both designs, by name
    failed : acceptance criteria that fail at the optimum alone
    outcome : "done", or the reason why a run has no figures
    """

    check: str
    scene: str
    direction: str
    searched: bool
    pantograph: str
    shipped: Mapping[str, float]
    optimum: Mapping[str, float]
    failed: Sequence[str]
    outcome: str = "done"


def _checks_of(draft: Draft, task: OptimiseTask) -> dict[str, SceneSet]:
    """Scenes under which designs are compared, by the names of checks of a task: on the whole
    stretch of the case and in both directions. InputError if one of them is wrong."""
    both = task.set.model_copy(update={"directions": list(DIRECTIONS)})
    scene = draft.scene()
    numerics: dict[str, list[tuple[str, Any, str]]] = {
        AS_IS: [],
        FINER_MESH: [("mesh.elements_per_gap", 2 * scene.mesh.elements_per_gap, FINER_MESH)],
        SHORTER_STEP: [("numerics.dt_s", 0.5 * scene.numerics.dt_s, SHORTER_STEP)],
    }
    members = _possible(draft, members_of(both), task)
    found = {name: SceneSet(draft.assigned(values), members) for name, values in numerics.items()}
    has_errors = line_of(scene).dropper_x.size and scene.effects.get("dropper_lengths", True)
    if task.checks.n_seeds and has_errors:
        unseen = both.model_copy(update={"errors": _unseen(task)})
        samples = [one for one in members_of(unseen) if one.seed is not None]
        found[UNSEEN] = SceneSet(draft, _possible(draft, samples, task))
    return {name: scenes.checked() for name, scenes in found.items()}


def _possible(draft: Draft, members: Sequence[Member], task: OptimiseTask) -> list[Member]:
    """The members that can be made; a direction that the task has not may be impossible."""
    scenes = SceneSet(draft, members)
    found = []
    for member in members:
        if member.direction not in task.set.directions:
            try:
                scenes.scene(member)
            except InputError:
                continue
        found.append(member)
    return found


def _unseen(task: OptimiseTask) -> ErrorSamples:
    given = task.set.errors
    deviation = task.checks.dropper_lengths_mm if given is None else given.dropper_lengths_mm
    first = 1 + max([0] if given is None else given.seeds)
    seeds = list(range(first, first + task.checks.n_seeds))
    return ErrorSamples(dropper_lengths_mm=deviation, seeds=seeds)


def _compare(
    checks: Mapping[str, SceneSet],
    searched: Sequence[str],
    shipped: Mapping[str, Any],
    optimum: Mapping[str, Any],
    evaluation: Evaluation,
) -> list[Row]:
    """All figures of two designs, given as values by dotted keys; all runs are made together.
    ``searched`` are the directions that the search has seen."""
    places = [(name, member) for name, scenes in checks.items() for member in scenes.members]
    wanted: list[Wanted] = [
        (checks[name], member, values) for values in (shipped, optimum) for name, member in places
    ]
    summaries = evaluation.of(wanted)
    before, after = summaries[: len(places)], summaries[len(places) :]
    rows: list[Row] = []
    for (name, member), one, other in zip(places, before, after, strict=True):
        rows += _rows(name, member, member.direction in searched, one, other)
    return rows


def _rows(
    check: str, member: Member, searched: bool, one: Mapping[str, Any], other: Mapping[str, Any]
) -> list[Row]:
    head = check, member.name, member.direction, searched
    designs = {"shipped": one, "optimum": other}
    broke = [f"{name}: {own[BROKE]}" for name, own in designs.items() if BROKE in own]
    if broke:
        return [Row(*head, "", {}, {}, [], "; ".join(broke))]
    # Acceptance criteria that the optimum fails and the case as shipped does not.
    before, after = (
        {row["criterion"] for row in own["acceptance"] if row["passed"] is False}
        for own in designs.values()
    )
    failed = sorted(after - before)
    return [
        Row(*head, its["pantograph"], _compared(own), _compared(its), failed)
        for own, its in zip(statistics_of(one), statistics_of(other), strict=True)
    ]


def _compared(figures: Mapping[str, Any]) -> dict[str, float]:
    return {name: figures[name] for name in COMPARED if figures[name] is not None}


def change(row: Row, statistic: str) -> float:
    """Relative change of a statistic over its value as shipped; of shares the change itself.

    Zero where a run does not give it.
    """
    if statistic not in row.shipped or statistic not in row.optimum:
        return 0.0
    before, after = row.shipped[statistic], row.optimum[statistic]
    by = after - before
    return by / abs(before) if before and not statistic.endswith("_percent") else by


def not_improved(rows: Sequence[Row]) -> list[str]:
    """Sentences on what gets worse somewhere, and on runs that broke; none if nothing does."""
    sentences = []
    done = [row for row in rows if row.outcome == "done"]
    for name, sign in COMPARED.items():
        worse = [row for row in done if sign * change(row, name) > _SAME]
        if worse:
            most = max(worse, key=lambda row: sign * change(row, name))
            sentences.append(
                f"{name} gets worse in {len(worse)} of {len(done)} rows, most with {most.check}, "
                f"{most.scene}{f', {most.pantograph}' if most.pantograph else ''}: "
                f"{most.shipped[name]:.4g} to {most.optimum[name]:.4g}"
            )
    for criterion in sorted({name for row in done for name in row.failed}):
        where = [row for row in done if criterion in row.failed]
        sentences.append(
            f"the criterion {criterion} fails in {len(where)} rows where the case as shipped "
            f"keeps it, first with {where[0].check}, {where[0].scene}"
        )
    sentences += [
        f"{row.check}, {row.scene}: {row.outcome}" for row in rows if row.outcome != "done"
    ]
    return sentences


def unseen_direction(rows: Sequence[Row]) -> str:
    """Sentence on ``std_N`` in the direction that no search has seen; empty if all were seen."""
    own = [row for row in rows if row.check == AS_IS and row.outcome == "done"]
    seen, unseen = ([row for row in own if row.searched is side] for side in (True, False))
    if not seen or not unseen:
        return ""
    here, there = (max(change(row, "std_N") for row in rows_) for rows_ in (seen, unseen))
    return (
        f"it was searched in the direction {seen[0].direction} alone: std_N changes there by "
        f"{100 * here:+.1f} % at most, and in the other direction by {100 * there:+.1f} %"
    )
