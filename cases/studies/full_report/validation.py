"""Statement of ``catenary validate`` on an installation, as a section of a run's report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.studies.records import read_study
from catenary.cases.studies.reference.judgement import FAILED, NOT_JUDGED, read_table
from catenary.cases.studies.reference.pages import VALIDATION
from catenary.postproc.report.sections.section import EvaluatedRun, Folded, Section, Text
from catenary.postproc.report.study_table import StudyTable, texts_table

_HEADING = "Validation by EN 50318"


def statement_in(folder: Path) -> dict[str, Any]:
    """The statement that a folder holds. Not collective.

    Parameters
    ----------
    folder : Path
        Folder of `catenary validate -o FOLDER`.

    Returns
    -------
    dict
        ``installation``, ``steps``, ``figures`` and ``closing`` of its record.

    Raises
    ------
    InputError
        If there is no such statement.
    """
    path = folder / f"{VALIDATION}.json"
    found = read_study(path, "catenary validate")
    try:
        return {
            "installation": {
                key: str(found["installation"][key]) for key in ("program", "machine")
            },
            "steps": [(str(step["title"]), str(step["said"])) for step in found["steps"]],
            "figures": [row for row in found["figures"] if row["verdict"] != NOT_JUDGED],
            "closing": [str(text) for text in found["closing"]],
        }
    except (KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `catenary validate`: it is incomplete") from error


def section(statement: Mapping[str, Any] | None, run: EvaluatedRun) -> Section:
    """Validation of the program that made a run.

    Parameters
    ----------
    statement : mapping or None
        What ``statement_in`` found; None if no statement is at hand.
    run : EvaluatedRun
        Run.
    """
    if statement is None:
        text = (
            "No validation of this installation is at hand. `catenary validate -o STUDY` goes "
            "through the steps of EN 50318; `catenary report --validation STUDY` shows them here."
        )
        return Section(_HEADING, [Text(text)])
    figures = statement["figures"]
    title = f"Judged figures ({len(figures)})"
    folded = [Folded(title, read_table(figures, ""))] if figures else []
    return Section(_HEADING, _blocks(statement, run), folded=folded)


def _blocks(statement: Mapping[str, Any], run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    program, machine = statement["installation"].values()
    yield Text(f"Statement of {program} on {machine}.")
    made_by = " ".join(next(iter(run.results.attributes["versions"].items())))
    if program != made_by:
        yield Text(f"It is not one of the program of this run, {made_by}.", "remark")
    rows = [[number, *step] for number, step in enumerate(statement["steps"], start=1)]
    yield texts_table(["", "step", "result"], rows, {0})
    failed = [row for row in statement["figures"] if row["verdict"] == FAILED]
    if failed:
        yield read_table(failed, "Figures beyond their limits")
    yield Text(" ".join(statement["closing"]))
