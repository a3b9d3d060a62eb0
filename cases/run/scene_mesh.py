"""The mesh of a scene: made from its line, or the user's own. Gmsh runs in here."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.result_folder.output_folder import new_file
from catenary.cases.scene.checks.mesh_size import MANY_NODES, size_of
from catenary.cases.scene.line.line_data import overlaps_of
from catenary.cases.scene.scene import Scene, line_of, problem_of
from catenary.meshgen.build import make_mesh, use_mesh
from catenary.meshgen.mesh import LineMesh

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catenary.solver.model.rest_shape import Equilibrium
    from catenary.solver.problem.problem import Problem

# Suffixes of drawings.
DRAWN = (".png", ".svg")


def mesh_of(scene: Scene, path: Path | None = None) -> LineMesh:
    """The mesh of a scene. Not collective: call it on one rank.

    ``path`` is where the mesh file is to stay; None for none.

    Raises
    ------
    InputError
        If the user's mesh is refused.
    """
    line, own = line_of(scene), scene.mesh.file
    if own is not None:
        return use_mesh(line, Path(own))
    size = size_of(scene)
    if size is not None and size.nodes > MANY_NODES:
        logging.getLogger("catenary.mesh").warning("%s", size.sentence())
    return make_mesh(
        line,
        scene.mesh.elements_per_gap,
        path,
        support_refinement=scene.mesh.support_refinement,
        grading=scene.mesh.grading,
    )


def write_mesh_of(scene: Scene, path: Path, force: bool) -> LineMesh:
    """Write the mesh of a scene's line to a new file and return it. Not collective.

    Raises
    ------
    InputError
        If the scene brings its own mesh or the file cannot or must not be written.
    """
    if scene.mesh.file is not None:
        raise InputError(
            f"mesh.file {scene.origin.of('mesh.file')} names a mesh already; there is none to make"
        )
    new_file(path, (".msh", *DRAWN), force)
    return mesh_of(scene, path)


def draw_scene(scene: Scene, path: Path, force: bool) -> tuple[float, float]:
    """Draw a scene's line at rest into a new file. Not collective.

    ``path`` is replaced only with ``force``. Returns start and end of the drawn stretch [m], three
    spans in the middle of the evaluated stretch, or the first overlap with a span on either side.

    Raises
    ------
    InputError
        If the file must not be written, or the line has no equilibrium.
    RunBroken
        If the disk refuses.
    """
    new_file(path, DRAWN, force)
    from catenary.postproc.files.disk import write_into
    from catenary.postproc.report.pictures.figures import file_of
    from catenary.solver.statics.form_finding import find_form

    problem, mesh = problem_of(scene), mesh_of(scene)
    figure, stretch = line_figure(scene, problem, mesh, find_form(problem, mesh)[1])
    write_into(path.parent, {path.name: file_of(figure, path.name)})
    return stretch


def line_figure(
    scene: Scene, problem: Problem, mesh: LineMesh, form: Equilibrium
) -> tuple[Figure, tuple[float, float]]:
    """Drawing of a scene's line at rest, and the start and the end of the drawn stretch [m].

    Parameters
    ----------
    problem, mesh, form : of the scene, and of its line at rest
    """
    # Matplotlib takes long to import.
    from catenary.cases.run.description import defect_facts
    from catenary.postproc.report.pictures.line_drawing import Mark, draw_line

    line, masts = problem.line, problem.line.support_positions
    overlaps = overlaps_of(scene.line)
    if overlaps is not None:
        spans = overlaps.first[0] - 1, overlaps.first[0] + overlaps.n_spans + 1
    else:
        first, last = line.n_transition[0], line.n_spans - line.n_transition[1]
        judged = np.searchsorted(masts, 0.5 * sum(problem.evaluation), side="right") - 1
        middle = int(np.clip(judged, first, last - 1))
        spans = max(middle - 1, 0), min(middle + 2, line.n_spans)
    stretch = float(masts[spans[0]]), float(masts[spans[1]])
    marks = [
        Mark(fact["at_m"], fact["wire"], fact["says"])
        for fact in defect_facts(scene, problem)
        if "at_m" in fact
    ]
    return draw_line(line, mesh, form, stretch, half_head_of(scene), marks), stretch


def half_head_of(scene: Scene) -> float | None:
    """Half of the shortest strip on the train [m], None where no length is known."""
    lengths = [scene.pantographs[place.name].strips.length_m for place in scene.train.pantographs]
    return min((0.5 * length for length in lengths if length is not None), default=None)
