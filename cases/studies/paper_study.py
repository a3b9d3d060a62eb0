"""The study of a paper, as a table says it: runs under readings, statements, inputs ranked.

``study.toml`` lists the runs. A *reading* is one choice of what the paper leaves open. Under each
one all *trains* run with all *dampings*. *Variations* change one input of the case, with the first
train alone; the *search* changes one input of a reading, with all trains.

A statement of the paper about its results has conditions by which it is judged. Judging takes plain
figures alone: it reads no file and runs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

from pydantic import Field, ValidationError, field_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.case_study import StudyRun, StudyVariant
from catenary.cases.studies.sweep.variants import Variant, check_keys, slug
from catenary.postproc.report.study_report import (
    NOT_REPRODUCED,
    REPRODUCED,
    UNDECIDED,
    Finding,
    Reading,
    Study,
    StudyFigure,
)
from catenary.postproc.report.study_table import Column, StudyTable, texts_table

VARIED, SEARCHED = "vary", "search"
_TABLES = ("title", "lead", "always", "dampings", "trains", "readings", "statements", "ranking",
           "variations", "search", "short")  # fmt: skip
LEADING, TRAILING, SINGLE = "leading", "trailing", "single"
_SUMMARY = ("mean_N", "std_N", "max_N", "min_N", "loss_percent", "std_0_5_N", "std_5_20_N")
# Figures of a pantograph of a run, with which statements are judged and which tables show: forces
# below 20 Hz in the stretch, losses of the force as it is. Those of the second part are of the run.
_OF_PANTOGRAPH = (
    Column("mean_N", "mean [N]", ".1f"),
    Column("std_N", "std [N]", ".1f"),
    Column("std_percent", "std / mean [%]", ".1f"),
    Column("max_N", "max [N]", ".1f"),
    Column("min_N", "min [N]", ".1f"),
    Column("loss_percent", "loss [%]", ".1f"),
    Column("std_0_5_N", "0-5 Hz [N]", ".1f"),
    Column("std_5_20_N", "5-20 Hz [N]", ".1f"),
    Column("amplitude_N", "max - min [N]", ".1f"),
    Column("over_leading_N", "max - min, less the leading one's [N]", "+.1f"),
    Column("over_alone_percent", "std over that of one alone [%]", "+.1f"),
)
_OF_RUN = (
    Column("uplift_mm", "arm uplift [mm]", ".1f"),
    Column("onset_m", "head to the arm when its uplift begins [m]", ".1f"),
    Column("slack", "slack at mid-span", "d"),
    Column("slack_before", "slack at mid-span, before the trailing one", "d"),
    Column("slack_after", "slack at mid-span, under and after the trailing one", "d"),
    Column("wave_speed_km_h", "wave speed [km/h]", ".1f"),
    Column("speed_over_wave", "speed over wave speed", ".3f"),
)
FIGURES = {column.name: column for column in (*_OF_PANTOGRAPH, *_OF_RUN)}
OF_RUN = frozenset(column.name for column in _OF_RUN)
Figures = dict[str, Any]


@dataclass(frozen=True)
class Rows:
    """Figures of all pantographs of a reading.

    Attributes
    ----------
    rows : of each, ``damping``, ``train``, ``place`` and ``FIGURES`` by name, None if unknown
    missing : ``damping`` and ``train`` of runs that broke or have no statistics
    """

    rows: Sequence[Figures]
    missing: Sequence[Mapping[str, str]] = ()

    @classmethod
    def of(cls, runs: Mapping[tuple[str, str], Sequence[Figures] | None]) -> Rows:
        """Rows by damping and train, each of the leading pantograph on, None without a run.

        What follows from the others is added: ratios, and comparisons of pantographs.
        """
        rows: list[Figures] = []
        for (damping, train), own in runs.items():
            places = (SINGLE,) if own and len(own) == 1 else (LEADING, TRAILING)
            for place, one in zip(places, own or (), strict=False):
                rows.append({**one, "damping": damping, "train": train, "place": place})
        alone = {row["damping"]: row["std_N"] for row in rows if row["place"] == SINGLE}
        lead: dict[tuple[str, str], float] = {}
        for row in rows:
            row["std_percent"] = 100.0 * row["std_N"] / row["mean_N"]
            row["amplitude_N"] = row["max_N"] - row["min_N"]
            run, single = (row["damping"], row["train"]), alone.get(row["damping"])
            lead.setdefault(run, row["amplitude_N"])
            row["over_leading_N"] = row["amplitude_N"] - lead[run]
            row["over_alone_percent"] = single and 100.0 * (row["std_N"] / single - 1.0)
            row["slack"] = row["slack_before"] + row["slack_after"]
        missing = [
            {"damping": damping, "train": train}
            for (damping, train), own in runs.items()
            if own is None
        ]
        return cls(rows, missing)

    def only(self, trains: Sequence[str]) -> Rows:
        """The rows of some trains."""
        rows = [row for row in self.rows if row["train"] in trains]
        return Rows(rows, [run for run in self.missing if run["train"] in trains])

    def at(self, figure: str, **where: str) -> list[float]:
        """Known values of a figure where rows have these words."""
        return [
            row[figure]
            for row in self.rows
            if row[figure] is not None and all(row[key] == word for key, word in where.items())
        ]


def name_of(row: Mapping[str, Any]) -> str:
    """Train and place of a pantograph."""
    return str(row["train"] if row["place"] == SINGLE else f"{row['train']} {row['place']}")


@dataclass(frozen=True)
class PaperStudy:
    """A study by its table.

    Attributes
    ----------
    path : of the ``study.toml``
    table : its content, in the short form on request
    """

    path: Path
    table: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path, shortened: bool = False) -> PaperStudy:
        """The study of a file. Raises InputError if it cannot be read or lacks a table."""
        table = read_toml(path)
        if lacks := [name for name in _TABLES if name not in table]:
            raise InputError(f"{path} has no {lacks[0]}; a study needs {', '.join(_TABLES)}")
        if shortened:
            short = table["short"]
            for name in ("trains", "readings"):
                table[name] = [one for one in table[name] if one["name"] in short[name]]
            table["variations"] = _chosen(table["variations"], short["variations"])
            table["search"]["inputs"] = _chosen(table["search"]["inputs"], short["search"])
        return cls(path, table)

    @property
    def dampings(self) -> list[str]:
        """Names of the dampings."""
        return list(self.table["dampings"])

    @property
    def trains(self) -> list[str]:
        """Names of the trains, the single pantograph's first."""
        return [train["name"] for train in self.table["trains"]]

    @property
    def named_trains(self) -> list[str]:
        """Names of the trains that the paper's text names."""
        return [train["name"] for train in self.table["trains"] if train.get("named_in_text")]

    def variations(self) -> dict[str, list[str]]:
        """Assignments of all variations by "group: title"."""
        return _by_title(self.table["variations"])

    def searched(self) -> dict[str, dict[str, Any]]:
        """The readings of the search by "input: option", each one option off its centre.

        Empty if that is not among the readings.
        """
        search = self.table["search"]
        return {
            title: {**centre, "name": f"{SEARCHED}-{title}", "set": [*centre["set"], *assignments],
                    "figures": False}
            for centre in self.table["readings"]
            if centre["name"] == search["around"]
            for title, assignments in _by_title(search["inputs"]).items()
        }  # fmt: skip

    def variants(self, scene: Scene) -> list[StudyVariant]:
        """All runs; only those of the readings that the figures show keep their results."""
        own, always = scene.train.pantographs[0].name, self.table["always"]
        planned = []
        for reading in [*self.table["readings"], *self.searched().values()]:
            for damping, alpha in self.table["dampings"].items():
                for train in self.table["trains"]:
                    words = (*always, *alpha, *reading["set"], *train["set"])
                    place = reading["name"], damping, train["name"]
                    keys = dict(zip(("reading", "damping", "train"), place, strict=True))
                    filled = _filled(words, reading.get("kind", own))
                    variant = Variant(run_name(*place), filled, keys)
                    planned.append(StudyVariant(variant, reading.get("figures", False)))
        for title, changes in self.variations().items():
            for damping, alpha in self.table["dampings"].items():
                keys = {"reading": title, "damping": damping, "train": self.trains[0]}
                name = run_name(VARIED, damping, title)
                planned.append(StudyVariant(Variant(name, (*always, *alpha, *changes), keys)))
        check_keys([one.variant for one in planned], f"in {self.path}")
        names = [one.variant.name for one in planned]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{self.path} makes two runs that are both named {name}")
        return planned

    def rows(self, runs: Mapping[str, StudyRun], reading: str) -> Rows:
        """Figures of a reading's runs, of those that were planned."""
        return Rows.of({
            (damping, train): figures_of(runs[name])
            for damping in self.dampings
            for train in self.trains
            if (name := run_name(reading, damping, train)) in runs
        })  # fmt: skip

    def rows_of_variations(self, runs: Mapping[str, StudyRun]) -> dict[str, Rows]:
        """Figures of each variation that was planned, by its title."""
        names = {
            title: {(own, self.trains[0]): run_name(VARIED, own, title) for own in self.dampings}
            for title in self.variations()
        }
        return {
            title: Rows.of({place: figures_of(runs[name]) for place, name in own.items()})
            for title, own in names.items()
            if runs.keys() >= set(own.values())
        }


def run_name(reading: str, damping: str, train: str) -> str:
    """Name of the run of a ``train`` under a ``reading``, with one of the ``damping``s of the
    study."""
    return slug(f"{reading}__{damping}__{train}")


def changes_of(reading: Mapping[str, Any]) -> list[str]:
    """Changes of the case by a reading, its kind of pantograph included, as assignments."""
    kind = [f"train.pantographs.0.name={reading['kind']}"] if "kind" in reading else []
    return [*kind, *reading["set"]]


def figures_of(run: StudyRun | None) -> list[Figures] | None:
    """Figures of each pantograph of a run, the leading one first; None without statistics."""
    if run is None or not run.ended.done:
        return None
    summary, measured = run.ended.summary, run.ended.measured
    uplift, slack = summary["supports"]["max_uplift_mm"], measured["slack"]["mid"]
    forces = [{name: one[name] for name in _SUMMARY} for one in summary["pantographs"]]
    if uplift is None or any(value is None for one in forces for value in one.values()):
        return None
    wave, speed = measured["wave_speed_m_per_s"], measured["train_speed_m_per_s"]
    of_run = {
        "uplift_mm": uplift,
        "onset_m": measured["onset_m"],
        "slack_before": slack["leading"],
        "slack_after": slack["trailing"],
        "wave_speed_km_h": 3.6 * wave,
        "speed_over_wave": speed / wave,
    }
    return [one | of_run for one in forces]


def _filled(assignments: Sequence[str], kind: str) -> tuple[str, ...]:
    """Assignments with the name of a kind of pantograph in the place of $kind."""
    return tuple(Template(text).safe_substitute(kind=kind) for text in assignments)


def _by_title(groups: Mapping[str, Mapping[str, list[str]]]) -> dict[str, list[str]]:
    return {
        f"{group}: {title}": assignments
        for group, entries in groups.items()
        for title, assignments in entries.items()
    }


def _chosen(groups: Mapping[str, Any], titles: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    kept: dict[str, dict[str, list[str]]] = {}
    for group, title in (name.split(": ") for name in titles):
        kept.setdefault(group, {})[title] = groups[group][title]
    return kept


Words = dict[str, str]
# Result folders by damping and train, and figures of the same runs, to pictures.
Draw = Callable[[Mapping[str, Mapping[str, Path]], Rows], list[StudyFigure]]
_NAMED = 4  # variations that a reason names
_BY_READING = ("mean_N", "std_N", "std_percent", "max_N", "min_N", "loss_percent", "uplift_mm",
               "slack_before", "slack_after")  # fmt: skip


def conclude(study: PaperStudy, runs: Mapping[str, StudyRun], draw: Draw) -> Study:
    """Verdicts under each reading, the search, the ranking of inputs, and pictures.

    Parameters
    ----------
    runs : by name, those that broke included; what was not run of the table is left out
    draw : makes pictures of the runs of a reading that are done
    """
    table, statements = study.table, statements_of(study.table)
    readings = [
        one
        for one in table["readings"]
        if run_name(one["name"], study.dampings[0], study.trains[0]) in runs
    ]
    rows = {one["name"]: study.rows(runs, one["name"]) for one in readings}
    found = {name: judge(statements, own) for name, own in rows.items()}
    first, *others = readings
    start = rows[first["name"]].only(study.trains[:1])
    ranked = rank(start, study.rows_of_variations(runs), study)
    named = judge(statements, rows[first["name"]].only(study.named_trains))
    explained = []
    for i, one in enumerate(found[first["name"]]):
        elsewhere = {other["title"]: found[other["name"]][i] for other in others}
        explained.append(_explained(one, named[i], elsewhere, statements[i], ranked))
    shown = [one for one in readings if one.get("figures")]
    judged = [
        Reading(one["name"], one["title"], changes_of(one), found[one["name"]]) for one in readings
    ]
    judged[0] = replace(judged[0], findings=explained)
    tables = [
        _side_by_side(shown, found),
        _search_table(study, statements, _searched(study, runs)),
        *(_table_of(one, rows[one["name"]]) for one in readings),
        separation_table(study, _bands(study, runs, readings, rows)),
        ranking_table(study, ranked),
    ]
    pictures = _drawn(study, runs, shown, rows, draw)
    return Study(table["title"], table["lead"], judged, tables, pictures)


def _drawn(
    study: PaperStudy,
    runs: Mapping[str, StudyRun],
    shown: Sequence[Mapping[str, Any]],
    rows: Mapping[str, Rows],
    draw: Draw,
) -> list[StudyFigure]:
    """The pictures of all readings that are to be shown, beside each other."""
    drawn: list[tuple[str, StudyFigure]] = []
    done = {name: run for name, run in runs.items() if run.ended.done}
    for number, reading in enumerate(shown):
        name, title = reading["name"], reading["title"]
        folders = {
            damping: {
                train: done[run].folder
                for train in study.trains
                if (run := run_name(name, damping, train)) in done
            }
            for damping in study.dampings
        }
        for one in draw(folders, rows[name]):
            caption = f"{one.caption[:-1]}: {title}."
            renamed = replace(one, name=f"{one.name}_{name}", caption=caption)
            drawn.append((one.name, renamed if number else one))
    return [one for _, one in sorted(drawn, key=lambda pair: pair[0])]


def _explained(
    finding: Finding,
    named: Finding,
    others: Mapping[str, Finding],
    statement: Statement,
    ranked: Sequence[Ranked],
) -> Finding:
    """The finding with the reason that the runs give where it differs from the paper."""
    if finding.verdict != NOT_REPRODUCED:
        return finding
    only = f"With only the separations that the text names: {named.verdict} ({named.found})."
    parts = [only] if named.found != finding.found else []
    met = {title: one for title, one in others.items() if one.verdict == REPRODUCED}
    parts += [f"Reproduced with {title}: {one.found}." for title, one in met.items()]
    if others and not met:
        parts.append(f"None of the {len(others)} other readings reproduces it.")
    return replace(finding, reason=" ".join([*parts, movers(statement, ranked)]).strip())


def _side_by_side(
    readings: Sequence[Mapping[str, Any]], found: Mapping[str, Sequence[Finding]]
) -> StudyTable:
    """All statements under some readings, each with its figures."""
    columns = [found[one["name"]] for one in readings]
    met = [sum(one.verdict == REPRODUCED for one in column) for column in columns]
    notes = [
        f"{reading['title']}: {n} of {len(column)} reproduced"
        for reading, n, column in zip(readings, met, columns, strict=True)
    ]
    heads = ["no.", "statement", *(reading["title"] for reading in readings)]
    rows = [
        [one[0].number, one[0].statement, *(f"{own.verdict}: {own.found}" for own in one)]
        for one in zip(*columns, strict=True)
    ]
    title = "The statements beside each other"
    return texts_table(heads, rows, title=title, note=f"{'; '.join(notes)}.")


def _table_of(reading: Mapping[str, Any], rows: Rows) -> StudyTable:
    """All pantographs of a reading."""
    changes = " ".join(changes_of(reading))
    broke = [{**run, "place": "", "outcome": "there is no such run"} for run in rows.missing]
    columns = [Column(name, name) for name in ("train", "damping")]
    columns += [Column("place", "pantograph"), *(FIGURES[name] for name in _BY_READING)]
    title = f"All configurations: {reading['title']}"
    note = f"Changes: {changes}." if changes else "No changes."
    return StudyTable(columns, [*rows.rows, *broke], title, note)


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


def _holds_alone(statement: Statement, rows: Rows) -> bool:
    """Whether a single pantograph meets a statement, as far as it is about one."""
    there = [one for one in statement.conditions if _selected(one, rows)]
    return all(_judged(one, rows).holds for one in there)


def _n_met(statement: Statement, rows: Rows) -> tuple[int, int]:
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


class Ranked(NamedTuple):
    """A variation, or the case without title, and its rows of one pantograph."""

    title: str
    rows: Rows


def _searched(study: PaperStudy, runs: Mapping[str, StudyRun]) -> dict[str, Rows]:
    """The reading that is searched around, and each option in the place of one of its inputs."""
    around = study.table["search"]["around"]
    names = {one["title"]: one["name"] for one in study.table["readings"] if one["name"] == around}
    names |= {title: one["name"] for title, one in study.searched().items()}
    found = {title: study.rows(runs, name) for title, name in names.items()}
    return {title: rows for title, rows in found.items() if rows.rows or rows.missing}


def _search_table(
    study: PaperStudy, statements: Sequence[Statement], searched: Mapping[str, Rows]
) -> StudyTable:
    """The readings of a search, the best first: by statements met, then by pantographs that meet
    the statement that the search counts. ``searched`` has the rows of each reading by its title."""
    search, found = study.table["search"], []
    for title, rows in searched.items():
        met = [one.number for one in judge(statements, rows) if one.verdict == REPRODUCED]
        kept, of = _n_met(statements[search["counts"] - 1], rows)
        cells = [_range(rows, **one) for one in search["shown"]]
        listed = ", ".join(map(str, met))
        found.append((len(met), kept, [title, len(met), listed, f"{kept} of {of}", *cells]))
    found.sort(key=lambda one: one[:2], reverse=True)
    counts = {n: sum(one[0] == n for one in found) for n in range(len(statements), -1, -1)}
    spread = ", ".join(f"{many} meet {n}" for n, many in counts.items() if many)
    title = "Search: which reading of the open inputs meets most statements"
    note = "The reading searched around, and each option of an input in its place ([search] in "
    note += f"study.toml): of {len(found)}, {spread}." if found else "study.toml): none was run."
    heads = ["reading", "met", "statements", f"pantographs that meet {search['counts']}"]
    heads += [
        " ".join([*one.get("where", {}).values(), FIGURES[one["figure"]].head])
        for one in search["shown"]
    ]
    return texts_table(heads, [cells for *_, cells in found], title=title, note=note)


def _range(rows: Rows, figure: str, where: Mapping[str, str] | None = None) -> str:
    values = rows.at(figure, **(where or {}))
    if not values:
        return ""
    low, high = (format(which(values), FIGURES[figure].format) for which in (min, max))
    return f"{low} to {high}"


def rank(start: Rows, varied: Mapping[str, Rows], study: PaperStudy) -> list[Ranked]:
    """The case, then the variations by how much they move the ranking's figure at either damping.

    ``start`` has the rows of the case, ``varied`` those of each variation by its title. Variations
    that broke are left out; there is no row if the case itself broke.
    """
    figure = study.table["ranking"]["figure"]

    def effect(one: Ranked) -> float:
        return max(
            abs(one.rows.at(figure, damping=damping)[0] - start.at(figure, damping=damping)[0])
            for damping in study.dampings
        )

    if start.missing or not start.rows:
        return []
    whole = [Ranked(title, rows) for title, rows in varied.items() if not rows.missing]
    return [Ranked("", start), *sorted(whole, key=effect, reverse=True)]


def ranking_table(study: PaperStudy, ranked: Sequence[Ranked]) -> StudyTable:
    """Table of a ranking, as ``rank`` returns it, for the report."""
    ranking, dampings = study.table["ranking"], study.dampings
    figure, head = ranking["figure"], FIGURES[ranking["figure"]].head

    def values(rows: Rows, name: str) -> list[float]:
        return [rows.at(name, damping=damping)[0] for damping in dampings]

    rows = []
    for one in ranked:
        own = values(one.rows, figure)
        case = values(ranked[0].rows, figure)
        changes = [f"{a - b:+.1f}" if one.title else "" for a, b in zip(own, case, strict=True)]
        pairs = [
            " / ".join(format(value, FIGURES[name].format) for value in values(one.rows, name))
            for name in ranking["shown"]
        ]
        rows.append([one.title or "the case", *(f"{v:.1f}" for v in own), *changes, *pairs])
    note = (
        f"One input at a time, one pantograph, in the order of their effect on {head}; "
        f"{' / '.join(dampings)} damping."
    )
    heads = ["input", *(f"{head} {damping}" for damping in dampings)]
    heads += [f"change {damping}" for damping in dampings]
    heads += [FIGURES[name].head for name in ranking["shown"]]
    return texts_table(heads, rows, title="What the open inputs decide", note=note)


def movers(statement: Statement, ranked: Sequence[Ranked]) -> str:
    """The variations that move a statement's figure most, as sentences; "" without any."""
    alone = statement.alone
    if alone is None or len(ranked) < 2:
        return ""
    column = FIGURES[alone.figure]

    def of(one: Ranked) -> float:
        return one.rows.at(alone.figure, damping=alone.damping)[0]

    def in_words(value: float) -> str:
        return format(value, column.format)

    case, *varied = ranked
    start = of(case)
    most = sorted(varied, key=lambda one: abs(of(one) - start), reverse=True)[:_NAMED]
    listed = "; ".join(
        f"{one.title}: {in_words(of(one))}" for one in most if in_words(of(one)) != in_words(start)
    )
    moved = f"moved most by {listed}" if listed else "moved by no variation"
    text = (
        f"One pantograph, {alone.damping}: {column.head} {in_words(start)} in the case; {moved}. "
    )
    holds = _holds_alone(statement, case.rows)
    turned = [one.title for one in varied if _holds_alone(statement, one.rows) != holds]
    if holds:
        text += "It satisfies the statement: the second pantograph makes the difference. "
        return text + (f"Alone it fails with {_some(turned)}." if turned else "").strip()
    if not turned:
        return text + f"None of the {len(varied)} variations alone makes the statement hold for it."
    return text + f"The statement holds for it with {_some(turned)}."


def _some(titles: Sequence[str]) -> str:
    """The first titles, and how many more there are."""
    more = len(titles) - _NAMED
    return "; ".join(titles[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def _bands(
    study: PaperStudy,
    runs: Mapping[str, StudyRun],
    readings: Sequence[Mapping[str, Any]],
    rows: Mapping[str, Rows],
) -> dict[str, tuple[tuple[float, float], Rows]]:
    """Frequencies of the first modes of each reading's running spans [Hz], and its figures; one
    mode a span, as shorter transition spans lie above."""
    # The runs are planned without a backend.
    from catenary.cases.run.scene_mesh import mesh_of
    from catenary.cases.studies.waves.theory import first_band
    from catenary.solver.statics.form_finding import find_form

    found = {}
    for one in readings:
        run = runs[run_name(one["name"], study.dampings[0], study.trains[0])]
        if run.ended.done:
            problem = problem_of(run.scene)
            model, _ = find_form(problem, mesh_of(run.scene))
            line = problem.line
            band = first_band(model, line.n_spans - sum(line.n_transition))
            found[one["title"]] = band, rows[one["name"]]
    return found


def separation_table(
    study: PaperStudy, readings: Mapping[str, tuple[tuple[float, float], Rows]]
) -> StudyTable:
    """Delay of the trailing pantograph in periods of the ringing spans, and its standard deviation
    over the deviation of a single pantograph.

    ``readings`` gives by title the lowest and highest frequency of the line's first modes [Hz], and
    the rows. A span that has been passed rings in these modes; their frequencies lie close
    together, one for each span, so that the ringing stays there until the trailing pantograph
    comes.
    """
    rows = []
    for title, (band, found) in readings.items():
        for train in study.table["trains"]:
            own = [row for row in found.rows if row["train"] == train["name"]]
            if "separation_m" not in train or not own:
                continue
            speed = own[0]["speed_over_wave"] * own[0]["wave_speed_km_h"] / 3.6
            delay = train["separation_m"] / speed
            ratios = [_ratio(found, train["name"], damping) for damping in study.dampings]
            periods = " to ".join(f"{delay * frequency:.2f}" for frequency in band)
            modes = " to ".join(f"{frequency:.2f}" for frequency in band)
            rows.append([title, modes, train["name"], f"{delay:.2f}", periods, *ratios])
    note = (
        "A span rings in the first modes after the leading pantograph has passed. The trailing one "
        "comes after so many periods; its standard deviation is so many times the single one's."
    )
    heads = ["reading", "first modes [Hz]", "train", "delay [s]", "delay [periods]"]
    heads += [f"deviation / single, {damping}" for damping in study.dampings]
    return texts_table(heads, rows, title="Which separation is critical", note=note)


def _ratio(rows: Rows, train: str, damping: str) -> str:
    trailing = rows.at("std_N", train=train, damping=damping)
    alone = rows.at("std_N", place=SINGLE, damping=damping)
    return f"{trailing[-1] / alone[0]:.2f}" if trailing and alone else "-"
