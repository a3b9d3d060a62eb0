"""What a study leaves: ``study.html`` with verdicts, tables and figures, the figures' data as CSV.

A study compares many runs with what a source states of its own; who made it fills a ``Study``.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

from catenary.postproc.files.csv_text import csv_text, number_text
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures

REPRODUCED, NOT_REPRODUCED, UNDECIDED = "reproduced", "not reproduced", "cannot be decided"
_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Finding:
    """The verdict on one statement of the source.

    Attributes
    ----------
    number : of the statement
    statement : what the source says
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
        """How many statements are reproduced."""
        return sum(one.verdict == REPRODUCED for one in self.findings)


@dataclass(frozen=True)
class StudyTable:
    """A table: column heads and rows of text; numbers are written by who made it."""

    title: str
    note: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class StudyFigure:
    """A picture and the numbers that it shows: columns of a CSV file, of any lengths."""

    name: str
    caption: str
    figure: Figure
    columns: Mapping[str, Sequence[Any] | np.ndarray]


@dataclass(frozen=True)
class Study:
    """All that a study found. The first reading is the case as it stands."""

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
    study : what was found
    out_dir : folder that exists
    rows : figures of every run, for ``study.json``
    facts : what is said of the study as a whole, such as its run time
    """
    pictures: dict[str, bytes] = {}
    for one in study.figures:
        pictures |= figures.painted(one.name, partial(getattr, one, "figure"))
    content: dict[str, bytes | str] = {f"{name}.png": data for name, data in pictures.items()}
    for figure in study.figures:
        content[f"{figure.name}.csv"] = columns_csv(figure.columns)
    content["study.html"] = _html(study, pictures, facts)
    record = {
        "title": study.title,
        "facts": dict(facts),
        "readings": [asdict(reading) for reading in study.readings],
        "tables": [asdict(table) for table in study.tables],
        "runs": list(rows),
    }
    content["study.json"] = json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n"
    return write_all(out_dir, content)


def columns_csv(columns: Mapping[str, Sequence[Any] | np.ndarray]) -> str:
    """Columns side by side as CSV text; shorter ones end in empty cells."""
    values = [list(column) for column in columns.values()]
    longest = max((len(column) for column in values), default=0)
    rows = (
        [_cell(column[i]) if i < len(column) else "" for column in values] for i in range(longest)
    )
    return csv_text(list(columns), rows)


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


def _html(study: Study, pictures: Mapping[str, bytes], facts: Mapping[str, Any]) -> str:
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    uris = {
        name: "data:image/png;base64," + base64.b64encode(data).decode("ascii")
        for name, data in pictures.items()
    }
    css = {REPRODUCED: "yes", NOT_REPRODUCED: "no", UNDECIDED: "open"}
    return environment.get_template("study.html.j2").render(
        study=study, uris=uris, facts=facts, css=css
    )
