"""Output of ``judge`` and ``validate``: a page, its tables, and text for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from catenary.cases.studies.reference.judgement import (
    FAILED,
    NOT_JUDGED,
    counts,
    judged,
    read_table,
    table_of,
)
from catenary.cases.studies.reference.others_results import Others
from catenary.cases.studies.reference.validation import Step, Validation
from catenary.postproc.evaluate.wording import UNCOMPARED_SAYS
from catenary.postproc.report.page import page
from catenary.postproc.report.pictures import figures, overlays
from catenary.postproc.report.sections.section import Picture, Section, Text
from catenary.postproc.report.study_table import Content, StudyTable

JUDGED, VALIDATION = "judged", "validation"
_BORROWED = (
    "The bands of EN 50318:2018 for its reference models are not publicly known: figures are "
    "judged by what the standard allows between a simulation and a line test."
)


def rows_of(others: Sequence[Others]) -> list[dict[str, Any]]:
    """Judged rows of results of any program."""
    return [row for one in others for row in judged(one.solution, one.figures)]


def judged_text(others: Sequence[Others]) -> str:
    """The table of a judgement, its counts and remarks, for a terminal."""
    rows = rows_of(others)
    remarks = [f"REMARK      {text}" for one in others for text in one.remarks]
    lines = [table_of(rows, "").text(), "", counts(rows), _BORROWED, UNCOMPARED_SAYS, *remarks]
    return "\n".join(lines)


def judged_files(others: Sequence[Others]) -> dict[str, Content]:
    """Page, CSV, JSON and pictures of a judgement. Not collective."""
    rows = rows_of(others)
    table = table_of(rows, "Figures")
    pictures: dict[str, bytes] = {}
    sections = []
    for one in others:
        about, place = one.solution.configuration, one.solution.place
        panels = [
            (of, [("reference", place, one.solution.forces[of]), ("judged", place, force)])
            for of, force in one.forces.items()
        ]
        if panels:
            pictures |= figures.painted(about.name, partial(overlays.forces, panels))
        own = replace(table, rows=judged(one.solution, one.figures), title="")
        blocks: list[Text | StudyTable] = [Text(about.data), own]
        blocks += [Text(text, "remark") for text in one.remarks]
        shown = [Picture(about.name, "Contact force, 20 Hz low-pass, along the track")]
        sections.append(Section(about.words, blocks, shown))
    lead = f"{counts(rows)} {_BORROWED} {UNCOMPARED_SAYS}."
    content: dict[str, Content] = {f"{name}.png": data for name, data in pictures.items()}
    content[f"{JUDGED}.csv"] = table
    content[f"{JUDGED}.json"] = {"figures": table.records(), "summary": counts(rows)}
    content[f"{JUDGED}.html"] = page("Beside the reference solutions", lead, sections, pictures)
    return content


def validation_text(found: Validation) -> str:
    """The statement for a terminal: each step in a line, and what fails."""
    lines = [f"{found.installation['program']}, {found.installation['machine']}", ""]
    for number, step in enumerate(found.steps, start=1):
        lines.append(f"{number}. {step.title}: {_result_of(step)}")
        failed = [row for row in step.rows if row["verdict"] == FAILED]
        if failed:
            lines.append(read_table(failed, "").text())
    return "\n".join([*lines, "", *_closing(found)])


def _result_of(step: Step) -> str:
    return (
        f"{counts(step.rows)} {step.text}".rstrip() if step.rows else f"{NOT_JUDGED}: {step.text}"
    )


def _closing(found: Validation) -> list[str]:
    deviations = [row for row in found.rows if row["quantity"] == "std_N" and row["reference"]]
    worst = max(abs(row["difference"]) / row["reference"] for row in deviations)
    return [
        "With step and mesh of the shipped cases, standard deviations differ from the reference "
        f"solutions by at most {100 * worst:.1f} %.",
        _BORROWED,
        f"{UNCOMPARED_SAYS}. This statement replaces no assessment.",
    ]


def validation_files(found: Validation) -> dict[str, Content]:
    """The statement as page, Markdown, CSV and JSON. Not collective."""
    table, closing = table_of(found.rows, ""), _closing(found)
    statement = {
        "installation": found.installation,
        "steps": [{"title": step.title, "said": _result_of(step)} for step in found.steps],
        "figures": table.records(),
        "closing": closing,
    }
    html = page("Validation by EN 50318", " ".join(closing), _sections(found), {})
    return {
        f"{VALIDATION}.csv": table,
        f"{VALIDATION}.json": statement,
        f"{VALIDATION}.md": _markdown(found),
        f"{VALIDATION}.html": html,
    }


def _shown(step: Step) -> list[dict[str, Any]]:
    """Rows that people read: those with limits."""
    return [row for row in step.rows if row["verdict"] != NOT_JUDGED]


def _sections(found: Validation) -> Iterator[Section]:
    for number, step in enumerate(found.steps, start=1):
        blocks: list[Text | StudyTable] = [Text(_result_of(step))]
        if rows := _shown(step):
            blocks.append(read_table(rows, ""))
        yield Section(f"{number}. {step.title}", blocks)


def _markdown(found: Validation) -> str:
    parts = [f"{found.installation['program']}, {found.installation['machine']}"]
    for number, step in enumerate(found.steps, start=1):
        parts.append(f"## {number}. {step.title}\n\n{_result_of(step)}")
        if rows := _shown(step):
            parts.append(read_table(rows, "").markdown())
    return "\n\n".join(["# Validation by EN 50318", *parts, *_closing(found)]) + "\n"
