"""The mesh of a line as arrays: nodes, wires as chains of nodes, and what hangs between them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

# Names of the physical groups of a simple catenary's mesh file: lines, then points.
CONTACT_WIRE = "contact_wire"
MESSENGER_WIRE = "messenger_wire"
DROPPERS = "droppers"
STEADY_ARMS = "steady_arms"
SUPPORTS = "supports"
ANCHORS = "anchors"


_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class LineMesh:
    """A line mesh, independent of how it was made.

    Attributes
    ----------
    points : (n_nodes, 3) [m]
        x along the track, y lateral, z up.
    wires : name -> (n,) int
        The nodes of each wire in order of x, those of the contact wires first.
    droppers : (n_droppers, 2) int
        Upper and lower node of each dropper, in order of x of the lower one.
    steady_arms : (n_arms,) int
        Nodes at which a steady arm is clamped, in order of x.
    supports : (n_supports,) int
        Nodes carried by a support, in order of x.
    anchors : (n_anchors,) int
        Wire ends held by the tensioners: no vertical motion.
    dropper_group, arm_group, support_group : (n,) int
        Number of the line's group that each belongs to; of the first one if not given.
    clamps : (n_clamps, 2) int
        Upper and lower node of each clamp, group by group.
    breaks : name -> (n,) int
        Places in ``wires[name]`` of the first nodes of all pieces but the first one; a wire that
        is not named is of one piece.
    """

    points: np.ndarray
    wires: dict[str, np.ndarray]
    droppers: np.ndarray
    steady_arms: np.ndarray
    supports: np.ndarray
    anchors: np.ndarray
    dropper_group: np.ndarray = field(default_factory=lambda: _NONE)
    arm_group: np.ndarray = field(default_factory=lambda: _NONE)
    support_group: np.ndarray = field(default_factory=lambda: _NONE)
    breaks: dict[str, np.ndarray] = field(default_factory=dict)
    clamps: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    def __post_init__(self) -> None:
        for name, members in (
            ("dropper_group", self.droppers),
            ("arm_group", self.steady_arms),
            ("support_group", self.supports),
        ):
            if getattr(self, name).size != len(members):
                assert getattr(self, name).size == 0, name
                object.__setattr__(self, name, np.zeros(len(members), dtype=np.int64))

    @property
    def n_nodes(self) -> int:
        return int(self.points.shape[0])

    def x(self, nodes: np.ndarray) -> np.ndarray:
        """Positions of ``nodes`` along the track [m]."""
        return np.asarray(self.points[nodes, 0])

    def elements(self, wire: str) -> np.ndarray:
        """First and second node of the elements of a wire, (n, 2), in order of x."""
        return elements_of(self.wires[wire], self.breaks.get(wire, _NONE))

    def pieces(self, wire: str) -> list[np.ndarray]:
        """Nodes of the pieces of a wire, in order of x."""
        return np.split(self.wires[wire], self.breaks.get(wire, _NONE))


def reduced(mesh: LineMesh, places: np.ndarray, within: float) -> LineMesh:
    """The mesh with nodes of all wires only where something hangs or ends, and at ``places``.

    Parameters
    ----------
    mesh : LineMesh
        Mesh whose nodes are thinned out.
    places : ndarray, shape (n,)
        Further places that keep their nodes [m].
    within : float
        Distance below which places are one [m].

    Returns
    -------
    LineMesh
        Droppers and hardware in the same order, with other numbers of nodes.
    """
    ends = [piece[[0, -1]] for wire in mesh.wires for piece in mesh.pieces(wire)]
    joints = (mesh.droppers, mesh.clamps, mesh.steady_arms, mesh.supports, mesh.anchors)
    used = np.concatenate([*ends, *(part.ravel() for part in joints)])
    x, wanted = mesh.points[:, 0], np.sort(np.concatenate([mesh.x(used), places]))
    next_one = np.searchsorted(wanted, x - within)
    kept = np.append(wanted, np.inf)[next_one] <= x + within
    number = np.cumsum(kept) - 1
    return replace(
        mesh,
        points=mesh.points[kept],
        wires={name: number[nodes[kept[nodes]]] for name, nodes in mesh.wires.items()},
        droppers=number[mesh.droppers],
        steady_arms=number[mesh.steady_arms],
        supports=number[mesh.supports],
        anchors=number[mesh.anchors],
        clamps=number[mesh.clamps],
        breaks={
            name: np.cumsum(kept[mesh.wires[name]])[begins - 1]
            for name, begins in mesh.breaks.items()
        },
    )


def with_nodes_at(mesh: LineMesh, wire: str, places: np.ndarray, within: float) -> LineMesh:
    """The mesh with further nodes of ``wire`` at ``places`` (n,) [m].

    Places nearer than ``within`` [m] to a node get none.
    """
    nodes = mesh.wires[wire]
    x = mesh.x(nodes)
    before = np.clip(np.searchsorted(x, places) - 1, 0, x.size - 2)
    new = np.minimum(places - x[before], x[before + 1] - places) > within
    places, before = places[new], before[new]
    first, second = mesh.points[nodes[before]], mesh.points[nodes[before + 1]]
    share = (places - first[:, 0]) / (second[:, 0] - first[:, 0])
    numbers = mesh.n_nodes + np.arange(places.size)
    breaks = mesh.breaks
    if wire in breaks:
        breaks = breaks | {wire: breaks[wire] + np.searchsorted(before + 1, breaks[wire])}
    return replace(
        mesh,
        points=np.concatenate([mesh.points, first + share[:, None] * (second - first)]),
        wires=mesh.wires | {wire: np.insert(nodes, before + 1, numbers)},
        breaks=breaks,
    )


def elements_of(nodes: np.ndarray, breaks: np.ndarray = _NONE) -> np.ndarray:
    """First and second node of the elements of a wire, (n, 2), in order of x.

    Parameters
    ----------
    nodes : ndarray, shape (n,)
        Nodes of the wire in order of x.
    breaks : ndarray, optional
        Numbers, in ``nodes``, of the first nodes of all pieces but the first one.
    """
    pairs = np.stack([nodes[:-1], nodes[1:]], axis=1)
    return np.delete(pairs, breaks - 1, axis=0) if breaks.size else pairs
