"""Report of a study: ``study.html`` with verdicts, tables and figures, the figures' data as CSV.

A study compares many runs with what a source states of its own; who made it fills a ``Study``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from catenary.postproc.files.csv_text import csv_text, number_text
from catenary.postproc.report.page import Folded, Picture, Section, page
from catenary.postproc.report.study_table import StudyTable, texts_table, write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPRODUCED, NOT_REPRODUCED, UNDECIDED = "reproduced", "not reproduced", "cannot be decided"


@dataclass(frozen=True)
class Finding:
    """The verdict on one statement of the source.

    Attributes
    ----------
    number : of the statement
    statement : its text in the source
    criterion : when it counts as reproduced
    verdict : ``REPRODUCED``, ``NOT_REPRODUCED`` or ``UNDECIDED``
    found : our numbers
    reason : where it differs, what decides it
    """

    number: int
    statement: str
    criterion: str
    verdict: str
    found: str
    reason: str = ""


@dataclass(frozen=True)
class Reading:
    """The verdicts on all statements under one choice of what the source leaves open."""

    name: str
    title: str
    changes: Sequence[str]
    findings: Sequence[Finding]

    @property
    def n_reproduced(self) -> int:
        """Number of reproduced statements."""
        return sum(one.verdict == REPRODUCED for one in self.findings)


@dataclass(frozen=True)
class StudyFigure:
    """A picture and the numbers that it shows: columns of a CSV file, of any lengths."""

    name: str
    caption: str
    figure: Figure
    columns: Mapping[str, Sequence[Any] | np.ndarray]


@dataclass(frozen=True)
class Study:
    """Results of a study. The first reading is the case as it stands."""

    title: str
    lead: str
    readings: Sequence[Reading]
    tables: Sequence[StudyTable] = ()
    figures: Sequence[StudyFigure] = field(default_factory=tuple)


def write_study(
    study: Study, out_dir: Path, rows: Sequence[Mapping[str, Any]], facts: Mapping[str, Any]
) -> list[Path]:
    """Write ``study.html``, ``study.json`` and every figure as PNG and CSV. Not collective.

    Parameters
    ----------
    study : Study
        What was found.
    out_dir : Path
        Folder that exists.
    rows : sequence of mapping
        Figures of every run, for ``study.json``, with their units in their names.
    facts : mapping
        What is said of the study as a whole, such as its run time.
    """
    from catenary.postproc.report.pictures import figures

    pictures: dict[str, bytes] = {}
    for one in study.figures:
        pictures |= figures.painted(one.name, partial(getattr, one, "figure"))
    record = {
        "title": study.title,
        "facts": dict(facts),
        "readings": [asdict(reading) for reading in study.readings],
        "tables": [
            {"title": table.title, "note": table.note, "head": table.head, "rows": table.texts()}
            for table in study.tables
        ],
        "runs": list(rows),
    }
    return write_files(
        out_dir,
        {
            **{f"{name}.png": data for name, data in pictures.items()},
            **{f"{figure.name}.csv": columns_csv(figure.columns) for figure in study.figures},
            "study.html": page(study.title, study.lead, _sections(study, facts), pictures),
            "study.json": record,
        },
    )


def columns_csv(columns: Mapping[str, Sequence[Any] | np.ndarray]) -> str:
    """Columns side by side as CSV text; shorter ones end in empty cells."""
    values = ([_cell(value) for value in column] for column in columns.values())
    return csv_text(list(columns), zip_longest(*values, fillvalue=""))


def _cell(value: Any) -> Any:
    return number_text(float(value)) if isinstance(value, float | np.floating) else value


def verdict_text(study: Study) -> str:
    """The verdicts for a terminal: one line a statement, one column a reading."""
    names = [reading.name for reading in study.readings]
    widths = [max(len(name), len(UNDECIDED)) for name in names]
    pairs = list(zip(names, widths, strict=True))
    lines = ["    " + "  ".join(f"{name:{width}}" for name, width in pairs) + "  statement"]
    for findings in zip(*(reading.findings for reading in study.readings), strict=True):
        cells = zip(findings, widths, strict=True)
        lines.append(
            f"{findings[0].number:2}. "
            + "  ".join(f"{finding.verdict:{width}}" for finding, width in cells)
            + f"  {findings[0].statement}"
        )
    return "\n".join(lines)


def _sections(study: Study, facts: Mapping[str, Any]) -> Iterator[Section]:
    first, *others = study.readings
    rows = [
        [one.number, f"{one.statement} ({one.criterion})", one.verdict, one.found, one.reason]
        for one in first.findings
    ]
    heads = ["no.", "the source states", "verdict", "found", "where it differs, why"]
    yield Section("", [texts_table(["", ""], list(facts.items()))])
    yield Section("Verdicts", [texts_table(heads, rows)])
    if others:
        short = {REPRODUCED: "yes", NOT_REPRODUCED: "no", UNDECIDED: "?"}
        numbers = [str(one.number) for one in first.findings]
        rows = [
            [one.title, " ".join(one.changes) or "none",
             *(short[finding.verdict] for finding in one.findings),
             f"{one.n_reproduced} of {len(one.findings)}"]
            for one in study.readings
        ]  # fmt: skip
        folded = [
            Folded(
                f"Figures: {one.title}",
                texts_table(["", "", ""], [[f.number, f.verdict, f.found] for f in one.findings]),
            )
            for one in others
        ]
        title = "The same statements under other readings of what is left open"
        yield Section(
            title, [texts_table(["reading", "changes", *numbers, "reproduced"], rows)], (), folded
        )
    for table in study.tables:
        yield Section(table.title, [replace(table, title="")])
    if study.figures:
        shown = [
            Picture(
                one.name, f"{one.caption} Data: {one.name}.csv", partial(getattr, one, "figure")
            )
            for one in study.figures
        ]
        yield Section("Figures", [], shown)
