"""Header of a result file: facts of its run that are known before the first step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from catenary.cases.process.versions import versions
from catenary.cases.run.describe.arrivals import arrival_facts
from catenary.cases.run.describe.defects import defect_facts, incident_facts
from catenary.cases.run.describe.pantographs import header_words
from catenary.cases.run.planning.plan import effect_rows
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.run.case import rule_entries
from catenary.cases.scene.scene import Scene
from catenary.postproc.channels.facts import facts_of
from catenary.postproc.channels.header import Header, line_datasets, static_datasets, wire_roles
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding.equilibrium import lengths_to_cut
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.window.choice import window_sentence

if TYPE_CHECKING:
    from catenary.cases.run.excited_run import ExcitedRun


def header_of(
    scene: Scene,
    problem: Problem,
    at_rest: LineAtRest,
    petsc_options: Sequence[str],
    excited: ExcitedRun | None = None,
) -> Header:
    """Header of the result file of a run. Not collective.

    Parameters
    ----------
    problem : of the scene
    at_rest : its line in equilibrium
    petsc_options : the options that PETSc was started with, for the record
    excited : excitation that sets the line into motion in place of the scene's train
    """
    on, off = effect_rows(scene, problem)
    line, lengths = problem.line, lengths_to_cut(problem, at_rest.mesh)
    if excited is not None:
        by_what = excited.attributes()
    else:
        words, arrivals = header_words(scene, problem), arrival_facts(scene, problem)
        by_what = {"pantographs": words, "arrivals": arrivals}
    return Header(
        attributes={
            "case": scene.case.name,
            "title": scene.case.title,
            "n_dofs": at_rest.model.n_unknowns,
            "system": scene.evaluation.system,
            "rules": rule_entries(scene.evaluation),
            "limits": scene.evaluation.own_limits,
            "defects": defect_facts(scene, problem),
            "incidents": incident_facts(scene, problem),
            **by_what,
            "window": window_sentence(problem),
            "versions": versions(),
            "config": resolved(scene),
            "wires": wire_roles(line),
            "petsc_options": list(petsc_options),
            "effects_on": [tuple(row) for row in on],
            "effects_off": [tuple(row) for row in off],
        },
        datasets={
            **line_datasets(line, at_rest.mesh, problem.evaluation),
            **static_datasets(line, at_rest.mesh, at_rest.form, at_rest.lift, lengths),
        },
        facts=facts_of(problem, at_rest.mesh, at_rest.model.dropper_lengths),
    )
