"""Unknowns of a line: which there are, where they stand, and their numbers along the track.

A station is a cross-section of the line: nodes of the wires at one place, each in a slot of it,
with the unknowns that effects asked for each of them. Where wires have a node each at all places
that they pass, a wire keeps its slot all along, and a slot is free again where its wire has ended.
Where wires have their nodes at places of their own, a station has as many of each as make it join
no stations but those beside it. Nodes of a wire that moves with the wire beside it are in the slots
of that one's nodes.

Unknowns are numbered by stations along the track, and within a station by groups, which are those
that effects asked for together, such as deflection and slope in one plane: what nothing joins then
stands apart, and is solved for side by side. Nothing else makes numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import SAME_PLACE

# Deflection and slope of a wire in the vertical plane, and in the lateral one.
UPRIGHT, LEVEL = ("w", "theta_y"), ("v", "theta_z")
# Unknowns of a group in a station above which solving by nodes is faster.
_WIDEST_GROUP = 12
# Types of stations that a line may have, each with loops of its own; of more the rarer ones are
# filled up to a whole cross-section.
MOST_STATION_TYPES = 4


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
    return order[np.lexsort((wire_of_node(mesh)[order], _places(mesh)[order]))]


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
        if sizes[0] != sizes[1] or np.abs(mesh.x(own) - mesh.x(beside)).max() > SAME_PLACE:
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
    of_wire = wire_of_node(mesh)[droppers]
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
    result[order] = np.cumsum(np.diff(x, prepend=x[:1]) > SAME_PLACE)
    return result


def wire_of_node(mesh: LineMesh) -> np.ndarray:
    """Number of the wire of each node, (n_nodes,)."""
    wire = np.zeros(mesh.n_nodes, dtype=np.int64)
    for number, nodes in enumerate(mesh.wires.values()):
        wire[nodes] = number
    return wire


# Unknowns that are numbered together: those of each wire, by its name.
Group = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Unknowns:
    """Numbers and places of unknowns, those of held ones included.

    A cross-section has a place for each unknown that a station may have. Stations of one type
    have the same places. An unknown of a station without a node is missing: it is held.

    Attributes
    ----------
    names : names of all unknowns, group by group
    numbers : (n_nodes, n_names) number of each unknown of each mesh node, -1 if the node does not
        have it. Nodes of wires that move together share numbers
    station : (n_nodes,) station of each node
    starts : (n_stations + 1,) number of the first unknown of each station; the last entry is the
        number of all unknowns
    planes : number of places of a cross-section in each group
    station_types : places of each type, ascending, in the order of a station's unknowns
    station_type : (n_stations,) type of each station
    in_stations : whether matrices join stations to those beside them only, as far as wires and
        droppers tell; if not, each node is a station
    low, high : (n_stations,) ascending places [m]: no node from a station on stands before its low,
        none up to it behind its high
    """

    names: tuple[str, ...]
    numbers: np.ndarray
    station: np.ndarray
    starts: np.ndarray
    planes: tuple[int, ...]
    station_types: tuple[tuple[int, ...], ...]
    station_type: np.ndarray
    in_stations: bool
    low: np.ndarray
    high: np.ndarray

    @property
    def size(self) -> int:
        """Number of unknowns, padding included."""
        return int(self.starts[-1])

    @cached_property
    def n_unknowns(self) -> int:
        """Number of unknowns of all nodes; shared unknowns count once."""
        return self.size - self.missing.size

    @property
    def width(self) -> int:
        """Places of a cross-section."""
        return sum(self.planes)

    @cached_property
    def block(self) -> int:
        """Largest size of square blocks that every station can be cut into."""
        return int(np.gcd.reduce([len(places) for places in self.station_types]))

    @cached_property
    def missing(self) -> np.ndarray:
        """Numbers of unknowns that no node has."""
        taken = np.zeros(self.size, dtype=bool)
        taken[self.numbers[self.numbers >= 0]] = True
        return np.flatnonzero(~taken)

    def has(self, nodes: np.ndarray, name: str) -> np.ndarray:
        """Whether mesh nodes have an unknown, shape as ``nodes``."""
        if name not in self.names:
            return np.zeros(np.shape(nodes), dtype=bool)
        return np.asarray(self.numbers[nodes, self.names.index(name)] >= 0)

    def of(self, nodes: np.ndarray, name: str) -> np.ndarray:
        """Numbers of one unknown at mesh nodes, shape as ``nodes``.

        Raises
        ------
        ValueError
            If a node has no such unknown: no effect asked for it there.
        """
        there = self.has(nodes, name)
        if not there.all():
            node = int(np.asarray(nodes)[~there].flat[0])
            raise ValueError(
                f"node {node} has no unknown {name}: no effect asks for it of its wire"
            )
        return self.numbers[nodes, self.names.index(name)]

    def as_vector(self, by_node: np.ndarray, missing: float = 0.0) -> np.ndarray:
        """The vector (size,) of values by node and name (n_nodes, n_names), ``missing`` where a
        number is no node's.

        Nodes that share a number have the same there.
        ``by_node`` may be (n_nodes, 1), the same for all unknowns of a node.
        """
        result = np.full(self.size, missing)
        there = self.numbers >= 0
        if there.all():
            result[self.numbers] = by_node
            return result
        result[self.numbers[there]] = np.broadcast_to(by_node, there.shape)[there]
        return result

    def stations_over(self, low: int, high: int) -> tuple[int, int]:
        """Range of the stations that have any of the numbers [``low``, ``high``)."""
        first = int(np.searchsorted(self.starts, low, side="right")) - 1
        return first, max(first, int(np.searchsorted(self.starts, high)))

    def whole(self, low: int, high: int) -> tuple[int, int]:
        """A range of numbers, widened to whole stations."""
        first, last = self.stations_over(low, high)
        return int(self.starts[first]), int(self.starts[last])

    def within(self, x_low: float, x_high: float) -> tuple[int, int]:
        """Range of numbers with all unknowns in [``x_low``, ``x_high``] [m]."""
        first, last = self.stations_within(np.array(x_low), np.array(x_high))
        return int(self.starts[first]), int(self.starts[last])

    def first_at(self, x: float) -> int:
        """Number of the first unknown of the station at a place along the track [m]."""
        return self.within(x - SAME_PLACE, np.inf)[0]

    def stations_within(
        self, x_low: np.ndarray, x_high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """First stations, and the ones after the last, that hold all unknowns in each of
        [``x_low``, ``x_high``] [m], shapes as these."""
        first = np.searchsorted(self.high, x_low - 1e-9)
        return first, np.maximum(first, np.searchsorted(self.low, x_high + 1e-9))


def number_unknowns(
    mesh: LineMesh,
    groups: Iterable[Group],
    together: Mapping[str, str] | None = None,
) -> Unknowns:
    """The registry for a mesh whose wires have the unknowns of ``groups``. Not collective.

    Parameters
    ----------
    mesh : LineMesh
        Mesh of the line.
    groups : iterable of Group
        Names of the unknowns of each wire, by groups that matrices join.
    together : mapping, optional
        Wires that move with another one beside them, and share its unknowns, by name.

    Raises
    ------
    InputError
        If such a wire has not its nodes, and what hangs there, beside those of the other one.
    """
    groups = list(groups)
    group_names = [
        tuple(dict.fromkeys(name for own in group.values() for name in own)) for group in groups
    ]
    names = tuple(name for own in group_names for name in own)
    most_nodes = max(2, _WIDEST_GROUP // max(map(len, group_names)))
    stations = stations_of(mesh, most_nodes, together)
    # Whether a slot has an unknown because one of the wires that take it has.
    has_name = np.zeros((stations.present.shape[1], len(names)), dtype=bool)
    numbers = np.full((mesh.n_nodes, len(names)), -1)
    for group in groups:
        for wire, own in group.items():
            nodes = mesh.wires[wire]
            for column in map(names.index, own):
                has_name[np.unique(stations.slot[nodes]), column] = True
                numbers[nodes, column] = 0
    # Places of a cross-section: group by group, slot by slot.
    places = np.array(
        [
            (slot, names.index(name))
            for own in group_names
            for slot in range(has_name.shape[0])
            for name in own
            if has_name[slot, names.index(name)]
        ]
    )
    planes = tuple(int(has_name[:, [names.index(n) for n in own]].sum()) for own in group_names)
    present, station_type = _station_types(stations)
    there = present[:, places[:, 0]]
    station_types = tuple(tuple(map(int, np.flatnonzero(row))) for row in there)
    # Position of a slot's unknown among those of a station, for each station type.
    offset = np.full((len(station_types), *has_name.shape), -1)
    offset[:, places[:, 0], places[:, 1]] = np.where(there, np.cumsum(there, axis=1) - 1, -1)
    starts = np.concatenate([[0], np.cumsum(there.sum(axis=1)[station_type])])
    station = stations.of_node
    own = starts[station][:, None] + offset[station_type[station], stations.slot]
    numbers = np.where(numbers == 0, own, -1)
    low, high = _bounds(mesh, station, station_type.size)
    in_stations = stations.join_neighbours
    return Unknowns(
        names, numbers, station, starts, planes, station_types, station_type, in_stations, low, high
    )


def _station_types(stations: Stations) -> tuple[np.ndarray, np.ndarray]:
    """Slots of each station type, (n, n_slots), and station type of each station.

    The smallest are first, which mostly are the commonest, whatever the line: lines of the same
    station types then have loops in common.
    """
    present = stations.present
    if present.all():
        return present[:1], np.zeros(len(present), dtype=np.int64)
    rows, station_type, counts = np.unique(present, axis=0, return_inverse=True, return_counts=True)
    if stations.join_neighbours and counts.size > MOST_STATION_TYPES:
        rare = np.argsort(-counts, kind="stable")[MOST_STATION_TYPES - 1 :]
        present = present | np.isin(station_type, rare)[:, None]
        rows, station_type = np.unique(present, axis=0, return_inverse=True)
    order = np.argsort(rows.sum(axis=1), kind="stable")
    return rows[order], np.argsort(order)[station_type]


def _bounds(mesh: LineMesh, station: np.ndarray, n_stations: int) -> tuple[np.ndarray, np.ndarray]:
    """Low and high of each station, see ``Unknowns``."""
    low, high = np.full((2, n_stations), np.inf) * [[1.0], [-1.0]]
    order = np.argsort(station, kind="stable")
    own, begins = np.unique(station[order], return_index=True)
    low[own] = np.minimum.reduceat(mesh.points[order, 0], begins)
    high[own] = np.maximum.reduceat(mesh.points[order, 0], begins)
    low = np.ascontiguousarray(np.minimum.accumulate(low[::-1])[::-1])
    return low, np.maximum.accumulate(high)
