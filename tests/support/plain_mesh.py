"""Meshes of lines on places of nodes that do not come from the package."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.geometry import find_cuts
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import End

_SAME_PLACE = 1e-6


def graded(line: Line, first: float, ratio: float, longest: float, halvings: int = 0) -> np.ndarray:
    """Places of nodes (n,) [m], closer beside hardware and ends of wires.

    From either side of each gap elements grow by a geometric series, and are as many as it takes to
    fill the gap; one factor then shrinks them to fill it exactly.

    Parameters
    ----------
    first, longest : lengths of elements beside hardware, and at most [m]
    ratio : of the lengths of neighbouring elements
    halvings : how often each element is cut into halves
    """
    cuts, found = find_cuts(line).x, []
    for start, gap in zip(cuts[:-1], np.diff(cuts), strict=True):
        lengths = [first]
        while sum(lengths) < 0.5 * gap:
            lengths.append(min(ratio * lengths[-1], longest))
        both = np.array(lengths + lengths[::-1])
        found.append(start + np.append(0.0, np.cumsum(both)[:-1]) * gap / both.sum())
    x = np.append(np.concatenate(found), cuts[-1])
    for _ in range(halvings):
        x = np.insert(x, np.arange(1, x.size), 0.5 * (x[:-1] + x[1:]))
    return x


def mesh_on(line: Line, x: np.ndarray) -> LineMesh:
    """Nodes of all wires at places ``x`` (n,) [m] as far as they reach; heights without pre-sag and
    sag. ``x`` has the places of all hardware."""
    points, anchors, n_nodes = [], [], 0
    wires: dict[str, np.ndarray] = {}
    breaks: dict[str, np.ndarray] = {}
    node_at = {wire.name: np.full(x.size, -1) for wire in line.wires}
    for wire in line.wires:
        for piece in wire.pieces:
            first, last = np.searchsorted(x, np.array([piece.x[0], piece.x[-1]]) - _SAME_PLACE)
            place = np.arange(first, last + 1)
            nodes = n_nodes + np.arange(place.size)
            n_nodes += place.size
            level = wire.profile.level(x[place]) if wire.profile else np.full(place.size, wire.top)
            points.append(np.column_stack([x[place], np.zeros(place.size), level]))
            ends = zip((0, -1), piece.ends, strict=True)
            anchors += [nodes[end] for end, kind in ends if kind is End.HELD]
            node_at[wire.name][place] = nodes
            if wire.name in wires:
                begun = breaks.get(wire.name, np.zeros(0, dtype=np.int64))
                breaks[wire.name] = np.append(begun, wires[wire.name].size)
            wires[wire.name] = np.append(wires.get(wire.name, nodes[:0]), nodes)

    def at(wire: str, places: tuple[float, ...]) -> np.ndarray:
        return node_at[wire][np.searchsorted(x, np.array(places) - _SAME_PLACE)]

    def together(members: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        nodes = np.concatenate([members[0][:0], *members])
        group = np.repeat(np.arange(len(members)), [len(own) for own in members])
        order = np.argsort(whole[nodes.T[-1] if nodes.ndim == 2 else nodes, 0], kind="stable")
        return nodes[order], group[order]

    whole = np.concatenate(points)
    droppers, dropper_group = together(
        [
            np.column_stack([at(group.upper, group.upper_x), at(group.lower, group.lower_x)])
            for group in line.droppers
        ]
    )
    clamps = [
        np.column_stack([at(group.upper, group.x), at(group.lower, group.x)])
        for group in line.clamps
    ]
    arms, arm_group = together([at(group.wire, group.x) for group in line.steady_arms])
    supports, support_group = together([at(group.wire, group.x) for group in line.supports])
    return LineMesh(
        points=whole,
        wires=wires,
        droppers=droppers,
        steady_arms=arms,
        supports=supports,
        anchors=np.array(anchors),
        dropper_group=dropper_group,
        arm_group=arm_group,
        support_group=support_group,
        breaks=breaks,
        clamps=np.concatenate([np.zeros((0, 2), dtype=int), *clamps]),
    )
