"""The mesh of a line as arrays: nodes, wires as chains of nodes, and what hangs between them.

It is assembled from the groups of a mesh file: wires are put in order, droppers found, and all of
it is checked.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import Droppers, Line
from catenary.meshgen.wires import SAME_PLACE, End

# Names of the physical groups of a simple catenary's mesh file: lines, then points.
CONTACT_WIRE = "contact_wire"
MESSENGER_WIRE = "messenger_wire"
DROPPERS = "droppers"
STEADY_ARMS = "steady_arms"
SUPPORTS = "supports"
ANCHORS = "anchors"
# A dropper is modelled as vertical; more lean along the track than this is a wrong mesh [m].
_LEAN_LIMIT = 0.5

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

    def middles(self, wire: str) -> np.ndarray:
        """Middle of each element of a wire along the track, (n,) [m]."""
        return np.asarray(self.x(self.elements(wire)).mean(axis=1))

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


@dataclass(frozen=True)
class Groups:
    """Contents of a mesh file.

    Attributes
    ----------
    points : (n, 3) [m]
    lines : name -> (n, 2) int, elements of wires and droppers
    nodes : name -> (n,) int, of steady arms, supports and anchors
    """

    points: np.ndarray
    lines: dict[str, np.ndarray]
    nodes: dict[str, np.ndarray]


def assemble(groups: Groups, line: Line, source: str) -> LineMesh:
    """The line mesh that the groups make. Not collective.

    Parameters
    ----------
    groups : Groups
        Physical groups that the file holds.
    line : Line
        The line, whose wires and groups have these names; its clamps have no group in a file.
    source : str
        Name of the file, for messages.

    Raises
    ------
    InputError
        If the groups do not make a line; the sentence names the group and the place.
    """
    points, starts, wires = groups.points, {}, {}
    for wire in line.wires:
        wires[wire.name], starts[wire.name] = _order_wire(
            points, groups.lines[wire.name], len(wire.pieces), f"{source}: {wire.name}"
        )
    _check_apart(points, wires, source)
    droppers = [
        _find_droppers(points, wires, groups.lines[group.name], group, f"{source}: {group.name}")
        for group in line.droppers
    ]
    for what, hardware in (("steady arm", line.steady_arms), ("support", line.supports)):
        for own in hardware:
            stray = np.setdiff1d(groups.nodes[own.name], wires[own.wire])
            if stray.size:
                raise InputError(
                    f"{source}: the {what} at {_at(points, stray[0])} is not a node of {own.wire}"
                )
    ends = []
    for wire in line.wires:
        held = [end is End.HELD for piece in wire.pieces for end in piece.ends]
        ends.append(_ends_of_pieces(wires[wire.name], starts[wire.name])[held])
    _check_anchors(points, np.concatenate(ends), groups.nodes[ANCHORS], source)
    return _renumber(groups, line, wires, starts, droppers)


def _ends_of_pieces(nodes: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """First and last node of each piece of a wire, one after the other."""
    lasts = np.append(starts[1:], nodes.size) - 1
    return nodes[np.column_stack([starts, lasts]).ravel()]


def _check_apart(points: np.ndarray, wires: dict[str, np.ndarray], source: str) -> None:
    for (one, nodes), (other, others) in combinations(wires.items(), 2):
        shared = np.intersect1d(nodes, others)
        if shared.size:
            raise InputError(
                f"{source}: {one} and {other} share the node at {_at(points, shared[0])}"
            )


def _at(points: np.ndarray, node: int) -> str:
    x, y, z = points[node]
    return f"x = {x:g}, y = {y:g}, z = {z:g} m"


def _order_wire(
    points: np.ndarray, edges: np.ndarray, n_pieces: int, what: str
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a wire in order of x, and the places in it of its pieces' first nodes.

    An error unless its elements join just the neighbours in as many pieces.
    """
    _check_lengths(points, edges, what)
    used, degree = np.unique(edges, return_counts=True)
    nodes = used[np.argsort(points[used, 0], kind="stable")]
    rank = np.full(points.shape[0], -1)
    rank[nodes] = np.arange(nodes.size)
    joined = np.sort(rank[edges], axis=1)
    joined = joined[np.argsort(joined[:, 0], kind="stable")]
    starts = np.setdiff1d(np.arange(nodes.size), joined[:, 1])
    neighbours = np.delete(np.arange(nodes.size - 1), starts[1:] - 1)
    if starts.size != n_pieces or not np.array_equal(
        joined, np.column_stack([neighbours, neighbours + 1])
    ):
        raise InputError(_why_no_chain(points, used, degree, n_pieces, what))
    level = np.flatnonzero(np.diff(points[nodes, 0]) < SAME_PLACE)
    if level.size:
        raise InputError(
            f"{what} does not advance along the track at {_at(points, nodes[level[0]])}"
        )
    return nodes, starts


def _why_no_chain(
    points: np.ndarray, used: np.ndarray, degree: np.ndarray, n_pieces: int, what: str
) -> str:
    ends, branches = used[degree == 1], used[degree > 2]
    chain = "one simple chain" if n_pieces == 1 else f"{n_pieces} simple chains"
    if branches.size:
        return (
            f"{what} is not {chain}: more than two of its elements meet at "
            f"{_at(points, branches[0])}"
        )
    if ends.size != 2 * n_pieces and ends.size > 2:
        places = ", ".join(f"{x:g}" for x in np.sort(points[ends, 0])[:6])
        return (
            f"{what} is not {chain} but {ends.size // 2} separate ones, which end at x = "
            f"{places} m (nodes at the same place must be merged)"
        )
    return f"{what} is not {chain} in the order of x: it turns back or closes in itself"


def _check_lengths(points: np.ndarray, edges: np.ndarray, what: str) -> None:
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    short = np.flatnonzero(length < SAME_PLACE)
    if short.size:
        place = _at(points, edges[short[0], 0])
        raise InputError(f"{what} has an element of zero length at {place}")


def _find_droppers(
    points: np.ndarray, wires: dict[str, np.ndarray], edges: np.ndarray, joins: Droppers, what: str
) -> np.ndarray:
    """Upper and lower node of each dropper in order of x, (n, 2); chains are shortened to ends."""
    _check_lengths(points, edges, what)
    wire_of = np.full(points.shape[0], -1)
    for number, name in enumerate(wires):
        wire_of[wires[name]] = 2 + number
    wire_of[wires[joins.upper]], wire_of[wires[joins.lower]] = 0, 1
    ends = _ends_of_chains(points, wire_of >= 0, edges, joins, what)
    sides = wire_of[ends]
    wrong = np.flatnonzero((np.sort(sides, axis=1) != [0, 1]).any(axis=1))
    if wrong.size:
        first, last = ends[wrong[0]]
        found = [next(n for n in wires if node in wires[n]) for node in (first, last)]
        other = "itself" if found[0] == found[1] else found[1]
        raise InputError(
            f"{what}: the dropper from {_at(points, first)} to {_at(points, last)} joins "
            f"{found[0]} with {other}, but must join {joins.upper} and {joins.lower}"
        )
    ends = np.take_along_axis(ends, np.argsort(sides, axis=1), axis=1)
    ends = ends[np.lexsort((ends[:, 0], points[ends[:, 1], 0]))]
    _check_droppers(points, ends, joins, what)
    return ends


def _ends_of_chains(
    points: np.ndarray, on_wire: np.ndarray, edges: np.ndarray, joins: Droppers, what: str
) -> np.ndarray:
    """Nodes of wires that chains of elements join, (n, 2)."""
    on_wires = on_wire[edges].sum(axis=1)
    if (on_wires == 2).all():
        return np.array(edges, dtype=np.int64)
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    nodes, degree = np.unique(edges[~on_wire[edges]], return_counts=True)
    wrong = np.flatnonzero(degree != 2)
    if wrong.size:
        fault = "ends in the air" if degree[wrong[0]] == 1 else "branches"
        raise InputError(
            f"{what}: a dropper {fault} at {_at(points, nodes[wrong[0]])}, but must join "
            f"{joins.upper} and {joins.lower}"
        )
    between, outer = edges[on_wires == 0], edges[on_wires == 1]
    size, ones = len(points), np.ones(len(between))
    chain = connected_components(coo_matrix((ones, between.T), (size, size)), directed=False)[1]
    off, on = np.take_along_axis(outer, np.argsort(on_wire[outer], axis=1), axis=1).T
    loose = nodes[~np.isin(chain[nodes], chain[off])]
    if loose.size:
        raise InputError(f"{what}: the elements at {_at(points, loose[0])} join no wire")
    ends = on[np.argsort(chain[off], kind="stable")].reshape(-1, 2)
    return np.concatenate([edges[on_wires == 2], ends])


def _check_droppers(points: np.ndarray, ends: np.ndarray, joins: Droppers, what: str) -> None:
    """Refuse droppers that stand upside down, lean too far or lie on one another."""
    across = points[ends[:, 0]] - points[ends[:, 1]]
    inverted = np.flatnonzero(across[:, 2] < SAME_PLACE)
    if inverted.size:
        raise InputError(
            f"{what}: the dropper at {_at(points, ends[inverted[0], 1])} does not hang down: its "
            f"end on {joins.upper} must be above its end on {joins.lower}"
        )
    leaning = np.flatnonzero(np.abs(across[:, 0]) > _LEAN_LIMIT)
    if leaning.size:
        raise InputError(
            f"{what}: the dropper at {_at(points, ends[leaning[0], 1])} leans "
            f"{abs(across[leaning[0], 0]):.3g} m along the track, but at most {_LEAN_LIMIT:g} m is "
            "allowed"
        )
    # Both nodes as one number.
    distinct, count = np.unique(ends @ [len(points), 1], return_counts=True)
    if (count > 1).any():
        place = _at(points, int(distinct[np.argmax(count)]) % len(points))
        raise InputError(f"{what}: two droppers join the same nodes at {place}")


def _check_anchors(points: np.ndarray, ends: np.ndarray, anchors: np.ndarray, source: str) -> None:
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


def _renumber(
    groups: Groups,
    line: Line,
    wires: dict[str, np.ndarray],
    starts: dict[str, np.ndarray],
    droppers: list[np.ndarray],
) -> LineMesh:
    """The mesh with the wires' nodes only, numbered along the track, the upper wires' first.

    Neighbours along the track get neighbouring numbers, across all wires, so that matrices have a
    narrow band and their parts few neighbours.
    """
    points = groups.points
    used = np.concatenate([wires[wire.name] for wire in reversed(line.wires)])
    # x is rounded so that nodes of one station stay together whatever their last bits say.
    order = used[np.argsort(np.round(points[used, 0], 6), kind="stable")]
    number = np.full(points.shape[0], -1)
    number[order] = np.arange(order.size)

    def along(
        members: list[np.ndarray], shape: tuple[int, ...] = (0,)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Members of groups in order of x, and the number of each one's group."""
        nodes = np.concatenate([np.zeros(shape, dtype=np.int64), *members])
        group = np.repeat(np.arange(len(members)), [len(own) for own in members])
        place = nodes if nodes.ndim == 1 else nodes[:, -1]
        by_x = np.argsort(points[place, 0], kind="stable")
        return number[nodes[by_x]], group[by_x]

    hanging, dropper_group = along(droppers, (0, 2))
    arms, arm_group = along([groups.nodes[arms.name] for arms in line.steady_arms])
    supports, support_group = along([groups.nodes[own.name] for own in line.supports])
    clamps = [
        np.column_stack([_nearest(points, wires[name], own.x) for name in (own.upper, own.lower)])
        for own in line.clamps
    ]
    return LineMesh(
        points=points[order],
        wires={name: number[nodes] for name, nodes in wires.items()},
        droppers=hanging,
        steady_arms=arms,
        supports=supports,
        anchors=along([groups.nodes[ANCHORS]])[0],
        dropper_group=dropper_group,
        arm_group=arm_group,
        support_group=support_group,
        breaks={name: at[1:] for name, at in starts.items() if at.size > 1},
        clamps=number[np.concatenate([np.zeros((0, 2), dtype=np.int64), *clamps])],
    )


def _nearest(points: np.ndarray, nodes: np.ndarray, x: tuple[float, ...]) -> np.ndarray:
    """Nodes of a wire that are nearest to places ``x`` [m]; ``nodes`` are all, in order of x."""
    places = points[nodes, 0]
    between = 0.5 * (places[1:] + places[:-1])
    return np.asarray(nodes[np.searchsorted(between, np.array(x))])
