"""A line as Gmsh points and lines with physical groups. The only file that imports gmsh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gmsh
import numpy as np

from catenary.meshgen import mesh as names
from catenary.meshgen.geometry import Stations, find_stations
from catenary.meshgen.line import Line
from catenary.solver.base.errors import InputError
from catenary.solver.base.python_signals import python_signals_kept


def write_mesh(
    line: Line, elements_per_gap: int, path: Path, *, support_refinement: int = 1
) -> None:
    """Write the mesh of ``line`` to ``path``, a Gmsh file (MSH 2.2, ASCII).

    Not collective: call it on one rank. Both wires are cut at every mast and at every dropper and
    divided evenly in between; a dropper is one element. The heights are those wanted of the
    contact wire and estimated of the messenger wire; form finding corrects them.

    Parameters
    ----------
    line : Line
    elements_per_gap : elements between neighbouring cuts of a wire
    path : file to write, its name ends in ``.msh``
    support_refinement : factor on the number of elements in the gaps next to a mast

    Raises
    ------
    InputError
        If a count is below 1, the file cannot be written, or the line is impossible
        (see ``catenary.meshgen.geometry.find_stations``).
    """
    for key, count in (
        ("elements_per_gap", elements_per_gap),
        ("support_refinement", support_refinement),
    ):
        if count < 1:
            raise InputError(f"{key} is {count}, but must be a whole number of at least 1")
    if path.suffix != ".msh":
        raise InputError(f"the mesh file {path} must have a name that ends in .msh")
    stations = find_stations(line)
    with _session(path.stem):
        _describe(stations, elements_per_gap, support_refinement)
        gmsh.model.mesh.generate(1)
        # meshio reads 2.2 ten times faster than 4.1 when there is a curve for each gap.
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        try:
            gmsh.write(str(path))
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


def _describe(stations: Stations, elements_per_gap: int, support_refinement: int) -> None:
    """Geometry, divisions and physical groups in the current model."""
    is_mast = stations.is_mast
    near_mast = is_mast[:-1] | is_mast[1:]
    divisions = elements_per_gap * np.where(near_mast, support_refinement, 1)
    messenger_points, messenger_curves = _add_wire(stations.messenger_wire, divisions)
    contact_points, contact_curves = _add_wire(stations.contact_wire, divisions)
    at = np.flatnonzero(~is_mast)
    droppers = [gmsh.model.geo.addLine(messenger_points[i], contact_points[i]) for i in at]
    for curve in droppers:
        gmsh.model.geo.mesh.setTransfiniteCurve(curve, 2)
    gmsh.model.geo.synchronize()

    inner = np.flatnonzero(is_mast)[1:-1]
    ends = [messenger_points[0], messenger_points[-1], contact_points[0], contact_points[-1]]
    groups = (
        (1, names.MESSENGER_WIRE, messenger_curves),
        (1, names.CONTACT_WIRE, contact_curves),
        (1, names.DROPPERS, droppers),
        (0, names.STEADY_ARMS, [contact_points[i] for i in inner]),
        (0, names.SUPPORTS, [messenger_points[i] for i in inner]),
        (0, names.ANCHORS, ends),
    )
    for number, (dimension, name, tags) in enumerate(groups, start=1):
        if tags:
            gmsh.model.addPhysicalGroup(dimension, tags, number)
        # A group without members is named as well: its name tells a reader that none is meant.
        gmsh.model.setPhysicalName(dimension, number, name)


def _add_wire(points: np.ndarray, divisions: np.ndarray) -> tuple[list[int], list[int]]:
    """Tags of the points and of the straight lines between them, divided evenly."""
    geo = gmsh.model.geo
    tags = [geo.addPoint(*point) for point in points.tolist()]
    curves = [geo.addLine(left, right) for left, right in zip(tags[:-1], tags[1:], strict=True)]
    for curve, count in zip(curves, divisions.tolist(), strict=True):
        geo.mesh.setTransfiniteCurve(curve, count + 1)
    return tags, curves
