"""Reads the snapshots of ``fields.h5``, finished or not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.files.hdf5.self_contained import open_own
from catenary.postproc.read.guard import survives
from catenary.postproc.record.snapshots.blocks import ARMS, OTHER_PARTS
from catenary.postproc.record.snapshots.field_layout import PLACES
from catenary.postproc.record.snapshots.fields_schema import BlockTables, FieldsFault, read_fields

FIELDS_FILE = "fields.h5"
# Snapshots that are looked through for the largest uplift.
_SAMPLED = 400
# Times that are no further apart are the same [s].
_SAME_TIME = 1e-9
_UP = 2


@dataclass(frozen=True)
class _Wire:
    """What snapshots show of a wire: nodes and places of its points, rows of each snapshot.

    ``rests`` is whether points that a snapshot does not show are at rest.
    """

    nodes: np.ndarray
    x: np.ndarray
    first: np.ndarray
    count: np.ndarray
    start: np.ndarray
    values: h5py.Dataset
    vectors: h5py.Dataset | None
    rests: bool

    def rows(self, number: int, first: int, count: int) -> slice:
        """Rows of its tables with ``count`` points from number ``first`` on in a snapshot."""
        begin = int(self.start[number]) + first - int(self.first[number])
        return slice(begin, begin + count)


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
        self._wires = [
            _wire(tables.blocks[name], file[name], tables.rests_beyond) for name in wires
        ]
        scalar = all("uplift" in file[name] for name in wires)
        self.field = "uplift" if scalar else "displacement_Z"
        self.has_vectors = all(wire.vectors is not None for wire in self._wires)
        shown = sum(wire.x.size if wire.rests else wire.count for wire in self._wires)
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
        ends = [
            wire.x[[0, -1]]
            if wire.rests
            else wire.x[[int(wire.first[number]), int(wire.first[number] + wire.count[number]) - 1]]
            for wire in self._wires
        ]
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
        some = numbers[:: max(1, numbers.size // _SAMPLED)].tolist()
        if axis == _UP:
            return max(0.0, *(float(np.nanmax(np.abs(self.uplift(one)))) for one in some))
        if not self.has_vectors:
            return 0.0
        return max(
            0.0, *(float(np.nanmax(np.abs(self.displacement(one)[:, axis]))) for one in some)
        )

    def uplift(self, number: int) -> np.ndarray:
        """Uplift of the nodes in a snapshot, NaN where it is not known, (n_nodes,) [m].

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        uplift = self._before(())
        for nodes, values in self._shown(number, vectors=False):
            uplift[nodes] = values if values.ndim == 1 else values[:, _UP]
        return uplift

    def displacement(self, number: int) -> np.ndarray:
        """Displacement of the nodes in a snapshot, NaN where it is not known, (n_nodes, 3) [m].

        Where the snapshots have the uplift alone, nothing moves along the track and sideways.

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        moved = self._before((3,))
        for nodes, values in self._shown(number, vectors=self.has_vectors):
            if values.ndim == 1:
                moved[nodes, :_UP], moved[nodes, _UP] = 0.0, values
            else:
                moved[nodes] = values
        return moved

    def aside_at(self, number: int, name: str, x: float) -> float:
        """How far a wire has moved to the left at a place along the track in a snapshot [m]."""
        if not self.has_vectors or name not in self.parts:
            return 0.0
        wire = self._wire(name)
        assert wire.vectors is not None
        return _between(wire, number, x, wire.vectors, 1)

    def uplift_at(self, number: int, name: str, x: float) -> float:
        """How far a wire has risen at a place along the track in a snapshot, NaN where it is not
        shown [m]."""
        if name not in self.parts:
            return np.nan
        wire = self._wire(name)
        return _between(wire, number, x, wire.values, _UP)

    def _before(self, shape: tuple[int, ...]) -> np.ndarray:
        """Motion of the nodes that a snapshot does not show: zero at rest, NaN if not known.

        Parameters
        ----------
        shape : of the motion of one node
        """
        motion = np.full((self._n_nodes, *shape), np.nan)
        for wire in self._wires if self._of_this_line else ():
            if wire.rests:
                motion[wire.nodes] = 0.0
        return motion

    def _wire(self, name: str) -> _Wire:
        return self._wires[[part for part in self.parts if part not in OTHER_PARTS].index(name)]

    def _shown(self, number: int, vectors: bool) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Nodes of each wire that a snapshot shows, and their values, which are finite."""
        sound = self._of_this_line
        try:
            for wire in self._wires if sound else ():
                first, count = int(wire.first[number]), int(wire.count[number])
                table = wire.vectors if vectors and wire.vectors is not None else wire.values
                values = np.asarray(table[wire.rows(number, first, count)], dtype=float)
                sound = sound and bool(np.isfinite(values).all())
                if sound:
                    yield wire.nodes[first : first + count], values
        except (IndexError, KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(
                f"{self._path} is damaged at t = {self.times[number]:g} s: {error}"
            ) from error
        if not sound:
            raise InputError(
                f"{self._path} does not belong to the run.h5 beside it, or is damaged at "
                f"t = {self.times[number]:g} s"
            )


def _between(wire: _Wire, number: int, x: float, table: h5py.Dataset, axis: int) -> float:
    """Value of a table in a snapshot between the two points of a wire next to a place."""
    first = int(wire.first[number])
    last = first + int(wire.count[number]) - 2
    if wire.rests and not wire.x[first] <= x <= wire.x[last + 1]:
        return 0.0
    at = int(np.clip(wire.x.searchsorted(x) - 1, first, max(first, last)))
    values = np.asarray(table[wire.rows(number, at, 2)], dtype=float)
    if values.ndim > 1:
        values = values[:, axis]
    return float(np.interp(x, wire.x[at : at + 2], values))


def _wire(block: BlockTables, group: h5py.Group, rests: bool) -> _Wire:
    start = np.cumsum(block.count) - block.count
    values = group["uplift" if "uplift" in group else "displacement"]
    x, vectors = block.points[:, 0], group.get("displacement")
    return _Wire(block.nodes, x, block.first, block.count, start, values, vectors, rests)
