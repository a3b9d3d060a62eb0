"""Checks of an optimum: the whole stretch, finer numerics, errors that no search has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from catenary.base.errors import InputError
from catenary.cases.scene.load import Draft
from catenary.cases.scene.problem import line_of
from catenary.cases.scene.turned import DIRECTIONS
from catenary.cases.studies.optimise.task import OptimiseTask
from catenary.cases.studies.scene_sets import (
    BROKE,
    ErrorSamples,
    Evaluation,
    Member,
    SceneSet,
    Wanted,
    members_of,
)
from catenary.cases.studies.sweep.jobs import statistics_of

AS_IS, FINER_MESH, SHORTER_STEP, UNSEEN = "as it is", "mesh x 2", "step / 2", "unseen errors"
# Statistics that are compared, and the direction in which each gets worse.
COMPARED = {"std_N": 1.0, "max_N": 1.0, "min_N": -1.0, "loss_percent": 1.0, "max_uplift_mm": 1.0}
# Changes below this share, or this much of a percentage, are no change.
_SAME = 0.005


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


def checks_of(draft: Draft, task: OptimiseTask) -> dict[str, SceneSet]:
    """Scenes under which designs are compared, by the names of checks of a task.

    They are on the whole stretch of the case and in both directions.

    Raises
    ------
    InputError
        If a scene of them is wrong.
    """
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


def compare(
    checks: Mapping[str, SceneSet],
    searched: Sequence[str],
    shipped: Mapping[str, Any],
    optimum: Mapping[str, Any],
    evaluation: Evaluation,
) -> list[Row]:
    """All figures of two designs. Not collective; all runs are made together.

    Parameters
    ----------
    checks : scenes in which the designs are compared, by name
    searched : directions that the search has seen
    shipped, optimum : the two designs, as values by dotted keys
    evaluation : runs the scenes
    """
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
