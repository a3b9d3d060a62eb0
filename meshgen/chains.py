"""From the groups of a mesh file to a line: wires in order, droppers found, all of it checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.base.errors import InputError

# Nodes closer than this are taken for one place [m].
_SAME_PLACE = 1e-6

# A dropper is modelled as vertical; more lean along the track than this is a wrong mesh [m].
_LEAN_LIMIT = 0.5


@dataclass(frozen=True)
class Groups:
    """What a mesh file holds: ``points`` (n, 3) [m], the elements of lines (n, 2), nodes (n,)."""

    points: np.ndarray
    contact_wire: np.ndarray
    messenger_wire: np.ndarray
    droppers: np.ndarray
    steady_arms: np.ndarray
    supports: np.ndarray
    anchors: np.ndarray


def assemble(groups: Groups, source: str) -> LineMesh:
    """The line mesh that the groups make. Not collective.

    Parameters
    ----------
    groups : Groups
    source : name of the file, for messages

    Raises
    ------
    InputError
        If the groups do not make a line; the sentence names the group and the place.
    """
    points = groups.points
    wires = {
        CONTACT_WIRE: _order_wire(points, groups.contact_wire, f"{source}: {CONTACT_WIRE}"),
        MESSENGER_WIRE: _order_wire(points, groups.messenger_wire, f"{source}: {MESSENGER_WIRE}"),
    }
    shared = np.intersect1d(wires[CONTACT_WIRE], wires[MESSENGER_WIRE])
    if shared.size:
        raise InputError(
            f"{source}: contact_wire and messenger_wire share the node at {_at(points, shared[0])}"
        )
    droppers = _find_droppers(points, wires, groups.droppers, f"{source}: droppers")
    for name, nodes, wire in (
        ("steady arm", groups.steady_arms, CONTACT_WIRE),
        ("support", groups.supports, MESSENGER_WIRE),
    ):
        stray = np.setdiff1d(nodes, wires[wire])
        if stray.size:
            raise InputError(
                f"{source}: the {name} at {_at(points, stray[0])} is not a node of {wire}"
            )
    _check_anchors(points, wires, groups.anchors, source)
    return _renumber(groups, wires, droppers)


def _at(points: np.ndarray, node: int) -> str:
    x, y, z = points[node]
    return f"x = {x:g}, y = {y:g}, z = {z:g} m"


def _order_wire(points: np.ndarray, edges: np.ndarray, what: str) -> np.ndarray:
    """Nodes of a wire in order of x; an error unless its elements join just the neighbours."""
    _check_lengths(points, edges, what)
    used, degree = np.unique(edges, return_counts=True)
    nodes = used[np.argsort(points[used, 0], kind="stable")]
    rank = np.full(points.shape[0], -1)
    rank[nodes] = np.arange(nodes.size)
    joined = np.sort(rank[edges], axis=1)
    joined = joined[np.argsort(joined[:, 0], kind="stable")]
    neighbours = np.column_stack([np.arange(nodes.size - 1), np.arange(1, nodes.size)])
    if not np.array_equal(joined, neighbours):
        raise InputError(_why_no_chain(points, used, degree, what))
    level = np.flatnonzero(np.diff(points[nodes, 0]) < _SAME_PLACE)
    if level.size:
        raise InputError(
            f"{what} does not advance along the track at {_at(points, nodes[level[0]])}"
        )
    return nodes


def _why_no_chain(points: np.ndarray, used: np.ndarray, degree: np.ndarray, what: str) -> str:
    ends, branches = used[degree == 1], used[degree > 2]
    if branches.size:
        return (
            f"{what} is not one simple chain: more than two of its elements meet at "
            f"{_at(points, branches[0])}"
        )
    if ends.size > 2:
        places = ", ".join(f"{x:g}" for x in np.sort(points[ends, 0])[:6])
        return (
            f"{what} is not one simple chain but {ends.size // 2} separate ones, which end at x = "
            f"{places} m (nodes at the same place must be merged)"
        )
    return f"{what} is not one simple chain in the order of x: it turns back or closes in itself"


def _check_lengths(points: np.ndarray, edges: np.ndarray, what: str) -> None:
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    short = np.flatnonzero(length < _SAME_PLACE)
    if short.size:
        place = _at(points, edges[short[0], 0])
        raise InputError(f"{what} has an element of zero length at {place}")


def _find_droppers(
    points: np.ndarray, wires: dict[str, np.ndarray], edges: np.ndarray, what: str
) -> np.ndarray:
    """Upper and lower node of each dropper in order of x, (n, 2); chains are shortened to ends."""
    _check_lengths(points, edges, what)
    wire_of = np.full(points.shape[0], -1)
    wire_of[wires[MESSENGER_WIRE]], wire_of[wires[CONTACT_WIRE]] = 0, 1
    ends = _ends_of_chains(points, wire_of >= 0, edges, what)
    sides = wire_of[ends]
    same = np.flatnonzero(sides[:, 0] == sides[:, 1])
    if same.size:
        first, last = ends[same[0]]
        wire = (MESSENGER_WIRE, CONTACT_WIRE)[sides[same[0], 0]]
        raise InputError(
            f"{what}: the dropper from {_at(points, first)} to {_at(points, last)} joins {wire} "
            "with itself, but must join messenger_wire and contact_wire"
        )
    ends = np.take_along_axis(ends, np.argsort(sides, axis=1), axis=1)
    ends = ends[np.lexsort((ends[:, 0], points[ends[:, 1], 0]))]
    _check_droppers(points, ends, what)
    return ends


def _ends_of_chains(
    points: np.ndarray, on_wire: np.ndarray, edges: np.ndarray, what: str
) -> np.ndarray:
    """Follow chains of elements from wire node to wire node, (n, 2)."""
    meeting: dict[int, list[int]] = {}
    for element, pair in enumerate(edges.tolist()):
        for node in pair:
            if not on_wire[node]:
                meeting.setdefault(node, []).append(element)
    for node, elements in meeting.items():
        if len(elements) != 2:
            fault = "ends in the air" if len(elements) == 1 else "branches"
            raise InputError(
                f"{what}: a dropper {fault} at {_at(points, node)}, but must join messenger_wire "
                "and contact_wire"
            )
    found = []
    visited = np.zeros(edges.shape[0], dtype=bool)
    for start in range(edges.shape[0]):
        first, node = edges[start].tolist()
        if not on_wire[first]:
            first, node = node, first
        if visited[start] or not on_wire[first]:
            continue
        element = start
        visited[element] = True
        while not on_wire[node]:
            element = sum(meeting[node]) - element  # the other one of the two
            visited[element] = True
            node = int(edges[element].sum()) - node
        found.append((first, node))
    if not visited.all():
        loose = edges[np.flatnonzero(~visited)[0], 0]
        raise InputError(f"{what}: the elements at {_at(points, loose)} join no wire")
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _check_droppers(points: np.ndarray, ends: np.ndarray, what: str) -> None:
    """Refuse droppers that stand upside down, lean too far or lie on one another."""
    across = points[ends[:, 0]] - points[ends[:, 1]]
    inverted = np.flatnonzero(across[:, 2] < _SAME_PLACE)
    if inverted.size:
        raise InputError(
            f"{what}: the dropper at {_at(points, ends[inverted[0], 1])} does not hang down: its "
            "end on messenger_wire must be above its end on contact_wire"
        )
    leaning = np.flatnonzero(np.abs(across[:, 0]) > _LEAN_LIMIT)
    if leaning.size:
        raise InputError(
            f"{what}: the dropper at {_at(points, ends[leaning[0], 1])} leans "
            f"{abs(across[leaning[0], 0]):.3g} m along the track, but at most {_LEAN_LIMIT:g} m is "
            "allowed"
        )
    distinct, count = np.unique(ends, axis=0, return_counts=True)
    if (count > 1).any():
        place = _at(points, distinct[np.argmax(count), 1])
        raise InputError(f"{what}: two droppers join the same nodes at {place}")


def _check_anchors(
    points: np.ndarray, wires: dict[str, np.ndarray], anchors: np.ndarray, source: str
) -> None:
    ends = np.concatenate([wire[[0, -1]] for wire in wires.values()])
    stray, free = np.setdiff1d(anchors, ends), np.setdiff1d(ends, anchors)
    if stray.size:
        raise InputError(
            f"{source}: the anchor at {_at(points, stray[0])} is not the end of a wire"
        )
    if free.size:
        raise InputError(
            f"{source}: the end of a wire at {_at(points, free[0])} is in no group, but must be "
            "in anchors"
        )


def _renumber(groups: Groups, wires: dict[str, np.ndarray], droppers: np.ndarray) -> LineMesh:
    """The mesh with the wires' nodes only, numbered along the track.

    Neighbours along the track get neighbouring numbers, across both wires: what a banded or
    distributed matrix wants.
    """
    points = groups.points
    used = np.concatenate([wires[MESSENGER_WIRE], wires[CONTACT_WIRE]])
    # x is rounded so that nodes of one station stay together whatever their last bits say.
    order = used[np.argsort(np.round(points[used, 0], 6), kind="stable")]
    number = np.full(points.shape[0], -1)
    number[order] = np.arange(order.size)

    def along(nodes: np.ndarray) -> np.ndarray:
        return np.asarray(number[nodes[np.argsort(points[nodes, 0], kind="stable")]])

    return LineMesh(
        points=points[order],
        wires={name: number[nodes] for name, nodes in wires.items()},
        droppers=number[droppers],
        steady_arms=along(groups.steady_arms),
        supports=along(groups.supports),
        anchors=along(groups.anchors),
    )
