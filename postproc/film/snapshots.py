"""Reads the snapshots of ``fields.h5``, finished or not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.files.hdf5.self_contained import open_own
from catenary.postproc.read.guard import survives
from catenary.postproc.record.snapshots.blocks import ARMS, OTHER_PARTS
from catenary.postproc.record.snapshots.field_layout import PLACES, BlockTables
from catenary.postproc.record.snapshots.fields_schema import FieldsFault, read_fields

FIELDS_FILE = "fields.h5"
# Snapshots that are looked through for the largest uplift.
_SAMPLED = 400
# Times that are no further apart are the same [s].
_SAME_TIME = 1e-9
_UP = 2


@dataclass(frozen=True)
class _Wire:
    """A wire in snapshots.

    Attributes
    ----------
    block : its points, and which of them each snapshot shows
    start : (n_snapshots,) rows before those of a snapshot
    values : ``displacement`` if that was recorded, or ``uplift``
    rests : whether points that a snapshot does not show are at rest
    """

    block: BlockTables
    start: np.ndarray
    values: h5py.Dataset
    rests: bool

    @classmethod
    def of(cls, block: BlockTables, group: h5py.Group, rests: bool) -> _Wire:
        """That of a group of the file."""
        values = group["displacement" if "displacement" in group else "uplift"]
        return cls(block, np.cumsum(block.count) - block.count, values, rests)

    @property
    def has_vectors(self) -> bool:
        """Whether its motion along the track and sideways was recorded."""
        return self.values.ndim == 2

    @property
    def x(self) -> np.ndarray:
        """Places of its points along the track [m]."""
        return self.block.points[:, 0]

    def shown(self, number: int) -> tuple[int, int]:
        """Its first point in a snapshot, and the number of points."""
        return int(self.block.first[number]), int(self.block.count[number])

    def motion(self, number: int, first: int, count: int) -> np.ndarray:
        """Motion of ``count`` points from number ``first`` on in a snapshot, (count, 3) [m]."""
        begin = int(self.start[number]) + first - int(self.block.first[number])
        values = np.asarray(self.values[begin : begin + count], dtype=float)
        return values if self.has_vectors else values[:, None] * [0.0, 0.0, 1.0]


class Snapshots:
    """Motion of the nodes at the times of the snapshots. A context manager; not collective.

    Attributes
    ----------
    times : (n,) times of the snapshots that are there, ascending [s]
    parts : names of the wires and other parts of the line that are shown
    field : name of the field that lifts points, as ParaView's calculator has it
    whole : whether the motion of all nodes is known in each snapshot
    has_vectors : whether motions along the track and sideways are there, zero as they may be

    Parameters
    ----------
    folder : of a run, which may go on
    n_nodes : nodes of its line
    until : later snapshots are left out, as those of a run that goes on and whose records were read
        before [s]

    Raises
    ------
    InputError
        If the folder has no snapshots, or damaged ones, those of another line or without uplift.
    """

    def __init__(self, folder: Path, n_nodes: int, until: float = np.inf) -> None:
        path = folder / FIELDS_FILE
        if not path.is_file():
            raise InputError(
                f"{path} does not exist: a film needs snapshots of the line; run the scene again "
                "with an output.field_every_s above 0"
            )
        if not survives(path):
            raise InputError(f"{path} is damaged: HDF5 does not read it")
        self._path, self._n_nodes, self._until = path, n_nodes, until
        # Without a lock: a run may be writing it, or be continued while this is open.
        self._file = open_own(path, locking=False)
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        path, file = self._path, self._file
        try:
            tables = read_fields(file)
        except FieldsFault as error:
            if "uplift" in file:
                raise InputError(
                    f"{path} was written by an earlier version of Catenary; run the scene again"
                ) from error
            raise InputError(f"{path} is damaged: {error}") from error
        self.times = tables.times[tables.times <= self._until + _SAME_TIME]
        if self.times.size < 2:
            raise InputError(
                f"{path} has fewer than two snapshots; if its run has just begun, wait for more"
            )
        self.parts = tuple(tables.blocks)
        self._of_this_line = tables.n_nodes == self._n_nodes
        self._blocks, self._sizes = tables.blocks, tables.n_places
        wires = [name for name in self.parts if name not in OTHER_PARTS]
        if not all({"uplift", "displacement"} & set(file[name]) for name in wires):
            raise InputError(
                f"{path} has neither uplift nor displacement; run the scene again with one of "
                "them in output.fields"
            )
        self._wires = {
            name: _Wire.of(tables.blocks[name], file[name], tables.rests_beyond) for name in wires
        }
        scalar = all("uplift" in file[name] for name in wires)
        self.field = "uplift" if scalar else "displacement_Z"
        self.has_vectors = all(wire.has_vectors for wire in self._wires.values())
        shown = sum(w.x.size if w.rests else w.block.count for w in self._wires.values())
        self.whole = bool(np.all(shown == self._n_nodes))

    def __enter__(self) -> Snapshots:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._file.close()

    def arms(self) -> tuple[np.ndarray, np.ndarray]:
        """Hinges of the steady arms that are shown, (k, 3) [m], and nodes that they hold, (k,)."""
        if ARMS not in self.parts:
            return np.zeros((0, 3)), np.zeros(0, dtype=int)
        if not self._of_this_line:
            raise InputError(f"{self._path} does not belong to the run.h5 beside it")
        block = self._blocks[ARMS]
        return block.points[0::2], block.nodes[1::2]

    def shown(self, number: int) -> tuple[float, float]:
        """From and to of the wires whose motion a snapshot tells, as far as each reaches [m]."""
        ends = []
        for wire in self._wires.values():
            first, count = (0, wire.x.size) if wire.rests else wire.shown(number)
            ends.append(wire.x[[first, first + count - 1]])
        low, high = np.array(ends).reshape(-1, 2).T
        return float(low.min(initial=np.inf)), float(high.max(initial=-np.inf))

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs whose masses or bodies are known."""
        return int(self._sizes.size)

    def pantographs(self, number: int) -> list[tuple[float, np.ndarray]]:
        """Base, and masses or bodies, of each pantograph in a snapshot; see `mbs.interface`."""
        row = np.asarray(self._file[PLACES][number], dtype=float)
        if not np.isfinite(row).all():
            raise InputError(f"{self._path} is damaged at t = {self.times[number]:g} s")
        n = self._sizes.size
        places = np.split(row[n:], np.cumsum(self._sizes)[:-1]) if n else []
        return list(zip(row[:n].tolist(), places, strict=True))

    def need_whole(self, for_what: str) -> None:
        """Raise InputError unless each snapshot shows all nodes, as ``for_what`` needs."""
        if not self.whole:
            raise InputError(
                f"{self._path} shows a part of the line only, and {for_what} needs all of it; run "
                "the scene again without output.field_window_m, field_spans and field_parts"
            )

    def largest(self, numbers: np.ndarray, axis: int) -> float:
        """Largest motion along an axis (0, 1, 2 of x, y, z) in some snapshots, of many in so many
        of them that it is not far from that [m]; zero where nothing moves along it."""
        if axis != _UP and not self.has_vectors:
            return 0.0
        some = numbers[:: max(1, numbers.size // _SAMPLED)].tolist()
        moved = (np.abs(self.displacement(one)[:, axis]) for one in some)
        return max(0.0, *(float(np.nanmax(one)) for one in moved))

    def uplift(self, number: int) -> np.ndarray:
        """Uplift of the nodes in a snapshot, (n_nodes,) [m], as ``displacement``."""
        return self.displacement(number)[:, _UP]

    def displacement(self, number: int) -> np.ndarray:
        """Displacement of the nodes in a snapshot, NaN where it is not known, (n_nodes, 3) [m].

        Where the snapshots have the uplift alone, nothing moves along the track and sideways.

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        moved = np.full((self._n_nodes, 3), np.nan)
        valid = self._of_this_line
        try:
            for wire in self._wires.values() if valid else ():
                if wire.rests:
                    moved[wire.block.nodes] = 0.0
                first, count = wire.shown(number)
                shown = wire.motion(number, first, count)
                moved[wire.block.nodes[first : first + count]] = shown
                valid = valid and bool(np.isfinite(shown).all())
        except (IndexError, KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(
                f"{self._path} is damaged at t = {self.times[number]:g} s: {error}"
            ) from error
        if not valid:
            raise InputError(
                f"{self._path} does not belong to the run.h5 beside it, or is damaged at "
                f"t = {self.times[number]:g} s"
            )
        return moved

    def aside_at(self, number: int, name: str, x: float) -> float:
        """How far a wire has moved to the left at a place along the track in a snapshot, zero
        where it is not shown [m]."""
        return float(self._motion_at(number, name, x)[1]) if name in self._wires else 0.0

    def uplift_at(self, number: int, name: str, x: float) -> float:
        """How far a wire has risen at a place along the track in a snapshot, NaN where it is not
        shown [m]."""
        return float(self._motion_at(number, name, x)[_UP]) if name in self._wires else np.nan

    def _motion_at(self, number: int, name: str, x: float) -> np.ndarray:
        """Motion of a wire between two of its points, (3,) [m]."""
        wire = self._wires[name]
        first, count = wire.shown(number)
        last = first + count - 2
        if wire.rests and not wire.x[first] <= x <= wire.x[last + 1]:
            return np.zeros(3)
        at = int(np.clip(wire.x.searchsorted(x) - 1, first, max(first, last)))
        values = wire.motion(number, at, 2)
        return np.array([np.interp(x, wire.x[at : at + 2], column) for column in values.T])
