"""A line as Gmsh points and lines with physical groups. The only file that imports gmsh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gmsh
import numpy as np

from catenary.base.errors import CatenaryError, InputError, RunBroken
from catenary.base.files import appears_whole
from catenary.base.process import python_signals_kept
from catenary.meshgen.geometry import Cuts, divisions_of, find_cuts
from catenary.meshgen.line import Droppers, Line
from catenary.meshgen.mesh import ANCHORS

# The last line of a mesh file.
_END = b"$EndElements\n"


def write_mesh(
    line: Line,
    elements_per_gap: int,
    path: Path,
    *,
    support_refinement: int = 1,
    grading: float = 1.0,
) -> None:
    """Write the mesh of ``line`` to ``path``, a Gmsh file (MSH 2.2, ASCII).

    Not collective: call it on one rank. All wires are cut at every mast, dropper and end of a wire
    and divided in between; a dropper is one element. Heights are wanted or estimated ones;
    form finding corrects them.

    Parameters
    ----------
    line : Line
        Line to be meshed.
    elements_per_gap : int
        Elements between neighbouring cuts of a wire.
    path : Path
        File to write, its name ends in ``.msh``.
    support_refinement : int, optional
        Factor on the number of elements in the gaps next to a mast.
    grading : float, optional
        How many times longer elements are amid a gap than at its cuts; 1 divides evenly.

    Raises
    ------
    InputError
        If the file cannot be written, or the line is impossible
        (see ``catenary.meshgen.geometry.find_cuts``).
    RunBroken
        If the disk is full; an earlier file is as it was.
    """
    if path.suffix != ".msh":
        raise InputError(f"the mesh file {path} must have a name that ends in .msh")
    cuts = find_cuts(line)
    with _session(path.stem):
        _describe(line, cuts, divisions_of(cuts, elements_per_gap, support_refinement), grading)
        gmsh.model.mesh.generate(1)
        # meshio reads 2.2 ten times faster than 4.1 when there is a curve for each gap.
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        _write_whole(path)


def _write_whole(path: Path) -> None:
    """Write the present mesh so that an earlier file stays until the new one is whole."""
    try:
        with appears_whole(path, ".msh") as part:
            gmsh.write(str(part))
            # On a full disk Gmsh ends in the middle of the file and says nothing.
            with part.open("rb") as file:
                file.seek(max(0, part.stat().st_size - len(_END)))
                if file.read().strip() != _END.strip():
                    raise RunBroken(
                        f"the mesh file {path} cannot be written to its end: free some space or "
                        "choose another file"
                    )
    except CatenaryError:
        raise
    except Exception as error:  # gmsh raises nothing more particular
        raise InputError(f"the mesh file {path} cannot be written: {error}") from error


@contextmanager
def _session(name: str) -> Iterator[None]:
    """A quiet Gmsh with one empty model, closed in any case.

    A session that the caller has open already stays open.
    """
    borrowed = bool(gmsh.isInitialized())
    if not borrowed:
        # No settings of the user's own: the mesh depends on the scene only. SIGINT stays Python's.
        with python_signals_kept():
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add(name)
    try:
        yield
    finally:
        gmsh.model.remove()
        if not borrowed:
            with python_signals_kept():
                gmsh.finalize()


def _describe(line: Line, cuts: Cuts, divisions: np.ndarray, grading: float) -> None:
    """Geometry, divisions and physical groups in the current model."""
    points = {wire.name: np.zeros(cuts.x.size, dtype=np.int64) for wire in line.wires}
    curves: dict[str, list[int]] = {wire.name: [] for wire in line.wires}
    ends: list[int] = []
    # From the topmost wire down, which is the order of the tags.
    for piece in reversed(cuts.pieces):
        last = piece.first + len(piece.points) - 1
        tags, between = _add_wire(piece.points, divisions[piece.first : last], grading)
        points[piece.wire][piece.first : last + 1] = tags
        curves[piece.wire] += between
        ends += [tags[end] for end, held in zip((0, -1), piece.ends, strict=True) if held]
    droppers = {group.name: _add_droppers(group, points, cuts) for group in line.droppers}
    gmsh.model.geo.synchronize()

    groups: list[tuple[int, str, list[int]]] = [
        *((1, wire.name, curves[wire.name]) for wire in reversed(line.wires)),
        *((1, group.name, droppers[group.name]) for group in line.droppers),
        *(
            (0, group.name, points[group.wire][cuts.of(np.array(group.x))].tolist())
            for group in line.hardware
        ),
        (0, ANCHORS, ends),
    ]
    for number, (dimension, name, tags) in enumerate(groups, start=1):
        if tags:
            gmsh.model.addPhysicalGroup(dimension, tags, number)
        # A group without members is named as well: readers refuse a mesh without the name.
        gmsh.model.setPhysicalName(dimension, number, name)


def _add_droppers(group: Droppers, points: dict[str, np.ndarray], cuts: Cuts) -> list[int]:
    """Tags of the lines of a group of droppers, one element each."""
    upper = points[group.upper][cuts.of(np.array(group.upper_x))].tolist()
    lower = points[group.lower][cuts.of(np.array(group.lower_x))].tolist()
    curves = [gmsh.model.geo.addLine(*pair) for pair in zip(upper, lower, strict=True)]
    for curve in curves:
        gmsh.model.geo.mesh.setTransfiniteCurve(curve, 2)
    return curves


def _add_wire(
    points: np.ndarray, divisions: np.ndarray, grading: float
) -> tuple[list[int], list[int]]:
    """Tags of the points and of the straight lines between them, divided."""
    geo = gmsh.model.geo
    tags = [geo.addPoint(*point) for point in points.tolist()]
    curves = [geo.addLine(left, right) for left, right in zip(tags[:-1], tags[1:], strict=True)]
    law = ("Bump", 1.0 / grading) if grading > 1.0 else ()
    for curve, count in zip(curves, divisions.tolist(), strict=True):
        geo.mesh.setTransfiniteCurve(curve, count + 1, *law)
    return tags, curves
