"""The scene that a run recorded, and what studies of its case measured: errors, and costs."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from catenary.base.errors import InputError
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.faults import Origin, shown
from catenary.cases.scene.load import recorded_scene, scene_from
from catenary.cases.scene.problem import problem_of, resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.accuracy import output as accuracy
from catenary.cases.studies.accuracy.runs import physics_of
from catenary.cases.studies.effect_cost import output as effect_cost
from catenary.cases.studies.records import read_study
from catenary.cases.studies.sweep.same_scene import differences
from catenary.postproc.read.results import Results
from catenary.postproc.report.sections.run_facts import INPUT
from catenary.solver.effects.all_effects import active, registry
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest

# Columns of the study's table by the quantities that rule books judge.
_COLUMNS = {
    "mean_force": "error_mean_N",
    "force_std": "error_std_N",
    "force_max": "error_max_N",
    "force_min": "error_min_N",
    "arm_uplift": "error_uplift_mm",
}


class SceneOfRun:
    """The scene that a run recorded, and its line at rest, which is computed.

    Attributes
    ----------
    scene, problem, at_rest : of the run
    has_train : whether a train excites the line

    Parameters
    ----------
    results : of the run, open

    Raises
    ------
    CatenaryError
        If the recorded scene is not one of this version, or its line has no rest.
    """

    def __init__(self, results: Results) -> None:
        self.scene = recorded_scene(results.attributes["config"], results.path)
        self.problem: Problem = problem_of(self.scene)
        self.at_rest: LineAtRest = line_at_rest(self.problem, mesh_of(self.scene))
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
        # Effects that are on by default with their data need no key; those that are off have data.
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


def measured_errors(scene: Scene, folder: Path) -> dict[str, float]:
    """Errors of quantities at the step and mesh of a scene, in their units. Not collective.

    Parameters
    ----------
    folder : of the study, which varied step and mesh together (axis ``grid``)

    Raises
    ------
    InputError
        If there is no such study, if it is of another case, or lacks the scene's step and mesh.
    """
    rows = _rows_of(folder / accuracy.RECORD, "catenary accuracy", scene)
    dt, elements = scene.numerics.dt_s, scene.mesh.elements_per_gap
    own = [
        row
        for row in rows
        if row["outcome"] == "done"
        and row["elements_per_gap"] == elements
        and row["dt_s"] is not None
        and abs(row["dt_s"] / dt - 1.0) < 1e-9
    ]
    if not own:
        raise InputError(
            f"{folder / accuracy.RECORD} has no run with a step of {1e3 * dt:g} ms and {elements} "
            "elements per gap, as this one has: vary both with --axes grid, without --quick"
        )
    known = {quantity: own[0][column] for quantity, column in _COLUMNS.items()}
    return {quantity: abs(error) for quantity, error in known.items() if error is not None}


def measured_costs(scene: SceneOfRun, folder: Path) -> dict[str, str]:
    """A sentence on what each effect costs and changes, by its name. Not collective.

    Parameters
    ----------
    folder : of `catenary plan CASE --cost -o FOLDER`

    Raises
    ------
    InputError
        If there is no such study, if it is of another case or of other effects.
    """
    path = folder / effect_cost.RECORD
    rows = _rows_of(path, "catenary plan --cost", scene.scene)
    on = {effect.name for effect in active(scene.problem)}
    found = {}
    for row in rows:
        name = row["effect"]
        if name and (row["simulated"] == effect_cost.LEFT_OUT) != (name in on):
            there, here = ("without", "with") if name in on else ("with", "without")
            raise InputError(f"{path} is a study {there} the effect {name}, the run is one {here}")
        if name:
            found[name] = row["advice"]
    return found


def _rows_of(path: Path, verb: str, scene: Scene) -> list[dict[str, Any]]:
    """The rows of the record of a study of a scene's case, and of no other scene if it has one."""
    record = read_study(path, verb)
    try:
        rows, case = list(record["rows"]), record["case"]
    except (KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `{verb}`: it has no rows of a case") from error
    if case != scene.case.name:
        raise InputError(f"{path} is a study of {case}, the run is one of {scene.case.name}")
    if record.get("scene"):
        for key, there, here in differences(record["scene"], physics_of(scene)):
            raise InputError(
                f"{path} is a study with {key} = {shown(there)}, the run is one with {shown(here)}"
            )
    return rows
