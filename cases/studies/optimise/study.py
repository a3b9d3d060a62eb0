"""An optimisation from its task to its tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.process.workers import Pool
from catenary.cases.scene.input.toml_input import REMOVED, parse_assignment, value_at
from catenary.cases.scene.load import Draft
from catenary.cases.scene.turned import FORWARD, has_mirrored_line, turned
from catenary.cases.studies.optimise.checks import (
    AS_IS,
    Row,
    checks_of,
    compare,
    not_improved,
    unseen_direction,
)
from catenary.cases.studies.optimise.droppers import dropper_table
from catenary.cases.studies.optimise.objective import Point, Problem
from catenary.cases.studies.optimise.search import search
from catenary.cases.studies.optimise.task import OptimiseTask
from catenary.cases.studies.optimise.variables import Variables, variables_of
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.scene_sets import Evaluation, SceneSet, members_of, refuse_shared
from catenary.cases.studies.sweep.variants import share_a_value
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.report.study_table import StudyTable

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
    checks = {name: _of_any_values(own) for name, own in checks_of(draft, task).items()}
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
    return [_by(method, plan, evaluation, say) for method in plan.task.search.methods]


def _by(method: str, plan: Plan, evaluation: Evaluation, say: Callable[[str], None]) -> Optimum:
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
    rows = compare(plan.checks, task.set.directions, variables.shipped, values, evaluation)
    droppers = _cut(plan, values)
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


def _cut(plan: Plan, values: Mapping[str, Any]) -> StudyTable:
    """Lengths of the whole line's droppers, before and after."""
    scenes = plan.checks[AS_IS]
    member = scenes.members[0]._replace(direction=FORWARD)
    try:
        return dropper_table(scenes.scene(member), scenes.scene(member, values))
    except InputError as error:
        raise InputError(f"the line of the optimum cannot hang: {error}") from error
