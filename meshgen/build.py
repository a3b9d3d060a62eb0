"""The mesh of a line: its wires are cut and divided between cuts, or a user's own mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import ANCHORS, Groups, LineMesh, assemble
from catenary.meshgen.wires import SAME_PLACE, End

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


@dataclass(frozen=True)
class PieceCuts:
    """A piece of wire as cut.

    Attributes
    ----------
    wire : name
    first : number of its first cut; it is cut at all that follow, up to its last one
    points : (n, 3) points before form finding [m]
    ends : (2,) bool, whether its first and its last point are held
    """

    wire: str
    first: int
    points: np.ndarray
    ends: tuple[bool, bool]


@dataclass(frozen=True)
class Cuts:
    """Every place at which the wires are cut, in order of x.

    Attributes
    ----------
    x : (n,) [m]
    is_mast : (n,) bool, whether a mast stands there, both anchors included
    pieces : of all wires, in the order of the line's wires
    """

    x: np.ndarray
    is_mast: np.ndarray
    pieces: tuple[PieceCuts, ...] = ()

    def of(self, x: np.ndarray) -> np.ndarray:
        """Numbers of the cuts at positions ``x`` (n,) [m]."""
        return np.searchsorted(self.x, np.asarray(x, dtype=float) - SAME_PLACE)


def find_cuts(line: Line) -> Cuts:
    """Masts, ends of wires and of droppers, with all wires cut at each of them. Not collective.

    Wires that are cut at the same places have their nodes beside each other: the matrices then
    join stations along the track to their neighbours only.
    """
    ends = [x for wire in line.wires for piece in wire.pieces for x in (piece.x[0], piece.x[-1])]
    hanging = [x for group in line.droppers for x in (group.upper_x, group.lower_x)]
    placed = [group.x for group in (*line.hardware, *line.clamps)]
    cuts = cuts_at(line.support_positions, ends, *hanging, *placed)
    x, pieces = cuts.x, []
    for wire in line.wires:
        for piece in wire.pieces:
            first, last = np.searchsorted(x, np.array([piece.x[0], piece.x[-1]]) - SAME_PLACE)
            points = wire.points(x[first : last + 1])
            held = piece.ends[0] is End.HELD, piece.ends[1] is End.HELD
            pieces.append(PieceCuts(wire.name, int(first), points, held))
    return replace(cuts, pieces=tuple(pieces))


def cuts_at(masts: np.ndarray, *places: Sequence[float]) -> Cuts:
    """Cuts at masts (n,) and other places, each once, without pieces of wires [m]."""
    x = np.concatenate([masts, *places])
    # Sorting is stable: of places that are one, a mast stays.
    x = x[np.argsort(x, kind="stable")]
    x = x[np.diff(x, prepend=-np.inf) > SAME_PLACE]
    is_mast = np.zeros(x.size, dtype=bool)
    is_mast[np.searchsorted(x, masts - SAME_PLACE)] = True
    return Cuts(x, is_mast)


def divisions_of(cuts: Cuts, elements_per_gap: int, support_refinement: int) -> np.ndarray:
    """Elements (n - 1,) between neighbouring ones of n cuts.

    ``elements_per_gap`` is their number, times ``support_refinement`` in the gaps next to a mast.
    """
    near_mast = cuts.is_mast[:-1] | cuts.is_mast[1:]
    return elements_per_gap * np.where(near_mast, support_refinement, 1)


def divide(line: Line, cuts: Cuts, divisions: np.ndarray, grading: float = 1.0) -> Groups:
    """Nodes and elements of all wires, droppers and hardware of a line. Not collective.

    Parameters
    ----------
    line : Line
        The line.
    cuts : Cuts
        Places at which each wire is cut.
    divisions : ndarray
        Elements between neighbouring cuts, see ``divisions_of``.
    grading : float
        How many times longer elements are amid a gap than at its cuts, at least 1.
    """
    parts: list[np.ndarray] = []
    elements: dict[str, list[np.ndarray]] = {wire.name: [] for wire in line.wires}
    at_cut = {wire.name: np.full(cuts.x.size, -1, dtype=np.int64) for wire in line.wires}
    ends: list[int] = []
    n = 0
    # From the topmost wire down, as in a file.
    for piece in reversed(cuts.pieces):
        last = piece.first + len(piece.points) - 1
        counts = divisions[piece.first : last]
        points = _between(piece.points, counts, grading)
        nodes = n + np.concatenate([[0], np.cumsum(counts)])
        at_cut[piece.wire][piece.first : last + 1] = nodes
        numbers = n + np.arange(len(points))
        elements[piece.wire].append(np.stack([numbers[:-1], numbers[1:]], axis=1))
        ends += [int(nodes[end]) for end, held in zip((0, -1), piece.ends, strict=True) if held]
        parts.append(points)
        n += len(points)
    lines = {name: np.concatenate(pairs) for name, pairs in elements.items()}
    for group in line.droppers:
        upper = at_cut[group.upper][cuts.of(np.array(group.upper_x))]
        lower = at_cut[group.lower][cuts.of(np.array(group.lower_x))]
        lines[group.name] = np.stack([upper, lower], axis=1)
    nodes_of = {
        group.name: at_cut[group.wire][cuts.of(np.array(group.x))] for group in line.hardware
    }
    nodes_of[ANCHORS] = np.array(ends, dtype=np.int64)
    return Groups(np.concatenate(parts), lines, nodes_of)


def _between(points: np.ndarray, counts: np.ndarray, grading: float) -> np.ndarray:
    """Points (m, 3) that divide the straight lines between ``points`` (n, 3).

    Graded ones lie by a hyperbolic tangent, shortest at both ends, as Gmsh's law ``Bump`` has it.
    """
    gap = np.repeat(np.arange(counts.size), counts)
    step = np.arange(gap.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = step / counts[gap]
    if grading > 1.0:
        steepness = np.arccosh(np.sqrt(grading))
        share = 0.5 + 0.5 * np.tanh(steepness * (2.0 * share - 1.0)) / np.tanh(steepness)
    inside = points[gap] + share[:, None] * (points[gap + 1] - points[gap])
    return np.concatenate([inside, points[-1:]])
