"""Sections of a full report, those that need the scene of the run among them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.studies.full_report import data_sheets, worst_places
from catenary.cases.studies.full_report.scene_of_run import SceneOfRun
from catenary.cases.studies.records import read_study
from catenary.cases.studies.reference.judgement import FAILED, NOT_JUDGED, read_table
from catenary.cases.studies.reference.pages import VALIDATION
from catenary.postproc.report.report import SECTIONS
from catenary.postproc.report.sections import dynamics, run_facts
from catenary.postproc.report.sections.section import (
    EvaluatedRun,
    Folded,
    Picture,
    Section,
    SectionEntry,
    Text,
)
from catenary.postproc.report.study_table import StudyTable, texts_table

_HEADING = "Validation by EN 50318"


def statement_in(folder: Path) -> dict[str, Any]:
    """The statement that a folder of `catenary validate -o FOLDER` holds. Not collective.

    Returns ``installation``, ``steps``, ``figures`` and ``closing`` of its record.

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


def validation_section(statement: Mapping[str, Any] | None, run: EvaluatedRun) -> Section:
    """Validation of the program that made a run, by what ``statement_in`` found; None if no
    statement is at hand."""
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


# Snapshots times length of the line [m] of a picture that is quickly drawn.
_LARGEST = 1e7


def _waves(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """Motion of the contact wire in space and time, from the snapshots of the run."""
    # Snapshots of films are read as waves are.
    from catenary.cases.studies.waves import pictures
    from catenary.cases.studies.waves.seen import waves_seen
    from catenary.cases.studies.waves.theory import wave_theory
    from catenary.postproc.film.film_data import film_data
    from catenary.postproc.film.snapshots import Snapshots

    heading, results = "Waves in space and time", run.results
    try:
        data = film_data(results)
        folder, until = results.path.parent, float(data.time[-1])
        with Snapshots(folder, len(data.points), until=until) as snapshots:
            snapshots.need_whole()
            size = len(snapshots.times) * float(np.ptp(data.points[:, 0]))
            if size > _LARGEST:
                raise InputError("the run is too long for it; catenary waves draws it")
            seen = waves_seen(data, snapshots)
        theory = wave_theory(scene.problem, scene.at_rest)
    except InputError as error:
        return Section(heading, [Text(f"There is no picture: {error}.")])
    supports = results.line("support_x")
    text = "Velocity of the lowest contact wire in space and time"
    moving = "force" if run.excitation else "pantographs"
    if seen.position.shape[1]:
        text += f", and the course of the {moving}"
    drawn = partial(pictures.space_time, seen, theory, supports, moving)
    picture = Picture("space_time", f"{text}.", drawn)
    return Section(heading, [], [picture])


def full_sections(
    scene: SceneOfRun | None,
    costs: tuple[Mapping[str, str], str] = ({}, ""),
    statement: Mapping[str, Any] | None = None,
) -> list[SectionEntry]:
    """The sections of a full report in their order.

    Parameters
    ----------
    scene : of the run; None leaves out what needs it
    costs : of its effects, as ``run_facts.effects`` takes them
    statement : of the installation, as ``validation_section`` takes it
    """
    effects = SectionEntry("effects", partial(run_facts.effects, costs=costs))
    worst = partial(worst_places.section, scene)
    behind = {"motion": [SectionEntry("worst", worst, dynamics.has_statistics, full=True)]}
    text = None
    if scene is not None:
        text = scene.input_text
        behind["spectrum"] = [SectionEntry("waves", partial(_waves, scene), full=True)]
        behind["rest"] = [SectionEntry("line", partial(data_sheets.line, scene), full=True)]
        if scene.has_train:
            sheet = partial(data_sheets.pantographs, scene)
            behind["above"] = [SectionEntry("pantographs", sheet, full=True)]
    behind["run"] = [SectionEntry("validation", partial(validation_section, statement), full=True)]
    last = SectionEntry("signatures", partial(run_facts.signatures, text), full=True)
    return [
        *(
            one
            for entry in SECTIONS
            for one in (
                effects if entry.name == effects.name else entry,
                *behind.get(entry.name, ()),
            )
        ),
        last,
    ]
