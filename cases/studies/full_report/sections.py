"""Sections of a full report, those that need the scene of the run among them."""

from __future__ import annotations

from functools import cached_property, partial

import tomli_w

from catenary.base.errors import InputError
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.problem import problem_of, resolved
from catenary.postproc.read.results import Results
from catenary.postproc.report.report import SECTIONS
from catenary.postproc.report.sections import run_facts
from catenary.postproc.report.sections.section import (
    EvaluatedRun,
    Picture,
    Section,
    SectionEntry,
    Text,
)
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest


class SceneOfRun:
    """The scene that a run recorded, and its line at rest, computed when it is asked for.

    Parameters
    ----------
    results : of the run, open

    Raises
    ------
    InputError
        If the recorded scene is not one of this version.
    """

    def __init__(self, results: Results) -> None:
        origin = Origin(str(results.path), recorded=True)
        self.scene = scene_from(results.attributes["config"], origin)
        self.problem: Problem = problem_of(self.scene)

    @cached_property
    def input_text(self) -> str | None:
        """The scene as a case in TOML, without keys at their usual values; None if that would load
        to another scene, such as one with files that are not there."""
        plain = self.scene.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        origin = Origin(run_facts.INPUT)
        try:
            usual = scene_from(plain | {"effects": {}}, origin).switches()
            switched = self.scene.switches().items()
            plain["effects"] = {name: on for name, on in switched if on != usual[name]}
            if resolved(scene_from(plain, origin)) != resolved(self.scene):
                return None
        except InputError:
            return None
        return tomli_w.dumps(plain)

    @cached_property
    def at_rest(self) -> LineAtRest:
        """Its line at rest."""
        return line_at_rest(self.problem, mesh_of(self.scene))


def _waves(scene: SceneOfRun, run: EvaluatedRun) -> Section:
    """Motion of the contact wire over place and time, from the snapshots of the run."""
    # Snapshots of films are read as waves are.
    from catenary.cases.studies.waves import pictures
    from catenary.cases.studies.waves.seen import waves_seen
    from catenary.cases.studies.waves.theory import wave_theory
    from catenary.postproc.film.film_data import film_data
    from catenary.postproc.film.snapshots import Snapshots

    heading, results = "Waves over place and time", run.results
    try:
        data = film_data(results)
        folder, until = results.path.parent, float(data.time[-1])
        with Snapshots(folder, len(data.points), until=until) as snapshots:
            snapshots.need_whole("a space-time picture")
            seen = waves_seen(data, snapshots)
        theory = wave_theory(scene.problem, scene.at_rest)
    except InputError as error:
        return Section(heading, [Text(f"There is no picture: {error}.")])
    supports = results.line("support_x")
    text = "Velocity of the contact wire over place and time, with the pantographs' courses."
    picture = Picture("space_time", text, lambda: pictures.space_time(seen, theory, supports))
    return Section(heading, [], [picture])


def full_sections(scene: SceneOfRun | None) -> list[SectionEntry]:
    """The sections of a full report in their order.

    Parameters
    ----------
    scene : of the run; None leaves out what needs it
    """
    from catenary.cases.studies.full_report import data_sheets, worst_places

    def is_driven(run: object) -> bool:
        return scene is not None and bool(scene.problem.train.placements)

    def is_known(run: object) -> bool:
        return scene is not None

    worst = partial(worst_places.section, at_rest=lambda: scene and scene.at_rest)
    behind = {
        "spectrum": [SectionEntry("waves", partial(_waves, scene), is_driven, full=True)],
        "motion": [SectionEntry("worst", worst, worst_places.applies, full=True)],
        "rest": [SectionEntry("line", partial(data_sheets.line, scene), is_known, full=True)],
        "above": [
            SectionEntry("pantographs", partial(data_sheets.pantographs, scene), is_driven, True)
        ],
    }
    text = scene.input_text if scene is not None else None
    last = SectionEntry("signatures", partial(run_facts.signatures, text), full=True)
    behind["run"] = [last]
    return [one for entry in SECTIONS for one in (entry, *behind.get(entry.name, ()))]
