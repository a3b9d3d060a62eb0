"""Places of the values of snapshots in their file, known before the first step.

All values of a field and block stand one after another in one table, snapshot by snapshot. Which
points a snapshot shows follows from the course of the train, so that a window around it takes no
more room than it shows.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from catenary.postproc.record.snapshots.contents import (
    FIXED,
    USUAL_FIELDS,
    Block,
    FieldKind,
    kinds_of,
)

# Format of the file, its attribute ``format``.
FORMAT = "catenary-fields-2"
# Places of the pantographs' bases, masses and bodies, and how many numbers each has.
PLACES, SIZES = "pantograph_places", "pantograph_sizes"
# Its attribute that is 1 where wires are at rest at all points that a snapshot does not show.
RESTS_BEYOND = "rests_beyond"
# More than HDF5's tables take for a dataset or a group with its attributes [bytes].
_TABLES = 1024


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
