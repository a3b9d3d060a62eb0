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
    """Mesh ``line``. Not collective: call it on one rank.

    All wires are cut at every mast, dropper and end of a wire and divided in between; a dropper is
    one element. Heights are wanted or estimated ones; form finding corrects them.

    Parameters
    ----------
    line : Line
        Line to be meshed.
    elements_per_gap : int
        Elements between neighbouring cuts (masts, droppers) of a wire.
    path : Path, optional
        File to which the mesh is written; None for none.
    support_refinement : int, optional
        Factor on the number of elements in the gaps next to a mast.
    grading : float, optional
        How many times longer elements are amid a gap than at its cuts; 1 divides evenly.

    Raises
    ------
    InputError, RunBroken
        As ``catenary.meshgen.mesh_file.write_mesh``.
    """
    cuts = find_cuts(line)
    groups = divide(line, cuts, divisions_of(cuts, elements_per_gap, support_refinement), grading)
    if path is not None:
        from catenary.meshgen.mesh_file import write_mesh  # meshio takes long to import

        write_mesh(groups, path)
    return assemble(groups, line, "the line")


def use_mesh(line: Line, path: Path) -> LineMesh:
    """A user's own mesh for ``line``, checked against it. Not collective: call it on one rank.

    The line gives wires, stiffnesses and the wanted profile, the mesh where the nodes are: ends,
    masts and droppers must be at the same places along the track, within 10 mm.

    Raises
    ------
    InputError
        If ``catenary.meshgen.mesh_file.read_mesh`` refuses the file, or it belongs to another line.
    """
    from catenary.meshgen.mesh_file import read_mesh

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
