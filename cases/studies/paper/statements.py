"""Statements of a paper about its results, each with conditions by which it is judged.

Pure functions of plain figures: nothing here reads files or runs anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from pydantic import Field, ValidationError, field_validator

from catenary.base.errors import InputError
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.paper.runs import FIGURES, OF_RUN, TRAILING, Figures, Rows, name_of
from catenary.postproc.report.study_report import NOT_REPRODUCED, REPRODUCED, UNDECIDED, Finding

Words = dict[str, str]


class Condition(Table):
    """A condition on a figure of all pantographs, or runs, with the words of ``where``.

    Words are ``damping``, ``train`` and ``place``. Without a run that it is about it is open.
    """

    figure: str = Field(description="one of FIGURES")
    where: Words = Field(default_factory=dict, description="of which it is")
    but: Words = Field(default_factory=dict, description="of which it is not")
    above: float | None = Field(None, description="all are greater")
    at_least: float | None = Field(None, description="none is smaller")
    below: float | None = Field(None, description="all are smaller")
    at_most: float | None = Field(None, description="none is greater")
    largest_at: Words | None = Field(None, description="the greatest is here")
    smallest_at: Words | None = Field(None, description="the smallest is here")
    mean_above: Words | None = Field(None, description="the mean is above the one with these words")
    open_within: float = Field(0.0, ge=0, description="a smaller magnitude decides nothing")

    @field_validator("figure")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in FIGURES:
            raise ValueError(f"must be one of {', '.join(FIGURES)}")
        return name

    def met_by(self, value: float) -> bool:
        """Whether a value keeps the bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )


class Alone(Table):
    """Figure by which the inputs that move a statement are ranked, with one pantograph."""

    figure: str = Field(description="one of FIGURES")
    damping: str = Field(description="with which it is taken")


class Statement(Table):
    """A statement of the paper."""

    says: str = Field(min_length=1, description="in words")
    criterion: str = Field(min_length=1, description="when it counts as reproduced, in words")
    conditions: list[Condition] = Field(min_length=1, description="the same as conditions")
    alone: Alone | None = Field(None, description="None if it is about pairs or the line")


class _Open(Exception):
    """Figures that are missing for a verdict."""


class _Found(NamedTuple):
    holds: bool
    text: str
    is_open: bool = False


def statements_of(table: Mapping[str, Any]) -> list[Statement]:
    """The statements of a ``study.toml``.

    Raises
    ------
    InputError
        If one is wrong.
    """
    try:
        return [Statement.model_validate(one) for one in table["statements"]]
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(f"a statement of study.toml is wrong: {place}: {first['msg']}") from error


def judge(statements: Sequence[Statement], rows: Rows) -> list[Finding]:
    """The findings on all statements, without reasons."""
    findings = []
    for number, one in enumerate(statements, start=1):
        try:
            found = [_judged(condition, rows) for condition in one.conditions]
            verdict = REPRODUCED if all(part.holds for part in found) else NOT_REPRODUCED
            if any(part.is_open for part in found):
                verdict = UNDECIDED
            text = "; ".join(part.text for part in found)
        except _Open as error:
            verdict, text = UNDECIDED, str(error)
        findings.append(Finding(number, one.says, one.criterion, verdict, text))
    return findings


def holds_alone(statement: Statement, rows: Rows) -> bool:
    """Whether a single pantograph meets a statement, as far as it is about one."""
    there = [one for one in statement.conditions if _selected(one, rows)]
    return all(_judged(one, rows).holds for one in there)


def n_met(statement: Statement, rows: Rows) -> tuple[int, int]:
    """Number of pantographs that keep the bounds of a statement's conditions, and of all."""
    kept = [
        one.met_by(row[one.figure])
        for one in statement.conditions
        for row in _selected(one, rows)
        if row[one.figure] is not None
    ]
    return sum(kept), len(kept)


def _matches(row: Mapping[str, Any], words: Words) -> bool:
    return all(row.get(key, word) == word for key, word in words.items())


def _selected(condition: Condition, rows: Rows) -> list[Figures]:
    """The rows that a condition is about: of figures of a run one for each run."""
    return [
        row
        for row in rows.rows
        if _matches(row, condition.where)
        and not (condition.but and _matches(row, condition.but))
        and not (condition.figure in OF_RUN and row["place"] == TRAILING)
    ]


def _values(condition: Condition, rows: Rows) -> dict[str, float]:
    """Values by names of pantographs or runs; raises _Open where one is missing."""
    for run in rows.missing:
        if _matches(run, condition.where) and not (condition.but and _matches(run, condition.but)):
            raise _Open(f"there is no run {run['train']}, {run['damping']}")
    chosen = _selected(condition, rows)
    if not chosen:
        raise _Open(f"there is no run {', '.join(condition.where.values()) or 'at all'}")
    values = {}
    for row in chosen:
        name = str(row["train"]) if condition.figure in OF_RUN else name_of(row)
        name += "" if "damping" in condition.where else f", {row['damping']}"
        if row[condition.figure] is None:
            raise _Open(f"{FIGURES[condition.figure].head} is not known of {name}")
        values[name] = float(row[condition.figure])
    return values


def _judged(condition: Condition, rows: Rows) -> _Found:
    values = _values(condition, rows)
    head, spec = FIGURES[condition.figure].head, FIGURES[condition.figure].format
    head = f"{', '.join(condition.where.values())}: {head}" if condition.where else head

    def in_words(value: float) -> str:
        return format(round(value) if spec == "d" else value, spec)

    for words, which, extreme in (
        (condition.largest_at, "largest", max), (condition.smallest_at, "smallest", min),
    ):  # fmt: skip
        if words is not None:
            here = condition.model_copy(update={"where": condition.where | words})
            expected = _values(here, rows)
            name = extreme(values, key=lambda one: values[one])
            return _Found(name in expected, f"{head} {which} {in_words(values[name])} ({name})")
    if condition.mean_above is not None:
        other = condition.model_copy(update={"where": condition.where | condition.mean_above})
        means = [sum(own.values()) / len(own) for own in (values, _values(other, rows))]
        beside = ", ".join(condition.mean_above.values())
        text = f"{head}, on average {in_words(means[0])}, {beside} {in_words(means[1])}"
        return _Found(means[0] > means[1], text)
    low, high = (which(values, key=lambda one: values[one]) for which in (min, max))
    text = f"{head} {in_words(values[low])} ({low})"
    kept = [condition.met_by(value) for value in values.values()]
    if values[low] != values[high]:
        text += f" to {in_words(values[high])} ({high})"
    if len(kept) > 1:
        text += f", {sum(kept)} of {len(kept)} as stated"
    is_open = all(abs(value) <= condition.open_within for value in values.values())
    is_open = is_open and condition.open_within > 0.0
    return _Found(
        all(kept), text + (", within the discretisation's error" if is_open else ""), is_open
    )
