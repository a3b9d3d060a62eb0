"""What snapshots may show: the blocks of a line as it stands at rest, and the fields of these.

A block is a row of points along the track: of each wire, of droppers, clamps, steady arms and
masts. Of a wire each point is a node, and cells join neighbours. Of everything else two points make
a cell: the upper and the lower end. ``KINDS`` is the one table of what can be recorded, of which
blocks, and from what; scene, recorder, files and readers follow from it.

In their file all values of a field and block stand one after another in one table, snapshot by
snapshot. Which points a snapshot shows follows from the course of the train, so that their places
(`Slots`) are known before the first step, and a window takes no more room than it shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple, TypeVar

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import DROPPERS, LineMesh
from catenary.solver.model.rest_shape import LateralShape

CLAMPS, ARMS, MASTS = "clamps", "steady_arms", "masts"
# Parts of a line that are no wires.
OTHER_PARTS = (DROPPERS, CLAMPS, ARMS, MASTS)
# Node of a point that stays where it is.
FIXED = -1
# Masts stand beside the track, a little higher than the highest wire; arms come down to the wire
# from there [m].
BESIDE, _ABOVE, _ARM_RISE = 3.0, 0.4, 0.3
_NONE = np.zeros(0, dtype=np.int64)
_Count = TypeVar("_Count", int, np.ndarray)
# Unknowns of a node that fields are made of: upward and lateral displacement, slopes dw/dx and
# dv/dx, and displacement along the track.
UP, ASIDE, SLOPE, TURN, ALONG = "w", "v", "theta_y", "theta_z", "u"
USUAL_FIELDS = ("uplift", "displacement")
# Format of the file, its attribute ``format``.
FORMAT = "catenary-fields-2"
# Places of the pantographs' bases, masses and bodies, and how many numbers each has.
PLACES, SIZES = "pantograph_places", "pantograph_sizes"
# Its attribute that is 1 where wires are at rest at all points that a snapshot does not show.
RESTS_BEYOND = "rests_beyond"
# More than HDF5's tables take for a dataset or a group with its attributes [bytes].
_TABLES = 1024


class RecordedLine(NamedTuple):
    """The line that snapshots show.

    Attributes
    ----------
    line, mesh : as an engineer describes it, and its mesh
    slope : (n_nodes,) dw/dx of the wires at rest
    lateral : of the wires at rest sideways, None without lateral motion
    """

    line: Line
    mesh: LineMesh
    slope: np.ndarray
    lateral: LateralShape | None = None


@dataclass(frozen=True)
class Block:
    """A part of a line at rest.

    Attributes
    ----------
    name : of the wire, or one of ``OTHER_PARTS``
    nodes : (n,) node of the line that each point moves with, ``FIXED`` for one that stays
    points : (n, 3) at rest [m], in order of x
    pairs : whether each two points are a cell; neighbours are otherwise
    breaks : (k,) points at which further pieces of a wire begin
    first : number of the first cell's dropper, clamp or arm in the line
    """

    name: str
    nodes: np.ndarray
    points: np.ndarray
    pairs: bool
    breaks: np.ndarray = field(default_factory=lambda: _NONE)
    first: int = 0

    @property
    def is_wire(self) -> bool:
        """Whether it is a wire."""
        return not self.pairs

    @property
    def moves(self) -> bool:
        """Whether any of its points does."""
        return bool((self.nodes != FIXED).any())

    def range_over(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First point and number of points of a cell at least, from ``low`` to ``high`` along the
        track [m]; shapes as of these.

        Where nothing stands between them it is the nearest cell.
        """
        step = 2 if self.pairs else 1
        x = self.points[step - 1 :: step, 0]
        least = 1 if self.pairs else 2
        begin = np.searchsorted(x, low)
        begin = np.clip(begin, 0, max(x.size - least, 0))
        end = np.clip(np.searchsorted(x, high, side="right"), begin + least, x.size)
        return step * begin, step * (end - begin)

    def cells(self, first: int, count: int) -> np.ndarray:
        """Cells (m, 2) int32 of ``count`` points from ``first`` on, numbered from there."""
        if self.pairs:
            return np.arange(count, dtype=np.int32).reshape(-1, 2)
        left = np.arange(max(count - 1, 0), dtype=np.int32)
        here = self.breaks[(self.breaks > first) & (self.breaks < first + count)]
        return np.delete(np.column_stack([left, left + 1]), here - first - 1, axis=0)

    def between(self, low: float, high: float) -> Block:
        """The part of it between two places [m]."""
        begin, size = self.range_over(np.array(low), np.array(high))
        first, count = int(begin), int(size)
        own = slice(first, first + count)
        breaks = self.breaks[(self.breaks > first) & (self.breaks < first + count)] - first
        start = self.first + first // 2 if self.pairs else 0
        return replace(
            self, nodes=self.nodes[own], points=self.points[own], breaks=breaks, first=start
        )


def blocks_of(line: RecordedLine, points: np.ndarray) -> list[Block]:
    """All blocks of a line whose nodes rest at ``points`` (n_nodes, 3) [m]. Not collective."""
    mesh, masts = line.mesh, line.line.support_positions
    blocks = [
        Block(name, np.asarray(nodes), points[nodes], False, mesh.breaks.get(name, _NONE))
        for name, nodes in mesh.wires.items()
    ]
    for name, pairs in ((DROPPERS, mesh.droppers), (CLAMPS, mesh.clamps)):
        nodes = np.asarray(pairs, dtype=np.int64).ravel()
        if nodes.size:
            blocks.append(Block(name, nodes, points[nodes], True))
    if mesh.steady_arms.size:
        blocks.append(_arms(mesh.steady_arms, points))
    if masts.size:
        blocks.append(_masts(masts, float(points[:, 2].max()) + _ABOVE))
    return blocks


def _arms(held: np.ndarray, points: np.ndarray) -> Block:
    """Steady arms, from their masts down to the nodes that are ``held``."""
    wire = points[held]
    hinge = np.column_stack([wire[:, 0], np.full(len(wire), BESIDE), wire[:, 2] + _ARM_RISE])
    nodes = np.column_stack([np.full(len(wire), FIXED), held]).ravel()
    return Block(ARMS, nodes, np.stack([hinge, wire], axis=1).reshape(-1, 3), True)


def _masts(x: np.ndarray, top: float) -> Block:
    """Masts at ``x`` (n,) beside the track, from the ground up to a height [m]."""
    n = x.size
    ends = np.zeros((n, 2, 3))
    ends[:, :, 0], ends[:, :, 1] = x[:, None], BESIDE
    ends[:, 0, 2] = top
    return Block(MASTS, np.full(2 * n, FIXED), ends.reshape(-1, 3), True)


@dataclass(frozen=True)
class FieldKind:
    """A field of snapshots.

    Attributes
    ----------
    name : of the field in files
    unit : SI unit, "-" if none
    meaning : description with its sign, in words
    components : numbers of a value
    motions : unknowns that it takes at all nodes, each with whether their rate is meant: of a field
        that is motion itself those of its components
    of_wires : whether wires alone have it, and not other blocks that move
    of_droppers : whether it belongs to the cells of the droppers
    only_with : unknown without which it takes no motion, "" if it always does
    number : how it is stored, a type of NumPy
    """

    name: str
    unit: str
    meaning: str
    components: int = 1
    motions: tuple[tuple[str, bool], ...] = ()
    of_wires: bool = False
    of_droppers: bool = False
    only_with: str = ""
    number: str = "<f4"

    @property
    def item_bytes(self) -> int:
        """Bytes of a value."""
        return int(self.number[-1]) * self.components

    def motions_of(self, unknowns: Sequence[str]) -> list[tuple[str, bool]]:
        """The ``motions`` that it needs where nodes have these unknowns."""
        if self.only_with and self.only_with not in unknowns:
            return []
        return [motion for motion in self.motions if motion[0] in unknowns]

    def belongs_to(self, block: Block) -> bool:
        """Whether a block has it."""
        if self.of_droppers:
            return block.name == DROPPERS
        return block.is_wire if self.of_wires else block.moves

    def values_of(self, n_points: _Count) -> _Count:
        """Number of values of blocks with so many points."""
        return n_points // 2 if self.of_droppers else n_points


KINDS: dict[str, FieldKind] = {
    kind.name: kind
    for kind in (
        FieldKind("uplift", "m", "displacement upward from rest", motions=((UP, False),)),
        FieldKind(
            "displacement",
            "m",
            "displacement from rest along x, y, z",
            components=3,
            motions=((ALONG, False), (ASIDE, False), (UP, False)),
        ),
        FieldKind(
            "velocity",
            "m/s",
            "velocity along x, y, z",
            components=3,
            motions=((ALONG, True), (ASIDE, True), (UP, True)),
        ),
        FieldKind(
            "tension",
            "N",
            "tension of the wire ahead of the point, with what its stretch adds where wires move "
            "along the track",
            motions=tuple((name, False) for name in (UP, SLOPE, ASIDE, TURN, ALONG)),
            only_with=ALONG,
            of_wires=True,
        ),
        FieldKind(
            "bending_moment",
            "N m",
            "EI d2w/dx2 of the wire as it hangs, mean of both sides of a node; above 0 where it "
            "curves upward",
            motions=((UP, False), (SLOPE, False)),
            of_wires=True,
        ),
        FieldKind("dropper_force", "N", "tension, negative in compression", of_droppers=True),
        FieldKind(
            "dropper_state",
            "-",
            "1 taut, 0 slack or broken, -1 in compression",
            of_droppers=True,
            number="|i1",
        ),
    )
}

# Fields that a scene may choose: the state of droppers comes with their force.
FIELDS = tuple(name for name in KINDS if name != "dropper_state")


def kinds_of(chosen: tuple[str, ...]) -> tuple[FieldKind, ...]:
    """The kinds that chosen fields bring, in the order of the table."""
    names = {*chosen, *(("dropper_state",) if "dropper_force" in chosen else ())}
    return tuple(kind for name, kind in KINDS.items() if name in names)


@dataclass(frozen=True)
class Course:
    """Places of the last and the first pantograph at time zero [m], and their speed [m/s]."""

    last: float
    first: float
    speed: float


@dataclass(frozen=True)
class FieldRecord:
    """Recorded part of the fields.

    Attributes
    ----------
    fields : names of `contents.FIELDS`
    parts : names of wires and `contents.OTHER_PARTS`, None for all
    stretch : from and to along the track [m], None for the whole line
    window : how far behind the last and ahead of the first pantograph [m], None for everything
    course : of the train, for the window
    wave_speed : at which the window also grows from where the pantographs started [m/s]
    rests_beyond : whether the line is at rest outside of the window
    """

    fields: tuple[str, ...] = USUAL_FIELDS
    parts: tuple[str, ...] | None = None
    stretch: tuple[float, float] | None = None
    window: tuple[float, float] | None = None
    course: Course = Course(0.0, 0.0, 0.0)
    wave_speed: float = 0.0
    rests_beyond: bool = False

    @property
    def kinds(self) -> tuple[FieldKind, ...]:
        """Kinds of the fields."""
        return kinds_of(self.fields)

    def chosen(self, blocks: list[Block]) -> list[Block]:
        """The selected blocks, cut to the recorded stretch."""
        chosen = [one for one in blocks if self.parts is None or one.name in self.parts]
        if self.stretch is not None:
            chosen = [block.between(*self.stretch) for block in chosen]
        return chosen

    @property
    def is_whole(self) -> bool:
        """Whether all of the line is recorded."""
        return self.parts is None and self.stretch is None and self.window is None

    def needed(self, blocks: list[Block], times: np.ndarray, n_nodes: int) -> np.ndarray:
        """Nodes without which snapshots cannot be made, (n_nodes,) bool.

        Parameters
        ----------
        blocks : list of Block
            Recorded blocks, see ``chosen``.
        times : ndarray
            Times of successive snapshots, of which the first and the last are enough
            [s].
        n_nodes : int
            Number of nodes of the line.
        """
        needed = np.zeros(n_nodes, dtype=bool)
        for block in blocks:
            first, count = block.range_over(*self.edges(times))
            # Values from slopes take the neighbours of a wire's point as well.
            more = int(block.is_wire)
            begin = max(int(first.min()) - more, 0)
            nodes = block.nodes[begin : int((first + count).max()) + more]
            needed[nodes[nodes != FIXED]] = True
        return needed

    def edges(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From and to of the window at times [s], shapes as those [m]."""
        if self.window is None:
            return np.full(times.shape, -np.inf), np.full(times.shape, np.inf)
        (behind, ahead), speed = self.window, self.course.speed
        back = -self.wave_speed if self.wave_speed else speed
        forth = max(speed, self.wave_speed)
        return self.course.last + back * times - behind, self.course.first + forth * times + ahead


@dataclass(frozen=True)
class BlockTables:
    """The tables of a block in the file, beside its fields.

    Attributes
    ----------
    points : (n_points, 3) at rest [m]
    nodes : (n_points,) node of the line that each moves with, ``FIXED`` for one that stays
    cells : (k, 2) of all snapshots, or of the largest one if they are the same
    first, count : (n_snapshots,) points that each snapshot shows
    cell_first, cell_count : (n_snapshots,) which of the cells a snapshot has
    """

    points: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    first: np.ndarray
    count: np.ndarray
    cell_first: np.ndarray
    cell_count: np.ndarray

    def tables(self) -> dict[str, np.ndarray]:
        """All of them by name."""
        return {own.name: getattr(self, own.name) for own in fields(BlockTables)}


@dataclass(frozen=True)
class Slots(BlockTables):
    """The places of a block's values in its tables.

    Attributes
    ----------
    block : the block
    kinds : its fields
    start : (n_snapshots + 1,) of a snapshot's first point among those of all snapshots
    """

    block: Block
    kinds: tuple[FieldKind, ...]
    start: np.ndarray

    @property
    def name(self) -> str:
        """Name of the block."""
        return self.block.name

    def rows(self, kind: FieldKind) -> int:
        """Values of a field in all snapshots."""
        return kind.values_of(int(self.start[-1]))

    def row_at(self, kind: FieldKind, snapshot: int) -> int:
        """Number of the first value of a snapshot."""
        return kind.values_of(int(self.start[snapshot]))

    def bytes(self) -> int:
        """Size of its tables [B]."""
        of_fields = sum(kind.item_bytes * self.rows(kind) for kind in self.kinds)
        tables = sum(table.nbytes for table in self.tables().values())
        return of_fields + tables + (7 + len(self.kinds)) * _TABLES


def layout_of(record: FieldRecord, blocks: list[Block], times: np.ndarray) -> list[Slots]:
    """Places of all blocks that the ``record`` chooses, at snapshots of ``times`` [s]. Not
    collective."""
    return [_slots(record, block, times) for block in record.chosen(blocks)]


def _slots(record: FieldRecord, block: Block, times: np.ndarray) -> Slots:
    first, count = block.range_over(*record.edges(times))
    moves = bool(np.ptp(first) or np.ptp(count))
    if block.breaks.size and moves:
        own = [block.cells(a, n) for a, n in zip(first.tolist(), count.tolist(), strict=True)]
        cells = np.concatenate(own)
        cell_count = np.array([len(one) for one in own])
        cell_first = np.cumsum(cell_count) - cell_count
    else:
        largest = int(count.argmax())
        cells = block.cells(int(first[largest]), int(count[largest]))
        cell_first = np.zeros_like(count)
        cell_count = np.full_like(count, len(cells))
        if moves:
            cell_count = count // 2 if block.pairs else count - 1
    start = np.concatenate([[0], np.cumsum(count)])
    kinds = tuple(kind for kind in record.kinds if kind.belongs_to(block))
    return Slots(
        points=block.points.astype("<f8"),
        nodes=block.nodes.astype("<i8"),
        cells=cells.astype("<i4"),
        first=first.astype("<i8"),
        count=count.astype("<i8"),
        cell_first=cell_first.astype("<i8"),
        cell_count=cell_count.astype("<i8"),
        block=block,
        kinds=kinds,
        start=start,
    )
