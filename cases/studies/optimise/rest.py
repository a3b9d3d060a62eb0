"""Forces of droppers at rest, which an optimum must keep in tension."""

from __future__ import annotations

import numpy as np

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.solver.statics.line_at_rest import stable_form


def least_forces(scene: Scene) -> np.ndarray:
    """The least force at rest of the first, second, ... droppers of all spans [N].

    Forces are linear in pre-sag, so that a search which knows their slopes takes no step to a line
    that cannot hang. Not collective.

    Raises
    ------
    InputError
        If the line cannot hang.
    """
    problem, mesh = problem_of(scene), mesh_of(scene)
    form = stable_form(problem, mesh)[1]
    x, masts = mesh.x(mesh.droppers[:, 1]), problem.line.support_positions
    order = np.argsort(x, kind="stable")
    span = np.searchsorted(masts, x[order], side="right")
    first = np.searchsorted(span, span)  # where the droppers of each one's span begin
    number = np.arange(span.size) - first
    found = np.full(int(number.max(initial=-1)) + 1, np.inf)
    np.minimum.at(found, number, form.dropper_force[order])
    return found
