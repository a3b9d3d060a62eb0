"""The mesh of a scene: made from its line, or the user's own. Gmsh runs in here."""

from __future__ import annotations

import logging
from pathlib import Path

from catenary.cases.result_folder.output_files import new_file
from catenary.cases.scene.checks.mesh_size import MANY_NODES, size_of
from catenary.cases.scene.convert.line import line_of
from catenary.cases.scene.scene import Scene
from catenary.meshgen.build import make_mesh, use_mesh
from catenary.meshgen.mesh import LineMesh
from catenary.solver.base.errors import InputError


def mesh_of(scene: Scene, path: Path | None = None) -> LineMesh:
    """The mesh of a scene. Not collective: call it on one rank.

    ``path`` is where the mesh file is to stay; None for none.

    Raises
    ------
    InputError
        If the user's mesh is refused.
    """
    line, own = line_of(scene), scene.mesh_file()
    if own is not None:
        return use_mesh(line, own)
    size = size_of(scene)
    if size is not None and size.nodes > MANY_NODES:
        logging.getLogger("catenary.mesh").warning("%s", size.sentence())
    return make_mesh(
        line,
        scene.mesh.elements_per_gap,
        path,
        support_refinement=scene.mesh.support_refinement,
    )


def write_mesh_of(scene: Scene, path: Path, force: bool) -> LineMesh:
    """Write the mesh of a scene's line to a new file and return it. Not collective.

    Raises
    ------
    InputError
        If the scene brings its own mesh or the file cannot or must not be written.
    """
    if scene.mesh_file() is not None:
        raise InputError(
            f"mesh.file {scene.origin.of('mesh.file')} names a mesh already; there is none to make"
        )
    new_file(path, (".msh",), force)
    return mesh_of(scene, path)
