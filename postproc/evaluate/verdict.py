"""Acceptance of a run: its quantities beside the limits of rule books."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from catenary.base.errors import InputError
from catenary.postproc.evaluate.observations import Observation, observe
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.read.results import Results
from catenary.postproc.standards.rule_books import (
    DEFAULT,
    KMH,
    SYSTEMS,
    Conditions,
    LimitRow,
    Rule,
    RuleBook,
    book_named,
    books_of_entries,
)

_MET = {"<=": operator.le, "<": operator.lt, ">=": operator.ge, ">": operator.gt}


@dataclass(frozen=True)
class Criterion:
    """One judged line of the table.

    Attributes
    ----------
    criterion : the judged quantity in words; names the pantograph where there are several
    value, limit : in ``unit``; NaN where there is none
    unit : for readers: N, mm, %, km/h
    relation : how the value must stand to the limit: "<=", "<", ">=" or ">"
    passed : None if it is not judged
    clause : where the limit comes from
    book, title : ``name:edition`` of the rule book, and how it is cited
    rule, quantity : id of the criterion in the book, and name of what it limits
    compared : whether the limit was compared with the text of the standard
    because : why it is not judged, empty if it is
    absent : whether it is not judged because scene or book lack what it takes: such a criterion
        leaves the verdict as it is
    pantograph : name of the pantograph that is judged, empty for the run
    """

    criterion: str
    value: float
    limit: float
    unit: str
    relation: str
    passed: bool | None
    clause: str
    book: str = ""
    title: str = ""
    rule: str = ""
    quantity: str = ""
    compared: bool = False
    because: str = ""
    absent: bool = False
    pantograph: str = ""


def judge(
    books: Sequence[RuleBook],
    observations: Mapping[str, Observation],
    conditions: Conditions,
    limits: Mapping[str, float],
    pantographs: Sequence[str],
) -> list[Criterion]:
    """Every criterion of the books: of each pantograph, then of the run, book after book.

    Parameters
    ----------
    books : sequence of RuleBook
        Rule books.
    observations : mapping
        Observations of all quantities of the books, as ``quantities_of`` names them.
    conditions : Conditions
        Speed [km/h], supply, stops.
    limits : mapping
        Limits of the scene by keys of ``evaluation.limits``, in their units.
    pantographs : sequence of str
        Names of the pantographs in the order of tables.
    """
    found: list[Criterion] = []
    for book in books:
        run = _Judge(book, observations, conditions, limits, several=len(pantographs) > 1)
        own = [rule for rule in book.criteria if rule.per_pantograph]
        for number, name in enumerate(pantographs):
            for rule in own:
                found += run.of_pantograph(rule, name, first=number == 0)
        found += [run.criterion(rule, "") for rule in book.criteria if not rule.per_pantograph]
    return found


def quantities_of(books: Sequence[RuleBook]) -> list[str]:
    """Names of the quantities that books judge, or take limits from."""
    named = []
    for rule in (rule for book in books for rule in book.criteria):
        named += [rule.quantity, *(row.of_quantity for row in rule.limit if row.of_quantity)]
    return list(dict.fromkeys(named))


def verdict(criteria: Sequence[Criterion]) -> bool | None:
    """True if all passed, False if one failed, None if none failed but some have no value.

    Criteria without data (``absent``) do not count; None if no other is there.
    """
    counted = [c for c in criteria if not c.absent]
    if any(c.passed is False for c in counted):
        return False
    return None if not counted or any(c.passed is None for c in counted) else True


def judged_by(results: Results, criteria: Sequence[Criterion]) -> str:
    """Sentence on the books and the supply that judge a run, and the number of criteria with each
    verdict, of several books by each one too."""
    titles = list(dict.fromkeys(c.title for c in criteria))
    judged = [c for c in criteria if c.passed is not None]
    counts = f"{_share(judged)} criteria passed"
    left = len(criteria) - len(judged)
    counts += f", {left} not judged" if left else ""
    unseen = sum(not c.compared for c in judged)
    if unseen:
        counts += f"; {unseen} of {len(judged)} limits not compared with the text of their standard"
    if titles[1:]:
        titles = [f"{title} ({_share(c for c in judged if c.title == title)})" for title in titles]
        titles = [", ".join(titles[:-1]), titles[-1]]
    return f"{' and '.join(titles)} ({SYSTEMS[results.attributes['system']]}): {counts}"


def _share(judged: Iterable[Criterion]) -> str:
    """How many of judged criteria passed."""
    verdicts = [c.passed for c in judged]
    return f"{sum(map(bool, verdicts))} of {len(verdicts)}"


def labels(criteria: Sequence[Criterion]) -> list[str]:
    """Names of criteria, with those of their books where there are several."""
    several = len({c.book for c in criteria}) > 1
    return [f"{c.criterion} ({c.book})" if several else c.criterion for c in criteria]


class _Unjudged(Exception):
    """Reason for not judging a criterion."""


@dataclass(frozen=True)
class _Judge:
    book: RuleBook
    observations: Mapping[str, Observation]
    conditions: Conditions
    limits: Mapping[str, float]
    several: bool

    def of_pantograph(self, rule: Rule, name: str, first: bool) -> Iterator[Criterion]:
        """A criterion of a pantograph: once for all where the run has no such quantity, and none
        of one that alone has no value of it."""
        observation = self.observations[rule.quantity]
        if observation.absent:
            if first:
                yield self.criterion(rule, "")
        elif name in observation.values:
            yield self.criterion(rule, name)

    def criterion(self, rule: Rule, name: str) -> Criterion:
        """A criterion, judged or with the reason why not."""
        observation = self.observations[rule.quantity]
        value, limit, clause = observation.values.get(name, math.nan), math.nan, rule.clause
        passed, absent, because = None, False, observation.absent
        if because:
            absent = True
        else:
            try:
                limit, note = self._limit(rule, name)
                clause = "; ".join(part for part in (clause, note) if part)
                because = observation.unjudged.get(name, "")
                if not because and (math.isnan(value) or math.isnan(limit)):
                    because = "the record gives no value"
            except _Unjudged as why:
                because, absent = str(why), True
        if not because:
            passed = bool(_MET[rule.relation](value, limit))
            # A value that may still grow is beyond a limit for good, and below it for now.
            if observation.so_far and passed != (rule.relation in (">", ">=")):
                passed, because = None, observation.so_far
        return Criterion(
            rule.title + (f", {name}" if self.several and name else ""),
            value,
            limit,
            rule.unit,
            rule.relation,
            passed,
            clause,
            self.book.key,
            self.book.title,
            rule.id,
            rule.quantity,
            self.book.is_compared(rule),
            because,
            absent,
            name,
        )

    def _limit(self, rule: Rule, name: str) -> tuple[float, str]:
        """The limit, and a note to its clause."""
        row = rule.row(self.conditions)
        if row is None:
            supply, speed = SYSTEMS[self.conditions.supply], self.conditions.speed
            raise _Unjudged(f"the book has no limit for {supply} at {speed:.4g} km/h")
        number = row.number(self.conditions.speed)
        return (number, "") if number is not None else self._share(row, name)

    def _share(self, row: LimitRow, name: str) -> tuple[float, str]:
        if row.of_limit is not None:
            number, note = self._limit(self.book.rule(row.of_limit), name)
            return row.share(number), note
        if row.of_key is not None:
            if row.of_key not in self.limits:
                raise _Unjudged(f"the scene has no evaluation.limits.{row.of_key}")
            return row.share(self.limits[row.of_key]), ""
        assert row.of_quantity is not None  # the book was checked
        other = self.observations[row.of_quantity]
        of = other.values.get(name, other.values.get("", math.nan))
        if other.absent or not (name in other.values or "" in other.values):
            raise _Unjudged(other.absent or f"there is no {row.of_quantity} of this pantograph")
        return row.share(of), other.note


_NO_TRAIN = "the line is excited without a train"
_STOPS = "uplift_stops"  # the effect by which steady arms have stops


def books_of(results: Results) -> list[RuleBook]:
    """The rule books of a run; of a file without them the edition of EN 50367 that it names.

    Raises
    ------
    InputError
        If it names none.
    """
    about = results.attributes
    if about.get("rules"):
        return books_of_entries(about["rules"])
    if about.get("edition"):
        return [book_named(f"{DEFAULT}:{about['edition']}")]
    raise InputError(f"{results.path} does not say by which rules its run is judged")


def criteria_of(results: Results, statistics: RunStatistics) -> list[Criterion]:
    """All criteria of a run's rule books; of a line that is excited without a train none is judged.
    Not collective."""
    books, about = books_of(results), results.attributes
    stops = any(name == _STOPS for name, *_ in about["effects_on"])
    conditions = Conditions(KMH * results.fact("speed"), about["system"], stops)
    observations = observe(quantities_of(books), results, statistics)
    names = [p.name for p in statistics.pantographs]
    found = judge(books, observations, conditions, about.get("limits") or {}, names)
    if not about.get("excitation"):
        return found
    nan = math.nan
    return [
        one if one.absent else replace(one, value=nan, limit=nan, passed=None, because=_NO_TRAIN)
        for one in found
    ]
