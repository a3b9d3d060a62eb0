"""The validation of this installation by the steps of EN 50318, and output of judgements.

``judge`` and ``validate`` write a page and its tables, and print a text.
"""

from __future__ import annotations

import csv
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import find_case
from catenary.cases.scene.load import load_scene
from catenary.cases.studies.records import read_study
from catenary.cases.studies.reference.judgement import (
    FAILED,
    NOT_JUDGED,
    Others,
    bounds_of,
    counts,
    judged,
    judged_row,
    limits,
    readers_table,
    table_of,
)
from catenary.cases.studies.reference.solutions import (
    LINE,
    RECORDED,
    UPLIFT,
    configurations,
    figures_of,
    read_solution,
)
from catenary.cases.studies.sweep.jobs import Ended, Job, all_done
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.evaluate.wording import UNCOMPARED_SAYS
from catenary.postproc.measurements.compared import LINE_TEST, SUMMARY
from catenary.postproc.report.page import Picture, Section, Text, page
from catenary.postproc.report.pictures import along_track, figures
from catenary.postproc.report.study_table import Content, StudyTable

# Quantities of accepted_ranges.csv by their names here.
_OF_RANGES = {
    "mean": "mean_N",
    "standard_deviation": "std_N",
    "statistical_maximum": "stat_max_N",
    "statistical_minimum": "stat_min_N",
    "maximum": "max_N",
    "minimum": "min_N",
    "loss_of_contact": "loss_percent",
    "support_uplift": UPLIFT,
}
_ELASTICITY = ("elasticity_max_mm_per_N", "elasticity_min_mm_per_N")
JUDGED, VALIDATION = "judged", "validation"
_BORROWED = (
    "The bands of EN 50318:2018 for its reference models are not publicly known: figures are "
    "judged by what the standard allows between a simulation and a line test."
)


@dataclass(frozen=True)
class Step:
    """A step of the validation: title, rows of ``judgement.COLUMNS``, and a sentence on them, or
    why there are none."""

    title: str
    rows: Sequence[dict[str, Any]]
    text: str = ""


@dataclass(frozen=True)
class Validation:
    """All steps in their order, and what was validated by name."""

    steps: Sequence[Step]
    installation: dict[str, str]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The rows of all steps."""
        return [row for step in self.steps for row in step.rows]


def jobs_of_validation() -> list[Job]:
    """The runs: reference models as their cases are shipped. Not collective."""
    case = limits()["ranges"]["case"]
    jobs = []
    for speed in sorted({row["speed_km_h"] for row in _reference(case, "accepted_ranges.csv")}):
        words = (f"train.speed_km_h={speed}",)
        scene = load_scene(case, [*words, *RECORDED])
        jobs.append(Job(Variant(f"{case}_{speed}", words), scene, keep_results=False))
    jobs += [
        Job(Variant(one.name, one.assignments), one.scene(), keep_results=False)
        for one in configurations()
    ]
    return jobs


def line_test(folder: Path | None) -> Step:
    """The step that compares a run with a measured passage. Not collective.

    Parameters
    ----------
    folder : of `catenary compare RUN FILE -o FOLDER`; None if no line was measured

    Raises
    ------
    InputError
        If the folder holds no such comparison.
    """
    rule = limits()["line_test"]
    if folder is None:
        return Step(rule["title"], [], rule["why"])
    path, verb = folder / SUMMARY, "catenary compare RUN measured.csv"
    record = read_study(path, verb)
    try:
        run, errors = record["run"], [one["text"] for one in record["errors"]]
        rows = [_measured_row(Path(run).parent.name, one) for one in record["figures"]]
        text = f"{record['measured']} beside {run}."
    except (KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `{verb}`: it is incomplete") from error
    return Step(rule["title"], rows, " ".join([text, *(f"Error: {text}." for text in errors)]))


def _measured_row(run: str, one: Mapping[str, Any]) -> dict[str, Any]:
    """A figure of a run beside the measured one; noise may leave one beyond its bounds unjudged."""
    value, measured, tolerance = one["run"], one["measured"], one["tolerance"]
    bounds = None if tolerance is None else (measured - tolerance, measured + tolerance)
    rule = {"clause": one["source"], "compared": one["source"] != LINE_TEST}
    quantity = f"{one['figure']} [{one['unit']}]"
    row = judged_row(run, one["pantograph"] or LINE, quantity, value, bounds, rule)
    if one["verdict"].startswith(NOT_JUDGED):
        row["verdict"] = NOT_JUDGED
    return row | {"reference": measured, "difference": value - measured}


def validate(ended: Sequence[Ended], measured: Step) -> Validation:
    """The validation from its runs. Not collective.

    Parameters
    ----------
    ended : of ``jobs_of_validation``
    measured : its last step, as ``line_test`` gives it

    Raises
    ------
    RunBroken
        If one broke.
    """
    summaries = {name: run.summary for name, run in all_done(ended).items()}
    rules = limits()
    references, elasticity, models = [], [], set()
    for one in configurations():
        figures, solution = figures_of(summaries[one.name]), read_solution(one.name)
        at_rest = {(LINE, name): figures.pop((LINE, name)) for name in _ELASTICITY}
        references += judged(solution, figures)
        if one.model not in models:  # all configurations of a model have one line
            elasticity += judged(solution, at_rest, rules["elasticity"])
            models.add(one.model)
    steps = [
        Step(rules["rest"]["title"], _lengths(summaries)),
        Step(rules["elasticity"]["title"], elasticity),
        Step(rules["ranges"]["title"], _in_ranges(summaries)),
        Step(rules["reference"]["title"], references),
        measured,
    ]
    installation = {
        "program": f"catenary {version('catenary')}",
        "machine": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
    }
    return Validation(steps, installation)


def _lengths(summaries: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Lengths of the droppers of a middle span beside the nominal ones [mm]."""
    rule = limits()["rest"]
    case = rule["case"]
    first = next(one.name for one in configurations() if one.case == case)
    found = summaries[first]["static"]["dropper_lengths_m"]
    rows = []
    for number, (length, nominal) in enumerate(
        zip(found, _reference(case, "dropper_lengths.csv"), strict=True), start=1
    ):
        wanted = 1e3 * float(nominal["length_m"])
        quantity = f"length of dropper {number} [mm]"
        bounds = bounds_of(rule, wanted)
        row = judged_row(case, LINE, quantity, 1e3 * length, bounds, rule)
        rows.append(row | {"reference": wanted, "difference": 1e3 * length - wanted})
    return rows


def _in_ranges(summaries: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Figures of the reference model of EN 50318:2002 within its accepted ranges."""
    rule, rows = limits()["ranges"], []
    case = rule["case"]
    for accepted in _reference(case, "accepted_ranges.csv"):
        name = f"{case}_{accepted['speed_km_h']}"
        quantity = _OF_RANGES[accepted["quantity"]]
        figures = figures_of(summaries[name])
        (key,) = (key for key in figures if key[1] == quantity)
        bounds = float(accepted["lower"]), float(accepted["upper"])
        rows.append(judged_row(name, key[0], quantity, figures[key], bounds, rule))
    return rows


def _reference(case: str, name: str) -> list[dict[str, str]]:
    """Rows of a file in ``reference`` of a shipped case, without its comments."""
    path = find_case(case).parent / "reference" / name
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


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
            pictures |= figures.painted(about.name, partial(along_track.overlaid_forces, panels))
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
            lines.append(readers_table(failed, "").text())
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
            blocks.append(readers_table(rows, ""))
        yield Section(f"{number}. {step.title}", blocks)


def _markdown(found: Validation) -> str:
    parts = [f"{found.installation['program']}, {found.installation['machine']}"]
    for number, step in enumerate(found.steps, start=1):
        parts.append(f"## {number}. {step.title}\n\n{_result_of(step)}")
        if rows := _shown(step):
            parts.append(readers_table(rows, "").markdown())
    return "\n\n".join(["# Validation by EN 50318", *parts, *_closing(found)]) + "\n"
