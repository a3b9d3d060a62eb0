"""Sections of a full report, those that need the scene of the run among them."""

from __future__ import annotations

from functools import cached_property, partial

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.problem import problem_of
from catenary.postproc.read.results import Results
from catenary.postproc.report.report import SECTIONS
from catenary.postproc.report.sections.section import SectionEntry
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
    def at_rest(self) -> LineAtRest:
        """Its line at rest."""
        return line_at_rest(self.problem, mesh_of(self.scene))


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
        "motion": [SectionEntry("worst", worst, worst_places.applies, full=True)],
        "rest": [SectionEntry("line", partial(data_sheets.line, scene), is_known, full=True)],
        "above": [
            SectionEntry("pantographs", partial(data_sheets.pantographs, scene), is_driven, True)
        ],
    }
    return [one for entry in SECTIONS for one in (entry, *behind.get(entry.name, ()))]
