"""Registry of a line's unknowns: which there are, where they stand, and their numbers.

Unknowns are numbered by stations along the track. A station is a cross-section of the line: nodes
of the wires at one place, with the unknowns that effects asked for each of them. Where wires have
their nodes at places of their own, it has as many of each as make it join no stations but those
beside it. Within a station unknowns are numbered by groups, which are those that effects asked for
together, such as deflection and slope in one plane: what nothing joins then stands apart, and is
solved for side by side. Nothing else makes numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from catenary.meshgen.mesh import LineMesh
from catenary.solver.model.stations import Stations, stations_of

# Unknowns of a group in a station above which solving by nodes is faster.
_WIDEST_GROUP = 12
# Types of stations that a line may have, each with loops of its own; of more the rarer ones are
# filled up to a whole cross-section.
MOST_STATION_TYPES = 4

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
        return self.within(x - 1e-6, np.inf)[0]

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
