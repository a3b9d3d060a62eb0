"""Cuts of the wires of a line, and their division between cuts, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import ANCHORS, Groups
from catenary.meshgen.wires import SAME_PLACE, End


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
