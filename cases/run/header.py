"""Header of a result file: facts of its run that are known before the first step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from catenary.cases.process.libraries import versions
from catenary.cases.run.arrivals import arrival_facts
from catenary.cases.run.description import defect_facts, header_words, incident_facts
from catenary.cases.run.plan import effect_rows
from catenary.cases.scene.run.case import rule_entries
from catenary.cases.scene.scene import Scene, resolved
from catenary.postproc.files.facts import facts_of
from catenary.postproc.files.header import Header, line_datasets, static_datasets, wire_roles
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import lengths_to_cut
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.window.choice import window_sentence

if TYPE_CHECKING:
    from catenary.cases.run.excited_run import ExcitedRun


def scene_attributes(scene: Scene, problem: Problem) -> dict[str, Any]:
    """Attributes that follow from a scene and its problem alone. Not collective."""
    on, off = effect_rows(scene, problem)
    return {
        "case": scene.case.name,
        "title": scene.case.title,
        "system": scene.evaluation.system,
        "rules": rule_entries(scene.evaluation),
        "limits": scene.evaluation.own_limits,
        "defects": defect_facts(scene, problem),
        "effects_on": [tuple(row) for row in on],
        "effects_off": [tuple(row) for row in off],
    }


def train_attributes(scene: Scene, problem: Problem) -> dict[str, Any]:
    """Attributes of a line that a train excites. Not collective."""
    return {"pantographs": header_words(scene, problem), "arrivals": arrival_facts(scene, problem)}


def header_of(
    scene: Scene,
    problem: Problem,
    at_rest: LineAtRest,
    petsc_options: Sequence[str],
    excited: ExcitedRun | None = None,
    with_lengths: bool = True,
) -> Header:
    """Header of the result file of a run. Not collective.

    Parameters
    ----------
    problem : of the scene
    at_rest : its line in equilibrium
    petsc_options : the options that PETSc was started with, for the record
    excited : excitation that sets the line into motion in place of the scene's train
    with_lengths : whether the lengths to which droppers are cut belong to it, a form finding
    """
    line, cut = problem.line, {}
    if with_lengths:
        cut = {"static/dropper_length": lengths_to_cut(problem, at_rest.mesh)}
    return Header(
        attributes={
            **scene_attributes(scene, problem),
            **(train_attributes(scene, problem) if excited is None else excited.attributes()),
            "n_dofs": at_rest.model.n_unknowns,
            "incidents": incident_facts(scene, problem),
            "window": window_sentence(problem),
            "versions": versions(),
            "config": resolved(scene),
            "wires": wire_roles(line),
            "petsc_options": list(petsc_options),
        },
        datasets={
            **line_datasets(line, at_rest.mesh, problem.evaluation),
            **cut,
            **static_datasets(at_rest.problem.line, at_rest.mesh, at_rest.form, at_rest.lift),
        },
        # Of the wires as they hang, worn and with wrong tensions.
        facts=facts_of(
            replace(problem, line=at_rest.problem.line), at_rest.mesh, at_rest.model.dropper_lengths
        ),
    )
