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
from catenary.solver.effects.all_effects import registry
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest


class SceneOfRun:
    """The scene that a run recorded, and its line at rest, computed when it is asked for.

    Attributes
    ----------
    scene, problem : of the run
    has_train : whether a train excites the line

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
        # A line that a force or a blow excites has no train, though its scene has.
        self.has_train = not results.attributes.get("excitation")

    @cached_property
    def input_text(self) -> str | None:
        """The scene as a case in TOML, without keys at their usual values.

        None if it would not make the run again: of a line without its train, or of a scene that
        does not load to the same one, as its files are gone.
        """
        if not self.has_train:
            return None
        plain = self.scene.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        # What is on by itself where its data are there is not asked for; what is off has its data.
        known, switched = registry(), self.scene.switches()
        plain["effects"] = {
            name: on for name, on in switched.items() if not (on and known[name].default)
        }
        try:
            if resolved(scene_from(plain, Origin(INPUT))) != resolved(self.scene):
                return None
        except InputError:
            return None
        return tomli_w.dumps(plain)

    @cached_property
    def at_rest(self) -> LineAtRest:
        """Its line at rest."""
        return line_at_rest(self.problem, mesh_of(self.scene))
