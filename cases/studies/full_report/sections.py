"""Sections of a full report, those that need the scene of the run among them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.studies.full_report import data_sheets, validation, worst_places
from catenary.cases.studies.full_report.scene_of_run import SceneOfRun
from catenary.postproc.report.report import SECTIONS
from catenary.postproc.report.sections import dynamics, run_facts
from catenary.postproc.report.sections.section import (
    EvaluatedRun,
    Picture,
    Section,
    SectionEntry,
    Text,
)

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
    text = "Velocity of the lowest contact wire in space and time, and the pantographs' courses."
    picture = Picture("space_time", text, lambda: pictures.space_time(seen, theory, supports))
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
    statement : of the installation, as ``validation.section`` takes it
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
    behind["run"] = [SectionEntry("validation", partial(validation.section, statement), full=True)]
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
