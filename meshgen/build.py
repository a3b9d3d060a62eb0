"""The mesh of a line, made or given."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.geometry import divide, divisions_of, find_cuts
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh, assemble

# A user's mesh may differ from the scene by this much along the track [m].
_FIT = 0.01


def make_mesh(
    line: Line,
    elements_per_gap: int,
    path: Path | None = None,
    *,
    support_refinement: int = 1,
    grading: float = 1.0,
) -> LineMesh:
    """Mesh ``line``, in a file with Gmsh. Not collective: call it on one rank.

    Without a file the wires are divided in the same way, to Gmsh's accuracy of some nanometres.

    Parameters
    ----------
    line : Line
        Line to be meshed.
    elements_per_gap : int
        Elements between neighbouring cuts (masts, droppers) of a wire.
    path : Path, optional
        Path of the mesh file to be kept; None to keep none.
    support_refinement : int, optional
        Factor on the number of elements in the gaps next to a mast.
    grading : float, optional
        How many times longer elements are amid a gap than at its cuts.

    Raises
    ------
    InputError
        As ``catenary.meshgen.gmsh_lines.write_mesh``.
    """
    if path is not None:
        # Gmsh and meshio take long to import.
        from catenary.meshgen.gmsh_lines import write_mesh
        from catenary.meshgen.reader import read_mesh

        write_mesh(
            line, elements_per_gap, path, support_refinement=support_refinement, grading=grading
        )
        return read_mesh(path, line)
    cuts = find_cuts(line)
    divisions = divisions_of(cuts, elements_per_gap, support_refinement)
    return assemble(divide(line, cuts, divisions, grading), line, "the line")


def use_mesh(line: Line, path: Path) -> LineMesh:
    """A user's own mesh for ``line``, checked against it. Not collective: call it on one rank.

    The line gives wires, stiffnesses and the wanted profile, the mesh where the nodes are: ends,
    masts and droppers must be at the same places along the track, within 10 mm.

    Raises
    ------
    InputError
        If the file is refused by ``catenary.meshgen.reader.read_mesh`` or belongs to another line.
    """
    from catenary.meshgen.reader import read_mesh

    mesh = read_mesh(path, line)
    for what, found, wanted in _places(line, mesh):
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


def _places(line: Line, mesh: LineMesh) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Hardware along the track: its name, places in the mesh and in the line [m]."""
    for wire in line.wires:
        pairs = mesh.elements(wire.name)
        starts = np.setdiff1d(pairs[:, 0], pairs[:, 1])
        ends = np.setdiff1d(pairs[:, 1], pairs[:, 0])
        wanted = [x for piece in wire.pieces for x in (piece.x[0], piece.x[-1])]
        found = np.sort(mesh.x(np.concatenate([starts, ends])))
        yield f"ends of {wire.name}", found, np.array(wanted)
    first = 0
    for clamps in line.clamps:
        pairs = mesh.clamps[first : first + len(clamps.x)]
        first += len(clamps.x)
        for side in (0, 1):
            yield clamps.name, mesh.x(pairs[:, side]), np.array(clamps.x)
    for number, supports in enumerate(line.supports):
        nodes = mesh.supports[mesh.support_group == number]
        yield supports.name, mesh.x(nodes), np.array(supports.x)
    for number, arms in enumerate(line.steady_arms):
        nodes = mesh.steady_arms[mesh.arm_group == number]
        yield arms.name, mesh.x(nodes), np.array(arms.x)
    for number, droppers in enumerate(line.droppers):
        pairs = mesh.droppers[mesh.dropper_group == number]
        yield droppers.name, mesh.x(pairs[:, 1]), np.array(droppers.lower_x)
