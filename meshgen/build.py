"""The mesh of a line, made or given."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from catenary.meshgen.gmsh_lines import write_mesh
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.reader import read_mesh
from catenary.solver.base.errors import InputError

# A user's mesh may differ from the scene by this much along the track [m].
_FIT = 0.01


def make_mesh(
    line: Line, elements_per_gap: int, path: Path | None = None, *, support_refinement: int = 1
) -> LineMesh:
    """Mesh ``line`` with Gmsh. Not collective: call it on one rank.

    Parameters
    ----------
    line : Line
    elements_per_gap : elements between neighbouring cuts (masts, droppers) of a wire
    path : where the mesh file is to stay; None for a temporary file
    support_refinement : factor on the number of elements in the gaps next to a mast

    Raises
    ------
    InputError
        As ``catenary.meshgen.gmsh_lines.write_mesh``.
    """
    if path is not None:
        write_mesh(line, elements_per_gap, path, support_refinement=support_refinement)
        return read_mesh(path)
    with tempfile.TemporaryDirectory(prefix="catenary-") as folder:
        temporary = Path(folder, "line.msh")
        write_mesh(line, elements_per_gap, temporary, support_refinement=support_refinement)
        return read_mesh(temporary)


def use_mesh(line: Line, path: Path) -> LineMesh:
    """A user's own mesh for ``line``, checked against it. Not collective: call it on one rank.

    The line gives wires, stiffnesses and the wanted profile, the mesh where the nodes are: ends,
    masts and droppers must be at the same places along the track, within 10 mm.

    Raises
    ------
    InputError
        If the file is refused by ``catenary.meshgen.reader.read_mesh`` or belongs to another line.
    """
    mesh = read_mesh(path)
    masts = line.support_positions
    droppers = [
        start + np.asarray(places, dtype=float)
        for start, places in zip(masts[:-1], line.dropper_positions, strict=True)
    ]
    contact_wire, messenger_wire = mesh.wires[CONTACT_WIRE], mesh.wires[MESSENGER_WIRE]
    for what, found, wanted in (
        ("ends of contact_wire", mesh.x(contact_wire[[0, -1]]), masts[[0, -1]]),
        ("ends of messenger_wire", mesh.x(messenger_wire[[0, -1]]), masts[[0, -1]]),
        ("supports", mesh.x(mesh.supports), masts[1:-1]),
        ("steady_arms", mesh.x(mesh.steady_arms), masts[1:-1]),
        ("droppers", mesh.x(mesh.droppers[:, 1]), np.concatenate(droppers)),
    ):
        if found.size != wanted.size:
            raise InputError(
                f"{path}: the mesh has {found.size} {what}, but the scene's line has {wanted.size}"
            )
        apart = np.abs(found - wanted)
        if apart.size and apart.max() > _FIT:
            worst = int(np.argmax(apart))
            raise InputError(
                f"{path}: the {what} of the mesh do not fit the scene's line: x = "
                f"{found[worst]:g} m in the mesh, {wanted[worst]:g} m in the scene"
            )
    return mesh
