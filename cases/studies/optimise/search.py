"""Search for an optimum: objective and constraints at points, and two methods that choose points.

Slopes are finite differences; the methods are sequential quadratic programming and an evolution
strategy. Droppers have least forces at rest, which are constraints, and lengths before and after,
which an installer needs.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from catenary.base.errors import InputError
from catenary.cases.run.at_rest import static_table
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.optimise.task import (
    CMA,
    GRADIENT,
    ConstraintTable,
    ObjectiveTable,
    SearchTable,
    Variables,
)
from catenary.cases.studies.scene_sets import BROKE, Evaluation, SceneSet, Wanted, values_of
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.statics.line_at_rest import stable_form

_COLUMNS = (
    Column("span", "span", "d"),
    Column("dropper", "dropper", "d"),
    Column("wires", "wires", in_files=True),
    Column("in_span_m", "from the support [m]", ".3f"),
    Column("moved_mm", "moved [mm]", "+.1f"),
    Column("shipped_mm", "as shipped [mm]", ".1f"),
    Column("length_mm", "length [mm]", ".1f"),
    Column("change_mm", "change [mm]", "+.1f"),
)
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
# Greatest first standard deviation of the evolution strategy, over the width of the bounds.
_FIRST_SPREAD = 0.15
_MOST_ITERATIONS = 200
# Iterations of SLSQP that must gain something together.
_FRUITLESS = 3
# Objective of points that violate constraints: they rank behind all that do not.
_BEHIND = 1e3


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
    best : of them: allowed before not allowed, then by the objective
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
    best: Point = field(init=False)

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
                self.best = point
            elif point.better_than(self.best):
                self.best = point
                state = "" if not point.violation else ", constraints not kept"
                runs = self.evaluation.n_runs - self._first_run
                self.say(f"    {runs} runs: {self.objective.statistic} {point.value:.4g}{state}")
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
        statistics = [self.objective.statistic, *(one.statistic for one in self.constraints)]
        found: list[list[Any]] = [
            [values_of(one, name) for name in statistics] for one in summaries
        ]
        for summary, own in zip(summaries, found, strict=True):
            if None in own:
                n_objective, n_margins = self._sizes
                lacks = f"the run has no {statistics[own.index(None)]}"
                broke = str(summary.get(BROKE, lacks))
                objective = np.full(n_objective, _OF_BROKEN)
                return Point(change, objective, np.full(n_margins, -1.0), np.inf, broke)
        values, *bounded = zip(*found, strict=True)
        speeds, members = self.objective.speeds_km_h, self.scenes.members
        counts = [speeds is None or member.speed in speeds for member in members]
        objective = np.concatenate([own for own, one in zip(values, counts, strict=True) if one])
        if not self._bounds:  # this is the case as shipped
            self._bounds = [
                self._bound(one, own) for one, own in zip(self.constraints, bounded, strict=True)
            ]
        margins = [
            sign_scale * (np.concatenate(own) - bound)
            for own, (bound, sign_scale) in zip(bounded, self._bounds, strict=True)
        ]
        every = np.concatenate([*margins, self._at_rest(change)])
        self._sizes = objective.size, every.size
        value = float(objective.max() if self.is_worst else objective.mean())
        return Point(change, objective / self._scale, every, value)

    def _bound(
        self, one: ConstraintTable, shipped: Sequence[Sequence[float]]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the values of a constraint, as shipped a list for each scene, and what makes a
        margin of the distance from them: its sign over its scale."""
        sign, bound = 1.0 if one.at_least is not None else -1.0, one.limit
        values = np.concatenate(shipped)
        if one.of_shipped is None:
            return np.full(values.size, bound), np.full(values.size, sign / one.scale)
        if one.of_shipped == "speed":
            of_members = [member.speed or 0.0 for member in self.scenes.members]
            speeds = np.repeat(of_members, [len(own) for own in shipped])
            for speed in np.unique(speeds):
                own = speeds == speed
                values[own] = -sign * np.max(-sign * values[own])
        # A share of what is negative goes as far to the same side: -3 may fall by as much as 3 may.
        bounds = np.where(values < 0.0, 2.0 - bound, bound) * values
        return bounds, sign / np.where(values == 0.0, 1.0, np.abs(values))

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


def _moved(change: np.ndarray, i: int, by: float) -> np.ndarray:
    found = change.copy()
    found[i] += by
    return found


def search(problem: Problem, method: str, table: SearchTable) -> Point:
    """The best point that a method finds from the case as shipped. Not collective."""
    methods = {GRADIENT: _by_gradient, CMA: _by_evolution}
    try:
        problem.points([np.zeros(problem.variables.low.size)])
        methods[method](problem, table)
    except Spent:
        pass
    return problem.best


def _by_gradient(problem: Problem, table: SearchTable) -> None:
    """SciPy's SLSQP (D. Kraft, DFVLR-FB 88-28, 1988) on changes over the width of their bounds.

    The worst of many values has kinks; in its place stands a further unknown t that no value may
    exceed, which is to be as small as can be.
    """
    from scipy.optimize import minimize

    low = problem.variables.low
    width, n, worst = problem.variables.high - low, low.size, problem.is_worst

    @cache
    def at(key: bytes) -> Point:
        (point,) = problem.points([low + np.frombuffer(key) * width])
        return point

    @cache
    def slopes_at(key: bytes) -> tuple[np.ndarray, np.ndarray]:
        return problem.slopes(at(key))

    # Functions of z: changes from 0 at the lower to 1 at the upper bound, then t.
    def point(z: np.ndarray) -> Point:
        return at(np.clip(z[:n], 0.0, 1.0).tobytes())

    def slopes(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return slopes_at(np.clip(z[:n], 0.0, 1.0).tobytes())

    def margin_slopes(z: np.ndarray) -> np.ndarray:
        found = slopes(z)[1]
        return np.column_stack([found, np.zeros((found.shape[0], z.size - n))])

    def below_slopes(z: np.ndarray) -> np.ndarray:
        found = slopes(z)[0]
        return np.column_stack([-found, np.ones(found.shape[0])])

    gains: list[float] = []

    def stalled(z: np.ndarray) -> None:
        """End a search whose last iterations together gained less than the precision: slopes over
        kinks mislead SLSQP near the optimum into many short steps."""
        gains.append(np.inf if problem.best.violation else problem.best.value)
        before = gains[-1 - _FRUITLESS] if len(gains) > _FRUITLESS else np.inf
        if before - gains[-1] < table.precision * abs(before):
            raise Spent

    start = -low / width
    constraints: list[dict[str, Any]] = []
    if point(start).margins.size:
        margins = {"fun": lambda z: point(z).margins, "jac": margin_slopes}
        constraints.append({"type": "ineq"} | margins)
    bounds: list[tuple[float | None, float | None]] = [(0.0, 1.0)] * n
    objective = {"fun": lambda z: point(z).objective.mean(), "jac": lambda z: slopes(z)[0].mean(0)}
    if worst:
        below = {"fun": lambda z: z[n] - point(z).objective, "jac": below_slopes}
        constraints.append({"type": "ineq"} | below)
        bounds.append((None, None))
        start = np.append(start, point(start).objective.max())
        objective = {"fun": lambda z: z[n], "jac": lambda z: np.append(np.zeros(n), 1.0)}
    minimize(
        **objective,
        x0=start,
        bounds=bounds,
        constraints=constraints,
        callback=stalled,
        method="SLSQP",
        options={"ftol": 0.1 * table.precision, "maxiter": _MOST_ITERATIONS},
    )


def _by_evolution(problem: Problem, table: SearchTable) -> None:
    """CMA-ES (N. Hansen, arXiv:1604.00772), all points of a generation at once.

    It ranks points and needs no slopes; those that violate constraints stand behind all others, in
    the order of their violation (K. Deb, Comput. Methods Appl. Mech. Engrg. 186, 2000), and those
    beyond bounds or that broke by how far they are.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on what it could plot if other packages were there
        import cma

    low, high = problem.variables.low, problem.variables.high
    steps = problem.natural_steps(_FIRST_SPREAD)
    options = {
        "seed": table.seed + 1,  # it takes 0 for the time of the day
        "tolfun": table.precision,
        "tolfunhist": table.precision,
        "verbose": -9,
    }
    strategy = cma.CMAEvolutionStrategy(np.zeros(low.size), 1.0, options)
    scale = abs(problem.history[0].value) or 1.0
    while not strategy.stop():
        asked = strategy.ask()
        wanted = [steps @ one for one in asked]
        found = problem.points([np.clip(one, low, high) for one in wanted])
        ranks = []
        for share, change, point in zip(asked, wanted, found, strict=True):
            rank = float(np.linalg.norm((change - point.change) / (high - low)))
            if point.broke:
                rank += _BEHIND * (10.0 + float(np.linalg.norm(share)))
            else:
                rank += _BEHIND + point.violation if point.violation else point.value / scale
            ranks.append(rank)
        strategy.tell(asked, ranks)


def dropper_table(shipped: Scene, optimum: Scene) -> StudyTable:
    """A row for each dropper of the line: unstretched lengths, to which they are cut.

    Both scenes have as many droppers in each span. Not collective.
    """
    before, after = _droppers(shipped), _droppers(optimum)
    rows = pd.DataFrame(
        {
            "span": after["span"] + 1,
            "dropper": after.groupby("span").cumcount() + 1,
            "wires": after["wires"],
            "in_span_m": after["in_span"],
            "moved_mm": 1e3 * (after["in_span"] - before["in_span"]),
            "shipped_mm": 1e3 * before["length"],
            "length_mm": 1e3 * after["length"],
            "change_mm": 1e3 * (after["length"] - before["length"]),
        }
    )
    return StudyTable(_COLUMNS, rows.to_dict("records"), "Lengths of droppers")


def of_middle_span(table: StudyTable) -> StudyTable:
    """The rows of the span in the middle of those with droppers: those at the ends hang
    otherwise."""
    spans = sorted({int(row["span"]) for row in table.rows})
    span = spans[len(spans) // 2]
    rows = [row for row in table.rows if row["span"] == span]
    return StudyTable(table.columns, rows, f"Lengths of droppers in span {span}")


def _droppers(scene: Scene) -> pd.DataFrame:
    """Spans, places in them, lengths and wires of all droppers along the track."""
    table = static_table(scene)
    order = np.argsort(table["dropper_x"], kind="stable")
    span = table["dropper_span"].astype(int)[order]
    upper, lower = (table[f"dropper_{end}"][order].astype(str) for end in ("upper", "lower"))
    return pd.DataFrame(
        {
            "span": span,
            "in_span": table["dropper_x"][order] - table["support_x"][span],
            "length": table["dropper_length"][order],
            "wires": [" to ".join(ends) for ends in zip(upper, lower, strict=True)],
        }
    )


def least_forces(scene: Scene) -> np.ndarray:
    """The least force at rest of the first, second, ... droppers of all spans [N].

    Forces are linear in pre-sag, so that a search which knows their slopes takes no step to a line
    that cannot hang. Not collective.

    Raises
    ------
    InputError
        If the line cannot hang.
    """
    problem, mesh = problem_of(scene), mesh_of(scene)
    form = stable_form(problem, mesh)[1]
    x, masts = mesh.x(mesh.droppers[:, 1]), problem.line.support_positions
    order = np.argsort(x, kind="stable")
    span = np.searchsorted(masts, x[order], side="right")
    first = np.searchsorted(span, span)  # where the droppers of each one's span begin
    number = np.arange(span.size) - first
    found = np.full(int(number.max(initial=-1)) + 1, np.inf)
    np.minimum.at(found, number, form.dropper_force[order])
    return found
