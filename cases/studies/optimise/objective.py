"""Objective and constraints of an optimisation at points, with slopes by finite differences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.studies.optimise.droppers import least_forces
from catenary.cases.studies.optimise.task import ConstraintTable, ObjectiveTable
from catenary.cases.studies.optimise.variables import Variables
from catenary.cases.studies.scene_sets import BROKE, Evaluation, SceneSet, Wanted, values_of

# A violation of a constraint smaller than this share of its scale is round-off of a search.
SLACK = 1e-6
# Scale of forces of droppers at rest [N].
_FORCE_AT_REST = 100.0
# Steps of slopes of forces at rest, over those of runs: without sudden slackening anywhere.
_OF_STEP = 0.05
# Least margin of such forces from which changes are scaled, in their scale.
_LEAST_REST = 0.05
# Of the shipped value: the objective of a point whose runs broke, which a search leaves again.
_OF_BROKEN = 10.0


class Spent(Exception):
    """A search has made all the runs that it may make."""


@dataclass(frozen=True)
class Point:
    """A change of the variables and what comes of it.

    Attributes
    ----------
    change : (n,), in the units of the keys
    objective : statistic of every pantograph of every scene over the worst one as shipped
    margins : of every constraint for the same, and of droppers at rest, each divided by its scale;
        negative where it is violated
    value : the objective, worst or mean, in the statistic's unit
    broke : why a run has no figures, empty if all have
    """

    change: np.ndarray
    objective: np.ndarray
    margins: np.ndarray
    value: float
    broke: str = ""

    @property
    def violation(self) -> float:
        """Sum of what is beyond bounds, in scales of the constraints; infinite if a run broke."""
        if self.broke:
            return np.inf
        return float(-np.sum(self.margins[self.margins < -SLACK]))

    def better_than(self, other: Point) -> bool:
        """Whether it violates less, or as much with a smaller objective."""
        return (self.violation, self.value) < (other.violation, other.value)


@dataclass
class Problem:
    """An optimisation over a set of scenes. Not collective.

    Attributes
    ----------
    scenes, variables : set of scenes, and quantities that are varied
    objective, constraints : as the task has them
    least_dropper_force : that droppers keep at rest, if the line is varied [N]
    evaluation : makes the runs
    most_runs : of the search, after which ``Spent`` is raised; None for any number
    say : called with a line for each point that is better than all before
    history : all points, in the order in which they were asked for
    """

    scenes: SceneSet
    variables: Variables
    objective: ObjectiveTable
    constraints: Sequence[ConstraintTable]
    least_dropper_force: float
    evaluation: Evaluation
    most_runs: int | None
    say: Callable[[str], None] = lambda line: None
    history: list[Point] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._first_run = self.evaluation.n_runs
        self._scale, self._sizes = 1.0, (1, 0)
        self._bounds: list[tuple[np.ndarray, np.ndarray]] = []
        start = self.shipped
        if start.broke:
            raise InputError(f"the case as shipped has no figures to begin with: {start.broke}")
        self._scale = abs(start.value) or 1.0
        self.history.clear()

    @property
    def shipped(self) -> Point:
        """The point without change."""
        return self.points([np.zeros(len(self.variables.components))])[0]

    @property
    def is_worst(self) -> bool:
        """Whether the objective is the greatest value of all scenes, else their mean."""
        return self.objective.over == "worst"

    def best(self) -> Point:
        """The best point so far: allowed before not allowed, then by the objective."""
        return self._best

    def points(self, changes: Sequence[np.ndarray]) -> list[Point]:
        """Evaluate and record changes, (n,) each, with the runs of all of them made together.

        Raises
        ------
        Spent
            If ``most_runs`` have been made before.
        """
        made = self.evaluation.n_runs - self._first_run
        if self.most_runs is not None and made >= self.most_runs:
            raise Spent
        wanted: list[Wanted] = [
            (self.scenes, member, self.variables.values(change))
            for change in changes
            for member in self.scenes.members
        ]
        summaries, n = self.evaluation.of(wanted), len(self.scenes.members)
        found = [
            self._point(change, summaries[i * n : (i + 1) * n]) for i, change in enumerate(changes)
        ]
        for point in found:
            if not self.history:
                self._best = point
            elif point.better_than(self._best):
                self._best = point
                self._tell(point)
            self.history.append(point)
        return found

    def slopes(self, at: Point) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of objective and margins by the change over the width of its bounds.

        Forward differences, backward ones at an upper bound and where the step forward broke; zero
        where both broke.

        Returns
        -------
        (n_objective, n) and (n_margins, n)
        """
        own = self.variables
        width = own.high - own.low
        forward = at.change + own.steps <= own.high
        signs = np.where(forward, 1.0, -1.0)
        near = self.points(
            [_moved(at.change, i, signs[i] * own.steps[i]) for i in range(width.size)]
        )
        again = [i for i, point in enumerate(near) if point.broke]
        other = self.points([_moved(at.change, i, -signs[i] * own.steps[i]) for i in again])
        for i, point in zip(again, other, strict=True):
            near[i], signs[i] = point, -signs[i]
        objective = np.zeros((at.objective.size, width.size))
        margins = np.zeros((at.margins.size, width.size))
        for i, point in enumerate(near):
            if not point.broke:
                by = signs[i] * own.steps[i] / width[i]
                objective[:, i] = (point.objective - at.objective) / by
                margins[:, i] = (point.margins - at.margins) / by
        return objective, margins

    def _point(self, change: np.ndarray, summaries: Sequence[dict[str, Any]]) -> Point:
        found = [self._figures(summary) for summary in summaries]
        broke = next((one for one in found if isinstance(one, str)), "")
        if broke:
            n_objective, n_margins = self._sizes
            objective = np.full(n_objective, _OF_BROKEN)
            return Point(change, objective, np.full(n_margins, -1.0), np.inf, broke)
        whole = [one for one in found if not isinstance(one, str)]
        counted = [own for (own, _), one in zip(whole, self._counts, strict=True) if one]
        objective = np.concatenate(counted)
        bounded = [[values[i] for _, values in whole] for i in range(len(self.constraints))]
        if not self._bounds:  # this is the case as shipped
            self._bounds = [
                self._bound(one, values)
                for one, values in zip(self.constraints, bounded, strict=True)
            ]
        margins = np.concatenate(
            [
                *(
                    sign_scale * (np.concatenate(values) - bound)
                    for values, (bound, sign_scale) in zip(bounded, self._bounds, strict=True)
                ),
                self._at_rest(change),
            ]
        )
        self._sizes = objective.size, margins.size
        value = float(objective.max() if self.is_worst else objective.mean())
        return Point(change, objective / self._scale, margins, value)

    def _bound(
        self, one: ConstraintTable, shipped: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the values of a constraint, as shipped one array a scene, and what makes a
        margin of the distance from them: its sign over its scale."""
        sign = 1.0 if one.at_least is not None else -1.0
        bound = one.at_least if one.at_least is not None else one.at_most
        assert bound is not None
        values = np.concatenate(shipped)
        if one.of_shipped is None:
            return np.full(values.size, bound), np.full(values.size, sign / one.scale)
        if one.of_shipped == "speed":
            members = zip(self.scenes.members, shipped, strict=True)
            speeds = np.concatenate(
                [np.full(own.size, member.speed or 0.0) for member, own in members]
            )
            for speed in np.unique(speeds):
                own = speeds == speed
                values[own] = -sign * np.max(-sign * values[own])
        # A share of what is negative goes as far to the same side: -3 may fall by as much as 3 may.
        bounds = np.where(values < 0.0, 2.0 - bound, bound) * values
        return bounds, sign / np.where(values == 0.0, 1.0, np.abs(values))

    @property
    def _counts(self) -> list[bool]:
        """Whether each scene counts in the objective."""
        speeds = self.objective.speeds_km_h
        return [speeds is None or member.speed in speeds for member in self.scenes.members]

    def beyond(self, point: Point) -> list[str]:
        """Sentences on the constraints that a point does not keep, and by how much at most."""
        found, first = [], 0
        for one, (bound, sign_scale) in zip(self.constraints, self._bounds, strict=True):
            own = point.margins[first : first + bound.size]
            first += bound.size
            if (own < -SLACK).any():
                by = float(np.max(-own / np.abs(sign_scale)))
                of = " of the value as shipped" if one.of_shipped else ""
                found.append(f"{one.text}{of} is not kept, by up to {by:.3g}")
        at_rest = point.margins[first:]
        if (at_rest < -SLACK).any():
            force = _FORCE_AT_REST * float(at_rest.min()) + self.least_dropper_force
            found.append(
                f"a dropper has {force:.3g} N at rest, less than least_dropper_force_N = "
                f"{self.least_dropper_force:g}"
            )
        return found

    def natural_steps(self, spread: float) -> np.ndarray:
        """Columns (n, n), whose sums with standard normal factors are changes with taut droppers.

        The standard deviations of the changes are at most ``spread`` times the width of the
        bounds, those of dropper forces at rest at most half of their margin above the least one.
        A change of a single sag by some millimetres would make neighbours slack. Makes no runs.
        """
        own = self.variables
        width = own.high - own.low
        information = np.diag(1.0 / (spread * width) ** 2)
        rest = self._at_rest(np.zeros(width.size))
        if rest.size:
            by = _OF_STEP * np.where(own.steps <= own.high, own.steps, -own.steps)
            slopes = np.column_stack(
                [
                    (self._at_rest(_moved(np.zeros(width.size), i, step)) - rest) / step
                    for i, step in enumerate(by)
                ]
            )
            slopes /= 0.5 * np.maximum(rest, _LEAST_REST)[:, None]
            information += slopes.T @ slopes
        return np.linalg.cholesky(np.linalg.inv(information))

    def _at_rest(self, change: np.ndarray) -> np.ndarray:
        """Margins of the droppers of the first scene's line at rest; it hangs, as its run did."""
        if not any(one.key.startswith("line.") for one in self.variables.components):
            return np.zeros(0)
        scene = self.scenes.scene(self.scenes.members[0], self.variables.values(change))
        return (least_forces(scene) - self.least_dropper_force) / _FORCE_AT_REST

    def _tell(self, point: Point) -> None:
        state = "" if not point.violation else ", constraints not kept"
        runs = self.evaluation.n_runs - self._first_run
        self.say(f"    {runs} runs: {self.objective.statistic} {point.value:.4g}{state}")

    def _figures(self, summary: dict[str, Any]) -> tuple[np.ndarray, list[np.ndarray]] | str:
        """Objective and values of each constraint of a run, or why it has none."""
        objective = values_of(summary, self.objective.statistic)
        bounded = [values_of(summary, one.statistic) for one in self.constraints]
        if objective is None or None in bounded:
            return str(summary.get(BROKE, "the run has no such statistic"))
        return np.array(objective), [np.array(values) for values in bounded]


def _moved(change: np.ndarray, i: int, by: float) -> np.ndarray:
    found = change.copy()
    found[i] += by
    return found
