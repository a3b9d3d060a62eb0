"""Tolerances: by samples at levels that are bisected, and by slopes in the worst case."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.process.workers import Pool
from catenary.cases.scene.load import Draft
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.scene_sets import (
    BROKE,
    BoundTable,
    Evaluation,
    SceneSet,
    Wanted,
    members_of,
    refuse_shared,
    values_of,
)
from catenary.cases.studies.sweep.jobs import STATISTICS
from catenary.cases.studies.tolerance.errors import (
    Bound,
    Group,
    Samples,
    SamplesTable,
    ToleranceTask,
    groups_of,
    least_share,
    samples_of,
)
from catenary.postproc.evaluate.wording import counted

# By criteria the margins of what is measured of a run, such as its pantographs.
Margins = dict[str, list[float]]


def margins_of(summary: Mapping[str, Any], criteria: Sequence[BoundTable]) -> Margins:
    """Margin of a run to each criterion, in its unit, for each pantograph; negative beyond.

    A run that broke keeps no criterion: all are minus infinity, with the name "".

    Parameters
    ----------
    summary : of the run, as ``evaluate`` gives it
    criteria : bounds; those that the standard judges if there are none
    """
    if BROKE in summary:
        return {"": [-np.inf]}
    found: Margins = {}
    for name, bound, value in _judged(summary, criteria):
        margin = -np.inf if value is None else bound.margin(value)
        found.setdefault(name, []).append(margin)
    return found


def bounds_of(
    summaries: Sequence[Mapping[str, Any]], criteria: Sequence[BoundTable]
) -> dict[str, Bound]:
    """Bounds of all criteria of runs that did not break, by their names, as of ``margins_of``.

    A criterion of the standard whose limit is another one in other runs has its margin bounded.
    """
    found: dict[str, Bound] = {}
    for summary in summaries:
        for name, bound, _ in _judged(summary, criteria):
            if found.setdefault(name, bound) != bound:
                found[name] = Bound(0.0, True, f"margin of {bound.meaning}")
    return found


def _judged(
    summary: Mapping[str, Any], criteria: Sequence[BoundTable]
) -> Iterator[tuple[str, Bound, float | None]]:
    """Names and bounds of criteria, and each value that they are of, None if the run has none."""
    for one in criteria:
        meaning = STATISTICS[one.statistic].meaning or one.statistic
        bound = Bound(one.limit, one.at_least is not None, meaning)
        values: Sequence[float | None] = values_of(summary, one.statistic) or [None]
        for value in values:
            yield one.text, bound, value
    for row in summary["acceptance"] if not criteria else ():
        if row["passed"] is None:  # the rule books judge it not
            continue
        name = row["criterion"]
        for one in summary["pantographs"]:  # of several a criterion ends in their name
            name = name.removesuffix(f", {one['name']}")
        bound = Bound(row["limit"], row["relation"].startswith(">"), f"{name} [{row['unit']}]")
        yield name, bound, row["value"]


def least(margins: Sequence[Margins], *names: str) -> float:
    """The least margin of criteria of all runs of a line; of one that broke minus infinity."""
    return min(min(one.get(name, one.get("", [np.inf]))) for one in margins for name in names)


ALL = "all together"
EACH = "all kept criteria"
# Slopes are those of errors of this share of the tolerance from which all are scaled.
_STEP = 0.1
# Samples are run in parts, so that a level at which many fail is left early.
_PART = 25


@dataclass(frozen=True)
class Tolerance:
    """A tolerance of an error for a criterion.

    Attributes
    ----------
    criterion, error, unit : names of both, and unit of the error; ``EACH`` stands for all criteria
        together that the line keeps without errors
    level : largest tolerance at which enough samples keep the criterion, in the error's unit, or,
        of all errors together, in multiples of the task's tolerances; 0 if the line without errors
        does not keep it
    most : largest tolerance examined
    kept, n_samples : number of samples that keep the criterion at that level, and of all samples
    least_share : lower bound of the share of all lines that keep it there (C. Clopper, E. Pearson,
        Biometrika 26, 1934)
    linear : worst-case tolerance by slopes, infinite without slopes; None if not requested
    checked : largest tolerance at which the line of that worst case keeps the criterion
    lost_at : least tolerance at which a line that was run, of the samples or of the worst case,
        loses it: an upper bound of the true worst-case tolerance; None if no line loses it
    samples : at all levels that were run; None if the line without errors does not keep it
    bound : of the criterion; None of ``EACH``
    """

    criterion: str
    error: str
    unit: str
    level: float
    most: float
    kept: int
    n_samples: int
    least_share: float
    linear: float | None = None
    checked: float | None = None
    lost_at: float | None = None
    samples: Samples | None = field(default=None, compare=False, repr=False)
    bound: Bound | None = None

    @property
    def at_most(self) -> bool:
        """Whether the level is the greatest that was looked at."""
        return self.level >= self.most

    @property
    def text(self) -> str:
        """The tolerance in words, without its unit."""
        if not self.is_kept:
            return "not kept without errors"
        return at_least(self.level, self.most) if self.level else "none"

    @property
    def text_with_unit(self) -> str:
        """The tolerance in words."""
        if not self.level:
            return self.text
        return f"{'at least ' if self.at_most else ''}+-{self.level:.3g} {self.unit}"

    @property
    def is_kept(self) -> bool:
        """Whether the line keeps the criterion without errors."""
        return bool(self.level or self.kept)


def at_least(level: float, most: float) -> str:
    """A tolerance in words, which may be larger than the greatest that was looked at."""
    return f"{'at least ' if level >= most else ''}{level:.3g}"


@dataclass(frozen=True)
class Plan:
    """A study of tolerances whose scenes are all checked."""

    name: str
    task: ToleranceTask
    scenes: SceneSet
    groups: Sequence[Group]
    warnings: Sequence[str] = ()


def make_plan(draft: Draft, task: ToleranceTask) -> Plan:
    """The plan of a task for a case. Not collective.

    Raises
    ------
    InputError
        If the line has nothing that an error is of, or a scene of the set, or one with the largest
        errors, is wrong.
    """
    scene = draft.scene()
    scenes = SceneSet(draft, members_of(task.set)).checked()
    groups = groups_of(task.errors, scene)
    for number, group in enumerate(groups):
        refuse_shared(scenes.members, group.key, f"errors.{number}")
        if group.table.level > group.table.most:
            raise InputError(
                f"errors {group.table.name}: level is {group.table.level:g} {group.unit}, above "
                f"its most, {group.table.most:g} {group.unit}, the greatest tolerance looked at"
            )
        for sign in (1.0, -1.0):
            largest = group.values(np.full(len(group.names), sign * group.table.most))
            try:
                scenes.scene(scenes.members[0], largest)
            except InputError as error:
                raise InputError(
                    f"errors {group.table.name} at {group.table.most:g}: {error}"
                ) from error
    return Plan(scene.case.name, task, scenes, groups)


def find_tolerances(
    plan: Plan,
    pool: Pool[Any] | None = None,
    kept: KeptRows | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> list[Tolerance]:
    """The tolerances of all errors for all criteria. Not collective.

    Parameters
    ----------
    pool : processes that share the runs, None for this one
    kept : runs that are not made again
    say : called with lines on the way

    Raises
    ------
    InputError
        If a run of the line without errors broke, nothing is judged, or a criterion has no figure.
    """
    search = _Search(plan, Evaluation(pool, kept), say)
    found: list[Tolerance] = []
    for varied in search.varied:
        for one in search.tolerances(varied):
            say(f"{one.error}, {one.criterion}: {one.text_with_unit}")
            found.append(one)
    say(counted(search.evaluation.n_runs, "run"))
    return found


@dataclass(frozen=True)
class _Varied:
    """Errors that are varied together: groups, and the random numbers of each, (n_samples, n).

    A level is a factor on ``scales``, the tolerance of each group at level 1.
    """

    name: str
    unit: str
    groups: Sequence[Group]
    random: Sequence[np.ndarray]
    scales: Sequence[float]
    most: float

    def values(self, level: float, errors: Sequence[np.ndarray]) -> dict[str, Any]:
        """Values of a scene with errors, over their tolerances, of each group."""
        found: dict[str, Any] = {}
        for group, scale, own in zip(self.groups, self.scales, errors, strict=True):
            found |= group.values(level * scale * own, found)
        return found

    def sample(self, number: int) -> list[np.ndarray]:
        """The errors of a sample, of each group (n,)."""
        return [own[number] for own in self.random]


@dataclass
class _Search:
    plan: Plan
    evaluation: Evaluation
    say: Callable[[str], None]
    varied: list[_Varied] = field(default_factory=list)
    _weak: dict[str, set[int]] = field(default_factory=dict)
    # Of each error and level, the margins of the runs of each sample that was run.
    _seen: dict[str, dict[float, dict[int, list[Margins]]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        task, summaries = self.plan.task, self._summaries([{}])
        if any(BROKE in summary for summary in summaries):
            raise InputError(
                "the case breaks without errors, so that it has no criteria: try it with "
                "`catenary run`"
            )
        for number, one in enumerate(task.criteria):
            if any(values_of(summary, one.statistic) is None for summary in summaries):
                raise InputError(
                    f"criteria.{number}.statistic is {one.statistic}, of which a run of the case "
                    "without errors has no figure; leave it out, or evaluate a stretch that has one"
                )
        self.nominal = [margins_of(summary, task.criteria) for summary in summaries]
        self.bounds = bounds_of(summaries, task.criteria)
        if not self.bounds:
            raise InputError(
                "the rule books of the scene judge no run of the set: name criteria in the task"
            )
        for name in self.bounds:
            if least(self.nominal, name) < 0.0:
                self.say(f"{name}: not kept without errors")
        random = [
            group.random(np.random.default_rng([task.samples.seed, number]), task.samples.n)
            for number, group in enumerate(self.plan.groups)
        ]
        for group, own in zip(self.plan.groups, random, strict=True):
            table = group.table
            self.varied.append(_Varied(table.name, group.unit, [group], [own], [1.0], table.most))
        if len(self.plan.groups) > 1:
            tables = [group.table for group in self.plan.groups]
            scales = [table.level for table in tables]
            most = min(table.most / table.level for table in tables)
            unit = "of the task's levels"
            self.varied.append(_Varied(ALL, unit, self.plan.groups, random, scales, most))

    @property
    def samples(self) -> SamplesTable:
        return self.plan.task.samples

    def tolerances(self, varied: _Varied) -> list[Tolerance]:
        """Tolerances of some errors for each criterion, and for all at once if there are several
        that the line keeps without errors."""
        found = [self._tolerance(varied, name) for name in self.bounds]
        held = [one for one in found if one.is_kept]
        if len(held) > 1:
            together = self._by_samples(varied, EACH, *(one.criterion for one in held))
            linear, checked, lost_at = (
                min((value for value in values if value is not None), default=None)
                for values in zip(
                    *((one.linear, one.checked, one.lost_at) for one in [*held, together]),
                    strict=True,
                )
            )
            found.append(replace(together, linear=linear, checked=checked, lost_at=lost_at))
        names = {EACH: [one.criterion for one in held]}
        return [
            replace(
                one,
                samples=self._samples(varied, names.get(one.criterion, [one.criterion])),
                bound=self.bounds.get(one.criterion),
            )
            if one in held or one.criterion == EACH
            else one
            for one in found
        ]

    def _samples(self, varied: _Varied, criteria: Sequence[str]) -> Samples:
        """Samples at all levels, which other criteria may have had run; at level 0 all are the line
        without errors."""
        n, seen = self.samples.n, self._seen.get(varied.name, {})
        margins = [[least(self.nominal, *criteria)] * n]
        for lines in seen.values():
            margins.append([least(lines[i], *criteria) if i in lines else np.nan for i in range(n)])
        return samples_of([0.0, *seen], margins)

    def _tolerance(self, varied: _Varied, criterion: str) -> Tolerance:
        if least(self.nominal, criterion) < 0.0:
            head = criterion, varied.name, varied.unit
            return Tolerance(*head, 0.0, varied.most, 0, self.samples.n, 0.0)
        found = self._by_samples(varied, criterion, criterion)
        if not self.samples.worst_case:
            return found
        linear, checked, lost_at = self._worst_case(varied, criterion)
        lost = [level for level in (found.lost_at, lost_at) if level is not None]
        return replace(found, linear=linear, checked=checked, lost_at=min(lost, default=None))

    def _by_samples(self, varied: _Varied, name: str, *criteria: str) -> Tolerance:
        """The tolerance at which enough samples keep all of some criteria."""
        n, allowed = self.samples.n, self.samples.allowed

        def failures(level: float) -> int:
            failed = self._failures(varied, level, criteria, allowed)
            self.say(
                f"    {varied.name} +-{level:.3g} {varied.unit}: {name} "
                f"{'kept' if failed <= allowed else 'not kept'}"
            )
            return failed

        level, lost_at = self._bisect(varied.most, failures, allowed)
        kept = n - self._failures(varied, level, criteria, n) if level else n
        share = least_share(kept, n, self.samples.confidence)
        head = name, varied.name, varied.unit
        return Tolerance(*head, level, varied.most, kept, n, share, lost_at=lost_at)

    def _bisect(
        self, most: float, failures: Callable[[float], int], allowed: int
    ) -> tuple[float, float | None]:
        """The largest level up to ``most`` at which no more lines fail than are allowed, 0 if there
        is none, and the least one at which some were seen to fail."""
        failed = {most: failures(most)}
        low, high = (0.0, most) if failed[most] > allowed else (most, most)
        while high - low > self.samples.resolution * most:
            middle = 0.5 * (low + high)
            failed[middle] = failures(middle)
            low, high = (low, middle) if failed[middle] > allowed else (middle, high)
        return low, min((level for level, n in failed.items() if n), default=None)

    def _failures(self, varied: _Varied, level: float, criteria: Sequence[str], enough: int) -> int:
        """Samples that do not keep criteria at a level; counting ends above ``enough``.

        Those that failed at other levels come first, so that a level which does not hold is left
        early.
        """
        weak = self._weak.setdefault(varied.name, set())
        seen = self._seen.setdefault(varied.name, {}).setdefault(level, {})
        order = sorted(range(self.samples.n), key=lambda number: number not in weak)
        failed, n_runs = 0, self.evaluation.n_runs
        for first in range(0, len(order), _PART):
            numbers = order[first : first + _PART]
            lines = self._margins([varied.values(level, varied.sample(i)) for i in numbers])
            seen.update(zip(numbers, lines, strict=True))
            own = [
                i for i, line in zip(numbers, lines, strict=True) if least(line, *criteria) < 0.0
            ]
            weak.update(own)
            failed += len(own)
            if self.evaluation.n_runs > n_runs:
                n_runs = self.evaluation.n_runs
                self.say(
                    f"    {varied.name} +-{level:.3g} {varied.unit}: {first + len(numbers)} of "
                    f"{len(order)} lines run, {failed} fail"
                )
            if failed > enough:
                break
        return failed

    def _margins(self, lines: Sequence[Mapping[str, Any]]) -> list[list[Margins]]:
        """Margins of the runs of all scenes of the set, for each line."""
        criteria = self.plan.task.criteria
        found = [margins_of(summary, criteria) for summary in self._summaries(lines)]
        n = len(self.plan.scenes.members)
        return [found[i * n : (i + 1) * n] for i in range(len(lines))]

    def _summaries(self, lines: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
        """Summaries of the runs of all scenes of the set, line by line."""
        members = self.plan.scenes.members
        wanted: list[Wanted] = [
            (self.plan.scenes, member, values) for values in lines for member in members
        ]
        return self.evaluation.of(wanted)

    def _worst_case(self, varied: _Varied, criterion: str) -> tuple[float, float, float | None]:
        """Tolerance by slopes, the largest one that the line with that worst case keeps, and the
        least one at which it is known to lose the criterion.

        To first order the margin of a run falls from m by the sum of |slope| times tolerance. The
        errors that make it fall so are run then.
        """
        base, slopes = self._slopes(varied, criterion)
        falls = np.abs(slopes).sum(axis=1)
        with np.errstate(divide="ignore"):
            levels = np.where(falls > 0.0, base / falls, np.inf)
        first = int(np.argmin(levels))
        worst, begin = [], 0
        for own in varied.random:
            n = own.shape[1]
            worst.append(-np.sign(slopes[first, begin : begin + n]))
            begin += n

        def failures(level: float) -> int:
            return int(least(self._margins([varied.values(level, worst)])[0], criterion) < 0.0)

        return float(levels[first]), *self._bisect(varied.most, failures, 0)

    def _slopes(self, varied: _Varied, criterion: str) -> tuple[np.ndarray, np.ndarray]:
        """Margins without errors, (n_margins,), and their slopes by each error over its tolerance
        at level 1, (n_margins, n); zero for errors far from the evaluated stretch."""
        base = _flat(self.nominal, criterion)
        sizes = [own.shape[1] for own in varied.random]
        slopes = np.zeros((base.size, sum(sizes)))
        lines, columns, steps = [], [], []
        for number, group in enumerate(varied.groups):
            step = _STEP * group.table.level / varied.scales[number]
            for i in np.flatnonzero(group.near):
                one = [np.zeros(size) for size in sizes]
                one[number][i] = 1.0
                lines.append(varied.values(step, one))
                columns.append(sum(sizes[:number]) + int(i))
                steps.append(step)
        for margins, column, step in zip(self._margins(lines), columns, steps, strict=True):
            moved = _flat(margins, criterion)
            if moved.size == base.size and np.isfinite(moved).all():
                slopes[:, column] = (moved - base) / step
        return base, slopes


def _flat(margins: Sequence[Margins], criterion: str) -> np.ndarray:
    """Margins of a criterion of all runs and pantographs."""
    found = [own for one in margins for own in one.get(criterion, one.get("", []))]
    return np.array(found)
