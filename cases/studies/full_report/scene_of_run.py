"""The scene that a run recorded, as its full report needs it."""

from __future__ import annotations

from functools import cached_property

import tomli_w

from catenary.base.errors import InputError
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.problem import problem_of, resolved
from catenary.postproc.read.results import Results
from catenary.postproc.report.sections.run_facts import INPUT
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
        origin = Origin(INPUT)
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
