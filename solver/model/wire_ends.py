"""Ends of wires along the track, and their fixings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import End
from catenary.solver.model.model import Model
from catenary.solver.model.stations import SAME_STATION

# An end is at its stop if it is nearer than this [m].
_AT_STOP = 1e-9


class WireEnd(NamedTuple):
    """The end of a wire that no clamp carries: its node, the wire's name, whether there is a
    tensioner, and the direction away from the wire, 1 or -1 along the track."""

    node: int
    wire: str
    tensioned: bool
    outwards: int


def ends_of(model: Model) -> list[WireEnd]:
    """Ends of all wires, without ends that clamps carry, wire by wire in order of x."""
    mesh, along = model.mesh, model.problem.along
    masts = model.problem.line.support_positions
    line_ends = float(masts[0]), float(masts[-1])
    found = []
    for wire in model.problem.line.wires:
        for piece, nodes in zip(wire.pieces, mesh.pieces(wire.name), strict=True):
            ends = zip(nodes[[0, -1]], (-1, 1), piece.ends, piece.tensioned, strict=True)
            for node, outwards, kind, tensioned in ends:
                if kind is not End.CLAMPED:
                    x = float(mesh.points[node, 0])
                    if tensioned is None:
                        tensioned = along.tensioned(x, line_ends, SAME_STATION)
                    found.append(WireEnd(int(node), wire.name, tensioned, outwards))
    return found


def tensioned_ends(model: Model) -> list[WireEnd]:
    """The ends that have a tensioner."""
    return [end for end in ends_of(model) if end.tensioned]


def held_along(model: Model) -> np.ndarray:
    """Nodes that do not move along the track: ends without a tensioner or at its stop, and
    mid-points."""
    there = model.simulated.tensioner is not None
    held = [
        end.node for end in ends_of(model) if not (end.tensioned and there) or at_stop(model, end)
    ]
    return np.unique(np.concatenate([np.array(held, dtype=np.int64), mid_points(model)]))


def at_stop(model: Model, end: WireEnd) -> bool:
    """Whether a stop holds a tensioned end at rest."""
    tensioner = model.simulated.tensioner
    if tensioner is None or tensioner.travel is None or model.form is None:
        return False
    moved = model.form.along[end.node] if model.form.along.size else 0.0
    return bool(abs(moved) > tensioner.travel - _AT_STOP)


def mid_points(model: Model) -> np.ndarray:
    """Nodes of mid-point anchors, of all wires whose ends no clamps carry."""
    mesh, places = model.mesh, np.array(model.problem.along.mid_points)
    nodes = [np.zeros(0, dtype=np.int64)]
    for wire in model.problem.line.wires:
        if wire.pieces[0].ends[0] is End.CLAMPED:
            continue
        own = mesh.wires[wire.name]
        close = np.abs(mesh.x(own)[:, None] - places) < 1e-3
        nodes.append(own[close.any(axis=1)])
    return np.concatenate(nodes)


def tension_at_rest(model: Model, end: WireEnd) -> float:
    """Tension of a wire in its last element before an end, at rest [N]."""
    element = np.flatnonzero((model.mesh.elements(end.wire) == end.node).any(axis=1))[0]
    return float(model.tension_of(end.wire)[element])
