"""The line at rest as tables, without a run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from catenary.cases.run.at_rest.installed import installed
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.cases.terminal.terminal_text import static_text
from catenary.postproc.channels.header import line_datasets, static_datasets
from catenary.solver.statics.form_finding.equilibrium import lengths_to_cut
from catenary.solver.statics.line_at_rest import line_at_rest


def static_table(scene: Scene) -> dict[str, np.ndarray]:
    """The line at rest, arrays named as in the result file's groups, and what `installed` adds.

    Not collective.
    """
    problem = problem_of(scene)
    mesh = mesh_of(scene)
    rest = line_at_rest(problem, mesh)
    data = {
        **line_datasets(problem.line, mesh, problem.evaluation),
        **static_datasets(problem.line, mesh, rest.form, rest.lift, lengths_to_cut(problem, mesh)),
        "line/dropper_x": mesh.x(mesh.droppers[:, 1]),
        "line/arm_x": mesh.x(mesh.steady_arms),
        **installed(problem.line, mesh, rest.form.height),
    }
    return {name.split("/", 1)[1]: values for name, values in data.items()}


def rest_text(scene: Scene, table: Mapping[str, np.ndarray]) -> str:
    """The same for people: dropper table, registration, sag and elasticity. Not collective."""
    lengths = [scene.pantographs[place.name].strips.length_m for place in scene.train.pantographs]
    half_heads = [0.5 * length for length in lengths if length is not None]
    return static_text(table, problem_of(scene).line, min(half_heads, default=None))
