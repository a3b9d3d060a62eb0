"""A Gmsh mesh file, ours or a user's own, as a line mesh. The only file that imports meshio."""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from pathlib import Path

import meshio
import numpy as np

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import ANCHORS, Groups, LineMesh, assemble

# A mesh of four million nodes takes half of it.
MOST_BYTES = 500_000_000
_HEAD = 65536  # [B], comments may stand first
_SHOWN, _SOME = 60, 12  # of the names of groups that a file has
_KINDS = {0: "points", 1: "lines", 2: "surfaces", 3: "volumes"}


def read_mesh(path: Path, line: Line) -> LineMesh:
    """The line mesh of a ``.msh`` file (MSH 2.2 or 4.1), checked. Not collective: one rank reads.

    Numbering and orientation of nodes and elements in the file do not matter; a dropper may
    consist of several elements, of which only the ends are kept. Nodes that nothing uses are left
    out, the others are numbered along the track, the upper wires' first at equal x.

    Parameters
    ----------
    path : Path
        File with a physical group for each wire and group of the line, by its name: lines for
        wires and droppers, points for hardware and ``anchors``. Droppers, arms and supports may
        have no members, but must be named.
    line : Line
        The line.

    Raises
    ------
    InputError
        If the file cannot be read, a group is missing, or the groups do not make a line:
        one sentence with the file's name and the place.
    """
    content = _load(path)
    wires = [wire.name for wire in line.wires]
    full = (*wires, ANCHORS)
    groups = (
        (*(own.name for own in line.hardware), ANCHORS),
        (*wires, *(own.name for own in line.droppers)),
    )
    nodes, lines = (
        {name: _members(content, name, dimension, path, name not in full) for name in wanted}
        for dimension, wanted in enumerate(groups)
    )
    points = np.ascontiguousarray(content.points, dtype=float)
    if points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError(f"{path}: the nodes must have three finite coordinates each")
    return assemble(Groups(points, lines, nodes), line, str(path))


def _load(path: Path) -> meshio.Mesh:
    if not is_file(path):
        raise InputError(f"the mesh file {path} does not exist")
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise InputError(f"the mesh file {path} has {size} bytes; at most {MOST_BYTES} are allowed")
    refused = f"{path} cannot be read as a Gmsh mesh file"
    if b"$MeshFormat" not in _head(path, refused):
        raise InputError(f"{refused}: it does not begin with $MeshFormat")
    try:
        # meshio prints what it does not understand; what matters to us is checked below.
        with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
            warnings.simplefilter("ignore")
            return meshio.gmsh.read(path)
    except Exception as error:  # a damaged file ends in whatever meshio stumbles over
        if "Incompatible cell data" in str(error):
            raise InputError(
                f"{path}: some elements are in no physical group: save the mesh in Gmsh without "
                "the option to save all elements (Mesh.SaveAll = 0), or as MSH 2.2"
            ) from error
        # Its own words may repeat what the file holds, and a scene may name any file.
        raise InputError(f"{refused}: it is no MSH 2.2 or 4.1, or damaged") from error


def _head(path: Path, refused: str) -> bytes:
    """The beginning of a file; never waits, as files of the kernel may make one."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            return os.read(handle, _HEAD)
        finally:
            os.close(handle)
    except OSError as error:
        raise InputError(f"{refused}: {(error.strerror or '').lower()}") from error


def _members(
    content: meshio.Mesh, name: str, dimension: int, path: Path, may_be_empty: bool
) -> np.ndarray:
    """Elements of a physical group, shape (n, 2) for lines; node numbers, (n,), for points."""
    if name not in content.field_data:
        names_there = sorted(str(found)[:_SHOWN] for found in content.field_data)[:_SOME]
        present = ", ".join(names_there) or "none"
        raise InputError(
            f"{path}: the physical group {name} of {_KINDS[dimension]} is missing (present: "
            f"{present})"
        )
    number, found_dimension = (int(value) for value in content.field_data[name])
    if found_dimension != dimension:
        raise InputError(
            f"{path}: the physical group {name} holds {_KINDS[found_dimension]}, but must hold "
            f"{_KINDS[dimension]}"
        )
    blocks = [
        np.asarray(block.data[chosen], dtype=np.int64)
        for block, chosen in _blocks_of_group(content, name, number, dimension)
    ]
    width = dimension + 1
    if any(block.shape[1] != width for block in blocks):
        raise InputError(
            f"{path}: the physical group {name} has elements of higher order, but only lines of "
            "two nodes are understood (Mesh.ElementOrder = 1)"
        )
    found = np.concatenate([np.empty((0, width), dtype=np.int64), *blocks])
    if found.size == 0 and not may_be_empty:
        raise InputError(f"{path}: the physical group {name} has no members")
    if found.size and found.min() < 0:
        raise InputError(f"{path}: the physical group {name} uses a node that the file lacks")
    return found if dimension else np.unique(found)


def _blocks_of_group(
    content: meshio.Mesh, name: str, number: int, dimension: int
) -> list[tuple[meshio.CellBlock, np.ndarray]]:
    """Blocks of elements of that dimension with the rows that belong to the group."""
    physical = content.cell_data.get("gmsh:physical")
    # MSH 4.1 tells the groups of each curve, several perhaps; before, each element names one.
    sets = content.cell_sets.get(name)
    chosen = []
    for k, block in enumerate(content.cells):
        if block.dim != dimension:
            continue
        if sets is not None:
            rows = np.asarray(sets[k], dtype=np.int64)
        elif physical is not None:
            rows = np.flatnonzero(physical[k] == number)
        else:
            continue
        if rows.size:
            chosen.append((block, rows))
    return chosen
