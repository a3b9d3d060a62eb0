"""What is said of a scene that is sound: its line is hung, and nothing is simulated."""

from __future__ import annotations

from typing import NamedTuple

from catenary.cases.run.at_rest.installed import registration_of
from catenary.cases.run.describe.arrivals import arrival_facts
from catenary.cases.run.describe.pantographs import kind_lines
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.postproc.evaluate.wording import counted
from catenary.solver.statics.line_at_rest import stable_form
from catenary.solver.statics.stability_of_rest import refuse_lost_wire


class Checked(NamedTuple):
    """What a check found: sentences on line, pantographs and waves, and warnings."""

    sentences: list[str]
    warnings: list[str]


def check_line(scene: Scene) -> Checked:
    """Mesh and hang the line of a scene. Not collective.

    Raises
    ------
    InputError
        If the line is impossible: a dropper slack at rest, a wire that droppers cannot hold.
    """
    problem = problem_of(scene)
    mesh = mesh_of(scene)
    model, form = stable_form(problem, mesh)
    refuse_lost_wire(model, form)
    waves = arrival_facts(scene, problem)
    arms = registration_of(mesh, form)
    sentences = [
        f"{scene.case.name} is valid: {counted(problem.line.n_spans, 'span')}, "
        f"{problem.line.support_positions[-1]:g} m, {counted(mesh.droppers.shape[0], 'dropper')}, "
        f"{mesh.n_nodes} nodes",
        *(
            f"pantograph {name}, " + "\n  ".join(lines)
            for name, lines in kind_lines(scene, problem).items()
        ),
        f"ends: {'; '.join(waves['ends'])}",
        *(fact["says"] for fact in waves["pantographs"]),
    ]
    return Checked(sentences, [*waves["warnings"], *([] if arms is None else arms.warnings())])
