"""VTKHDF beside XDMF: the same snapshots for programs that read VTK's own format.

One grid of lines that changes with time, in which the cell array ``part`` says what a line belongs
to. VTK 9.3 knows no collections of grids in this format, and VTK 9.7 shows a collection at its
first step whatever time is wanted; a single grid is read by all.

The file has the lines between points, and tables that are views (HDF5's virtual datasets) of those
in ``fields.h5``: no field is stored twice. It is written when a run ends, as the format has no
place for snapshots to come. Source: VTK's documentation, VTKHDF format specification, version 2.3:
unstructured grid with ``Steps``.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from h5py import h5d, h5p, h5s, h5t

from catenary.postproc.files.disk import appears_whole, open_to_write
from catenary.postproc.files.hdf5.array_writes import (
    group_in_order,
    put_array,
    put_attribute,
    put_text,
    whole_array,
)
from catenary.postproc.files.hdf5.checked import text_of
from catenary.postproc.files.hdf5.self_contained import open_own
from catenary.postproc.record.snapshots.field_kinds import KINDS, FieldKind

SUFFIX = ".vtkhdf"
# The cell array with the number of the part, and the attribute with the parts' names in this order.
PART, PARTS = "part", "parts"
_VERSION = np.array([2, 3], dtype=np.int64)
_LINE = 3  # VTK's number of this cell
# Rows of uneven sizes that are selected together; the time for it grows with their square.
_TOGETHER = 128
# The state of a cell that is no dropper.
NO_DROPPER = 2


def write_vtkhdf(numbers: Path) -> Path:
    """Write the file beside that of the numbers, which is whole; returns its path.

    Not collective.

    Raises
    ------
    OSError, KeyError, ValueError
        If the numbers cannot be read, or the file not written.
    """
    path = numbers.with_suffix(SUFFIX)
    with open_own(numbers, locking=False) as source, appears_whole(path) as part:
        times = whole_array(source, "times")
        n = int(np.isfinite(times).sum())
        names = json.loads(text_of(source.attrs["parts"]))
        blocks = [_Block.of(source[name], n) for name in names]
        # Readers go through links in the order in which they were made.
        with open_to_write(part, "w", track_order=True, libver="v110") as file:
            root = group_in_order(file, "VTKHDF")
            put_attribute(root, "Version", _VERSION)
            kind = h5py.string_dtype("ascii", len("UnstructuredGrid"))
            put_attribute(root, "Type", np.array(b"UnstructuredGrid", dtype=kind))
            put_text(root, PARTS, json.dumps(names))
            _Writer(root, numbers.name, blocks, times).write()
    return path


@dataclass(frozen=True)
class _Block:
    """A block of snapshots: its tables at rest, and its group in the file of the numbers.

    ``first``, ``count``, ``cell_first``, ``cell_count`` are (n,) for n snapshots, see `Slots`.
    """

    group: h5py.Group
    points: np.ndarray
    cells: np.ndarray
    first: np.ndarray
    count: np.ndarray
    cell_first: np.ndarray
    cell_count: np.ndarray

    @classmethod
    def of(cls, group: h5py.Group, n: int) -> _Block:
        """That of a group, at its first ``n`` snapshots."""
        tables = (whole_array(group, name) for name in ("points", "cells"))
        ranges = (
            whole_array(group, name)[:n] for name in ("first", "count", "cell_first", "cell_count")
        )
        return cls(group, *tables, *ranges)

    def path(self, table: str) -> bytes:
        """Where a table of it stands in its file."""
        return f"{self.group.name}/{table}".encode()


class _Writer:
    """Writes the grid. Not collective.

    Parameters
    ----------
    root : group of the grid
    h5_name : file of the numbers, relative to that of the grid
    blocks : parts of the grid, in the order of their points and cells
    times : of the snapshots that were planned, NaN where there is none [s]
    """

    def __init__(
        self, root: h5py.Group, h5_name: str, blocks: list[_Block], times: np.ndarray
    ) -> None:
        self._root, self._h5_name, self._blocks = root, h5_name, blocks
        self._times = times[np.isfinite(times)]
        self._is_complete = self._times.size == times.size
        self._n_points = _columns([block.count for block in blocks])
        self._n_cells = _columns([block.cell_count for block in blocks])

    def write(self) -> None:
        """Write all tables of it."""
        n, n_points = self._times.size, self._n_points.sum(axis=1)
        steps = group_in_order(self._root, "Steps")
        put_attribute(steps, "NSteps", np.asarray(n))
        if self._is_complete:
            # Views of a file that is not there hold what stands beside: a line that never moves.
            # Without the times, which are a link into that file, readers refuse.
            steps.id.links.create_external(b"Values", self._h5_name.encode(), b"/times")
        else:
            put_array(steps, "Values", self._times)
        cell_offsets, set_of, part_of_cells = self._write_cells()
        _put_all(
            steps,
            PartOffsets=set_of,
            NumberOfParts=np.ones(n, dtype=np.int64),
            PointOffsets=self._write_points(),
            CellOffsets=cell_offsets.reshape(-1, 1),
            ConnectivityIdOffsets=2 * cell_offsets.reshape(-1, 1),
        )
        groups = {
            kind: (
                group_in_order(self._root, f"{kind}Data"),
                group_in_order(steps, f"{kind}DataOffsets"),
            )
            for kind in ("Point", "Cell")
        }
        values, offsets = groups["Cell"]
        _put_packed(values, **{PART: part_of_cells})
        put_array(offsets, PART, cell_offsets)
        starts = {"Point": _before(n_points), "Cell": _before(self._n_cells.sum(axis=1))}
        for kind in KINDS.values():
            if any(kind.name in block.group for block in self._blocks):
                where = "Cell" if kind.of_droppers else "Point"
                values, offsets = groups[where]
                self._view_field(values, kind)
                put_array(offsets, kind.name, starts[where])

    def _write_points(self) -> np.ndarray:
        """Points at rest; returns where those of each snapshot begin, (n,)."""
        n = self._times.size
        still = all(not (np.ptp(b.first) or np.ptp(b.count)) for b in self._blocks)
        if still:
            shown = [b.points[b.first[0] : b.first[0] + b.count[0]] for b in self._blocks]
            put_array(self._root, "Points", np.concatenate(shown))
            return np.zeros(n, dtype=np.int64)
        n_points = self._n_points.sum(axis=1)
        shape = int(n_points.sum()), 3
        view = _View(shape, np.dtype("<f8"), 0.0, self._h5_name)
        starts = _before(n_points)[:, None] + _before_in_rows(self._n_points)
        for block, begin in zip(self._blocks, starts.T, strict=True):
            for first, count, at in zip(block.first, block.count, begin, strict=True):
                place = [(int(at), int(count))]
                view.add(place, block.path("points"), block.points.shape, int(first))
        view.create(self._root, "Points")
        return _before(n_points)

    def _write_cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lines between points, once for snapshots with the same ones.

        Returns where those of each snapshot begin, (n,), which set of lines it has, (n,), and the
        part of each line of all sets.
        """
        cut = [
            column for b in self._blocks for column in (b.cell_first, b.cell_count, b.count)
        ]  # fmt: skip
        sets, shown_by, set_of = np.unique(
            _columns(cut), axis=0, return_index=True, return_inverse=True
        )
        set_of = set_of.reshape(-1).astype(np.int64)
        ends = [self._lines_at(int(snapshot)) for snapshot in shown_by]
        n_cells = np.array([len(lines) for lines in ends], dtype=np.int64)
        parts = [np.repeat(np.arange(len(self._blocks)), self._n_cells[k]) for k in shown_by]
        _put_packed(
            self._root,
            Connectivity=np.concatenate(ends).ravel(),
            Offsets=np.concatenate([2 * np.arange(size + 1) for size in n_cells.tolist()]),
            Types=np.full(int(n_cells.sum()), _LINE, dtype=np.uint8),
        )
        _put_all(
            self._root,
            NumberOfPoints=self._n_points[shown_by].sum(axis=1),
            NumberOfCells=n_cells,
            NumberOfConnectivityIds=2 * n_cells,
        )
        return _before(n_cells)[set_of], set_of, np.concatenate(parts).astype(np.int32)

    def _lines_at(self, snapshot: int) -> np.ndarray:
        """Points of the lines of a snapshot, (m, 2), numbered through all blocks."""
        before = _before(self._n_points[snapshot])
        return np.concatenate(
            [
                b.cells[b.cell_first[snapshot] :][: b.cell_count[snapshot]].astype(np.int64) + first
                for b, first in zip(self._blocks, before.tolist(), strict=True)
            ]
        )

    def _view_field(self, group: h5py.Group, kind: FieldKind) -> None:
        """A table of a field of all points or cells, a view of those that its blocks have."""
        sizes = self._n_cells if kind.of_droppers else self._n_points
        starts = _before(sizes.sum(axis=1))[:, None] + _before_in_rows(sizes)
        width = () if kind.components == 1 else (kind.components,)
        # Beside the blocks with a field nothing moves; a force or moment there is none.
        beside = np.nan if kind.of_wires or kind.of_droppers else 0.0
        if kind.number == "|i1":
            beside = NO_DROPPER
        view = _View((int(sizes.sum()), *width), np.dtype(kind.number), beside, self._h5_name)
        for number, block in enumerate(self._blocks):
            if kind.name in block.group:
                rows = list(zip(starts[:, number].tolist(), sizes[:, number].tolist(), strict=True))
                whole = h5d.open(block.group.id, kind.name.encode()).shape
                view.add(rows, block.path(kind.name), whole, 0)
        view.create(group, kind.name)


class _View:
    """A virtual dataset: rows of it are rows of tables in another file. Not collective.

    Parameters
    ----------
    shape, dtype : of it
    beside : value of rows that are no table's
    file : the other file
    """

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype, beside: float, file: str) -> None:
        self._shape, self._file = shape, file.encode()
        self._kind = h5t.py_create(dtype)
        self._how = h5p.create(h5p.DATASET_CREATE)
        self._how.set_fill_value(np.array(beside, dtype=dtype))

    def add(
        self, rows: list[tuple[int, int]], table: bytes, whole: tuple[int, ...], first: int
    ) -> None:
        """Show rows of a table.

        Parameters
        ----------
        rows : first and number of rows of the view, in ascending order and apart
        table, whole : its path and shape
        first : of its rows, of which as many follow one another as ``rows`` are together
        """
        for begin in range(0, len(rows), _TOGETHER):
            part = rows[begin : begin + _TOGETHER]
            n = sum(size for _, size in part)
            here = _selected(self._shape, part)
            self._how.set_virtual(here, self._file, table, _selected(whole, [(first, n)]))
            first += n

    def create(self, group: h5py.Group, name: str) -> None:
        """Make the dataset."""
        h5d.create(group.id, name.encode(), self._kind, h5s.create_simple(self._shape), self._how)


def _selected(shape: tuple[int, ...], rows: Sequence[tuple[int, int]]) -> h5s.SpaceID:
    """A space of which some rows are selected; those that are alike and evenly apart at once."""
    space = h5s.create_simple(shape)
    width = shape[1:]
    rest, one = (0,) * len(width), (1,) * len(width)
    begin, size = rows[0]
    apart = rows[1][0] - begin if len(rows) > 1 else size
    if all(row == (begin + k * apart, size) for k, row in enumerate(rows)):
        space.select_hyperslab((begin, *rest), (len(rows), *one), (apart, *one), (size, *width))
        return space
    space.select_none()
    for first, count in rows:
        space.select_hyperslab((first, *rest), (1, *one), None, (count, *width), op=h5s.SELECT_OR)
    return space


def _columns(columns: list[np.ndarray]) -> np.ndarray:
    return np.column_stack(columns).astype(np.int64)


def _before(sizes: np.ndarray) -> np.ndarray:
    """Sums of what stands before each entry, (n,)."""
    return np.cumsum(sizes) - sizes


def _before_in_rows(sizes: np.ndarray) -> np.ndarray:
    """The same along each row, (n, m)."""
    return np.cumsum(sizes, axis=1) - sizes


def _put_all(group: h5py.Group, **arrays: np.ndarray) -> None:
    for name, values in arrays.items():
        put_array(group, name, values)


def _put_packed(group: h5py.Group, **arrays: np.ndarray) -> None:
    """Store what hardly differs from one set of lines to the next."""
    for name, values in arrays.items():
        group.create_dataset(name, data=values, compression="gzip", shuffle=True)
