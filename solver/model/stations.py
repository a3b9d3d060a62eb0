"""Stations of a mesh: nodes in one cross-section of the line, each in a slot of it.

Nodes of a wire that moves with the wire beside it are in the slots of that one's nodes.

A slot is a node's place in a cross-section. Where wires have a node each at all places that they
pass, a wire keeps its slot all along, and a slot is free again where its wire has ended.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.mesh import LineMesh

# Nodes closer than this along the track belong to one station [m].
SAME_STATION = 1e-6


class Stations(NamedTuple):
    """Stations of a mesh.

    Attributes
    ----------
    of_node, slot : (n_nodes,) station and slot of each node
    present : (n_stations, n_slots) slots that each station has, with a node or without
    join_neighbours : whether wires and droppers join stations to those beside them only; if not,
        each node is a station
    """

    of_node: np.ndarray
    slot: np.ndarray
    present: np.ndarray
    join_neighbours: bool


def along_the_track(mesh: LineMesh) -> np.ndarray:
    """Nodes in the order along the track, those at one place in the order of the wires."""
    order = np.argsort(mesh.points[:, 0], kind="stable")
    return order[np.lexsort((_wire_of_node(mesh)[order], _places(mesh)[order]))]


def stations_of(
    mesh: LineMesh, most_nodes: int, together: Mapping[str, str] | None = None
) -> Stations:
    """Stations of a mesh: places, else gaps cut into as many as one wire has nodes, else nodes.

    Parameters
    ----------
    mesh : LineMesh
        Mesh of the line.
    most_nodes : int
        Most nodes in a station that has several of a wire.
    together : mapping, optional
        Wires that move with another one, whose slots their nodes have.

    Raises
    ------
    InputError
        If a wire has not its nodes, or what hangs there, beside those of the wire it moves with.
    """
    if not together:
        return _stations_of(mesh, most_nodes)
    # Of a mesh without these wires.
    kept, number = np.unique(_beside(mesh, together), return_inverse=True)
    wires = {name: number[own] for name, own in mesh.wires.items() if name not in together}
    less = replace(mesh, points=mesh.points[kept], wires=wires, droppers=number[mesh.droppers])
    own = _stations_of(less, most_nodes)
    return own._replace(of_node=own.of_node[number], slot=own.slot[number])


def _beside(mesh: LineMesh, together: Mapping[str, str]) -> np.ndarray:
    """The node with which each moves, (n_nodes,): itself, or that of another wire beside it."""
    leads = np.arange(mesh.n_nodes)
    for name, other in together.items():
        pieces = [mesh.pieces(wire) for wire in (name, other)]
        sizes = [[piece.size for piece in own] for own in pieces]
        own, beside = mesh.wires[name], mesh.wires[other]
        if sizes[0] != sizes[1] or np.abs(mesh.x(own) - mesh.x(beside)).max() > SAME_STATION:
            raise InputError(
                f"without effects.relative_motion {name} and {other} need nodes side by side: the "
                f"mesh has {own.size} and {beside.size} of them, not all at the same places; "
                "switch that on, or give both wires the same nodes"
            )
        leads[own] = beside
        for part, nodes in _at_nodes(mesh).items():
            mine, others = (nodes[np.isin(nodes, wire)] for wire in (own, beside))
            if not np.array_equal(np.sort(leads[mine]), np.sort(others)):
                raise InputError(
                    f"without effects.relative_motion {name} and {other} need {part} side by side: "
                    f"the mesh has {mine.size} and {others.size} of them, not all at the same "
                    "places; switch that on, or give both wires the same"
                )
    return leads


def _at_nodes(mesh: LineMesh) -> dict[str, np.ndarray]:
    """Nodes of what hangs and holds wires, (n,) of each."""
    return {
        "upper ends of droppers": mesh.droppers[:, 0],
        "lower ends of droppers": mesh.droppers[:, 1],
        "steady arms": mesh.steady_arms,
        "supports": mesh.supports,
        "ends": mesh.anchors,
    }


def _stations_of(mesh: LineMesh, most_nodes: int) -> Stations:
    places = _places(mesh)
    if all((np.diff(places[nodes]) == 1).all() for nodes in _pieces(mesh)):
        return _by_places(mesh, places)
    station = _by_gaps(mesh)
    if station is not None:
        slot = _ranks(mesh, station)
        present = np.ones((station.max() + 1, slot.max() + 1), dtype=bool)
        if present.shape[1] <= most_nodes:
            return Stations(station, slot, present, True)
    station = np.empty(mesh.n_nodes, dtype=np.int64)
    station[along_the_track(mesh)] = np.arange(mesh.n_nodes)
    slot = np.zeros(mesh.n_nodes, dtype=np.int64)
    return Stations(station, slot, np.ones((mesh.n_nodes, 1), dtype=bool), False)


def _by_places(mesh: LineMesh, places: np.ndarray) -> Stations:
    """Places as stations.

    Each piece of a wire takes a slot for itself. A station has the slots of pieces that pass it or
    one beside it, so that both have whatever may join them.
    """
    n_stations = int(places.max(initial=-1)) + 1
    slot_of_node = np.zeros(mesh.n_nodes, dtype=np.int64)
    last_of_slot: list[int] = []
    passed: list[tuple[int, int, int]] = []
    for nodes in sorted(_pieces(mesh), key=lambda nodes: int(places[nodes[0]])):
        first, last = int(places[nodes[0]]), int(places[nodes[-1]])
        free = (slot for slot, end in enumerate(last_of_slot) if end < first - 2)
        slot = next(free, len(last_of_slot))
        last_of_slot[slot : slot + 1] = [last]
        slot_of_node[nodes] = slot
        passed.append((slot, first, last))
    present = np.zeros((n_stations, len(last_of_slot)), dtype=bool)
    for slot, first, last in passed:
        present[max(first - 1, 0) : last + 2, slot] = True
    return Stations(places, slot_of_node, present, True)


def _pieces(mesh: LineMesh) -> list[np.ndarray]:
    """Nodes of each piece of each wire."""
    return [piece for wire in mesh.wires for piece in mesh.pieces(wire)]


def _by_gaps(mesh: LineMesh) -> np.ndarray | None:
    """Station of each node, (n_nodes,); None if there is no way to join neighbours only.

    A gap between droppers is as many stations long as the wire with the fewest nodes there is: it
    has one in each, the other perhaps more.
    """
    index = np.empty(mesh.n_nodes, dtype=np.int64)
    for nodes in mesh.wires.values():
        index[nodes] = np.arange(nodes.size)
    droppers = mesh.droppers[np.argsort(mesh.x(mesh.droppers[:, 1]), kind="stable")]
    of_wire = _wire_of_node(mesh)[droppers]
    if len(mesh.wires) != 2 or mesh.breaks or (np.sort(of_wire, axis=1) != [0, 1]).any():
        return None
    ends = {int(wire): index[droppers[of_wire == wire]] for wire in (0, 1)}
    sizes = [nodes.size - 1 for nodes in mesh.wires.values()]
    ties = np.column_stack([np.concatenate([[0], ends[w], [sizes[w]]]) for w in (0, 1)])
    ties = ties[np.append(True, np.diff(ties, axis=0).any(axis=1))]
    if (np.diff(ties, axis=0) <= 0).any():
        return None
    level = np.concatenate([[0], np.cumsum(np.diff(ties, axis=0).min(axis=1))])
    stations = np.empty(mesh.n_nodes, dtype=np.int64)
    for nodes, tie in zip(mesh.wires.values(), ties.T, strict=True):
        reached = np.interp(np.arange(nodes.size), tie, level)
        stations[nodes] = np.floor(reached + 0.5 - 1e-9)
    return stations


def _ranks(mesh: LineMesh, station: np.ndarray) -> np.ndarray:
    """Place of each node among those of its station, (n_nodes,)."""
    order = along_the_track(mesh)
    by_station = order[np.argsort(station[order], kind="stable")]
    first = np.searchsorted(station[by_station], np.arange(station.max() + 1))
    ranks = np.empty(mesh.n_nodes, dtype=np.int64)
    ranks[by_station] = np.arange(mesh.n_nodes) - first[station[by_station]]
    return ranks


def _places(mesh: LineMesh) -> np.ndarray:
    """Number of the place along the track at which each node stands, (n_nodes,)."""
    order = np.argsort(mesh.points[:, 0], kind="stable")
    x = mesh.points[order, 0]
    result = np.empty(mesh.n_nodes, dtype=np.int64)
    result[order] = np.cumsum(np.diff(x, prepend=x[:1]) > SAME_STATION)
    return result


def _wire_of_node(mesh: LineMesh) -> np.ndarray:
    wire = np.zeros(mesh.n_nodes, dtype=np.int64)
    for number, nodes in enumerate(mesh.wires.values()):
        wire[nodes] = number
    return wire
