"""Registry of a line's unknowns: which there are, where they stand, and their numbers.

Unknowns are numbered by stations along the track. A station is a cross-section of the line: nodes
of all wires at one place. Where wires have their nodes at places of their own, it has as many of
each as make it join no stations but those beside it. Within a station unknowns are numbered by
groups, which are those that effects asked for together, such as deflection and slope in one plane:
what nothing joins then stands apart, and is solved for side by side. Nothing else makes numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from catenary.meshgen.mesh import LineMesh

# Nodes closer than this along the track belong to one station [m].
SAME_STATION = 1e-6
# Unknowns of a group in a station above which solving by nodes is faster.
_WIDEST_GROUP = 12


@dataclass(frozen=True)
class Unknowns:
    """Numbers and places of unknowns. Of held and missing ones, too: all stations are alike.

    Attributes
    ----------
    names : of the unknowns of a node, as effects asked for them
    numbers : (n_nodes, n_names) number of each, by nodes of the mesh
    width : unknowns of a station
    in_stations : whether matrices join stations to those beside them only, as far as wires and
        droppers tell; if not, each node is a station
    low, high : (n_stations,) ascending places [m]: no node from a station on stands before its low,
        none up to it behind its high
    """

    names: tuple[str, ...]
    numbers: np.ndarray
    width: int
    in_stations: bool
    low: np.ndarray
    high: np.ndarray

    @property
    def size(self) -> int:
        """How many numbers there are, those that no node has included."""
        return self.low.size * self.width

    @property
    def missing(self) -> np.ndarray:
        """Numbers that no node has: of stations with fewer nodes than others."""
        taken = np.zeros(self.size, dtype=bool)
        taken[self.numbers] = True
        return np.flatnonzero(~taken)

    def of(self, nodes: np.ndarray, name: str) -> np.ndarray:
        """Numbers of one unknown at mesh nodes, shape as ``nodes``."""
        return self.numbers[nodes, self.names.index(name)]

    def station_of(self, nodes: np.ndarray) -> np.ndarray:
        """Stations of mesh nodes, shape as ``nodes``."""
        return self.numbers[nodes, 0] // self.width

    def within(self, x_low: float, x_high: float) -> tuple[int, int]:
        """Range of numbers with all unknowns in [``x_low``, ``x_high``] [m]."""
        first = int(np.searchsorted(self.high, x_low - 1e-9))
        last = int(np.searchsorted(self.low, x_high + 1e-9))
        return first * self.width, max(first, last) * self.width


def along_the_track(mesh: LineMesh) -> np.ndarray:
    """Nodes in the order along the track, those at one place in the order of the wires."""
    order = np.argsort(mesh.points[:, 0], kind="stable")
    return order[np.lexsort((_wire_of_node(mesh)[order], _places(mesh)[order]))]


def number_unknowns(mesh: LineMesh, groups: Iterable[tuple[str, ...]]) -> Unknowns:
    """The registry for a mesh whose nodes all have the unknowns of ``groups``. Not collective."""
    groups = list(groups)
    names = tuple(name for group in groups for name in group)
    x, n_nodes = mesh.points[:, 0], mesh.n_nodes
    order = along_the_track(mesh)
    station = _stations(mesh)
    in_stations = station is not None
    most = 1 if station is None else int(np.bincount(station).max(initial=1))
    if most > len(mesh.wires) and most * max(map(len, groups)) > _WIDEST_GROUP:
        in_stations, most = False, 1
    if station is None or not in_stations:
        station = np.empty(n_nodes, dtype=np.int64)
        station[order] = np.arange(n_nodes)
    # The place of a node among those of its station.
    by_station = order[np.argsort(station[order], kind="stable")]
    first = np.searchsorted(station[by_station], np.arange(station.max(initial=-1) + 1))
    slot = np.empty(n_nodes, dtype=np.int64)
    slot[by_station] = np.arange(n_nodes) - first[station[by_station]]
    numbers = np.empty((n_nodes, len(names)), dtype=np.int64)
    width, column = most * len(names), 0
    for group in groups:
        start = column * most
        for offset in range(len(group)):
            numbers[:, column + offset] = width * station + start + slot * len(group) + offset
        column += len(group)
    low, high = np.full((2, first.size), np.inf) * [[1.0], [-1.0]]
    np.minimum.at(low, station, x)
    np.maximum.at(high, station, x)
    low = np.minimum.accumulate(low[::-1])[::-1]
    return Unknowns(names, numbers, width, in_stations, low, np.maximum.accumulate(high))


def _stations(mesh: LineMesh) -> np.ndarray | None:
    """Station of each node, (n_nodes,); None if there is no way to join neighbours only.

    Where not each place has a node of each wire, a gap between droppers is as many stations long as
    the wire with the fewest nodes there is: it has one in each, the others perhaps more.
    """
    places = _places(mesh)
    if (np.bincount(places) == len(mesh.wires)).all():
        return places
    index = np.empty(mesh.n_nodes, dtype=np.int64)
    for nodes in mesh.wires.values():
        index[nodes] = np.arange(nodes.size)
    droppers = mesh.droppers[np.argsort(mesh.x(mesh.droppers[:, 1]), kind="stable")]
    of_wire = _wire_of_node(mesh)[droppers]
    if len(mesh.wires) != 2 or (np.sort(of_wire, axis=1) != [0, 1]).any():
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
