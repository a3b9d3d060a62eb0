"""Wires divided evenly between their cuts, as arrays: what Gmsh makes of them, without a file."""

from __future__ import annotations

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.chains import Groups
from catenary.meshgen.geometry import Cuts
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import ANCHORS


def check_counts(elements_per_gap: int, support_refinement: int) -> None:
    """Raise InputError unless both counts are whole numbers of at least 1."""
    for key, count in (
        ("elements_per_gap", elements_per_gap),
        ("support_refinement", support_refinement),
    ):
        if count < 1:
            raise InputError(f"{key} is {count}, but must be a whole number of at least 1")


def divisions_of(cuts: Cuts, elements_per_gap: int, support_refinement: int) -> np.ndarray:
    """Elements between neighbouring cuts (n - 1,)."""
    near_mast = cuts.is_mast[:-1] | cuts.is_mast[1:]
    return elements_per_gap * np.where(near_mast, support_refinement, 1)


def divide(line: Line, cuts: Cuts, divisions: np.ndarray) -> Groups:
    """Nodes and elements of all wires, droppers and hardware of a line. Not collective.

    Parameters
    ----------
    divisions : elements between neighbouring cuts, see ``divisions_of``
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
        points = _between(piece.points, counts)
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


def _between(points: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Points (m, 3) that divide the straight lines between ``points`` (n, 3) evenly."""
    gap = np.repeat(np.arange(counts.size), counts)
    step = np.arange(gap.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (step / counts[gap])[:, None]
    inside = points[gap] + share * (points[gap + 1] - points[gap])
    return np.concatenate([inside, points[-1:]])
