"""The files of snapshots: HDF5 for the numbers, XDMF for their meaning.

All tables have their full length from the first step on and their places never change: a killed
run cannot spoil them.

Its XDMF text names the snapshots that are there when the file is closed; ``catenary paraview``
writes one of its own, of a run that goes on or was killed as well.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np
from h5py import h5d, h5p, h5s, h5t

from catenary.base.errors import InputError
from catenary.base.files import new_part
from catenary.meshgen.wires import SAME_PLACE
from catenary.postproc.files.disk import (
    MARGIN,
    Cut,
    Elsewhere,
    check_in_place,
    check_uncut,
    opened,
    reserve,
    write_at,
    write_whole,
)
from catenary.postproc.files.disk_errors import reason
from catenary.postproc.files.hdf5 import HDF5_ERRORS, Damage, open_own, put_array, set_attribute
from catenary.postproc.record.snapshots.contents import (
    FORMAT,
    PLACES,
    RESTS_BEYOND,
    SIZES,
    Block,
    FieldRecord,
    Slots,
    layout_of,
)
from catenary.postproc.record.snapshots.field_values import FieldValues, Gathered

if TYPE_CHECKING:
    from catenary.postproc.record.snapshots.fields_schema import FieldTables

logger = logging.getLogger("catenary.fields")

# Rows of a table that are copied at once.
_ROWS_OF_COPY = 1 << 16


class FieldsFile:
    """``fields.h5`` and ``fields.xdmf`` while they are written. Not collective.

    Parameters
    ----------
    xdmf : the XDMF file; the numbers go into the file of the same name ending in ``.h5``
    record, blocks : which part of the line at rest is recorded
    values : makes the values
    n_nodes : of the whole line
    n_places : how many numbers say where each pantograph's masses are
    every : steps between two snapshots, and the time of a step [s]
    """

    def __init__(
        self,
        xdmf: Path,
        record: FieldRecord,
        blocks: list[Block],
        values: FieldValues,
        n_nodes: int,
        n_places: tuple[int, ...],
        every: tuple[int, float],
    ) -> None:
        self._xdmf, self.path = xdmf, xdmf.with_suffix(".h5")
        self._record, self._blocks, self._values = record, blocks, values
        self._n_nodes, self._n_places, (self._steps, self._dt) = n_nodes, n_places, every
        # Numbers of all pantographs, with the heights of their bases.
        self._n_numbers = len(n_places) + sum(n_places)
        self._every = self._steps * self._dt
        self._written: list[float] = []
        self._planned: list[float] = []
        self._layout: list[Slots] = []
        self._handle, self._size = -1, 0
        self.is_published = False

    def make(self, numbers: np.ndarray) -> None:
        """Write a file without a snapshot, under another name until ``publish``.

        Parameters
        ----------
        numbers : ndarray
            Numbers of the snapshots to come, counted from the start of the run.

        Raises
        ------
        OSError
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._made_as = new_part(self.path)
        self._plan(numbers)
        try:
            with opened(self._made_as, "w") as file:
                reserve(file, self._n_bytes())
                self._write_tables(file)
                self._find_places(file)
        except BaseException:
            self._made_as.unlink(missing_ok=True)
            raise
        self._open(self._made_as)

    def resume(self, numbers: np.ndarray, start_time: float) -> bool:
        """Continue the file from ``start_time`` [s] on; False if it is not as it was.

        Parameters
        ----------
        numbers : ndarray
            Numbers of the snapshots to come, counted from the start of the run.
        start_time : float
            Time from which on snapshots are replaced [s].

        Raises
        ------
        InputError
            If it is no regular file, or its tables lie in other files.
        """
        if not os.path.lexists(self.path):
            return False
        # Of all that reads files this alone is for runs that continue one.
        from catenary.postproc.read.guard import survives
        from catenary.postproc.record.snapshots.fields_schema import read_fields

        try:
            if not survives(self.path):
                raise ValueError("HDF5 does not read it")
            with opened(self.path, "r+") as file:
                known, times = read_fields(file), file["times"]
                # The step from which the run goes on is shown again, that before it is not.
                kept = known.times[known.times < start_time - 0.5 * self._dt]
                begin = round(float(kept[0]) / self._every) if kept.size else int(numbers[0])
                planned = np.arange(begin, numbers[-1] + 1)
                self._plan(planned[: times.size])
                self._find_places(file)
                self._refuse_other(known, kept)
                times[kept.size :] = np.full(times.size - kept.size, np.nan)
                self._written = kept.tolist()
            if planned.size > len(self._planned):
                self._lengthen(planned)
                return True
        except (OSError, KeyError, RuntimeError, TypeError, ValueError, Damage):
            logger.warning(
                "%s cannot be continued, it is damaged or of another version: its snapshots now "
                "begin at t = %.3f s",
                self.path,
                start_time,
            )
            self._written = []
            return False
        self._open(self.path)
        self.is_published = True
        return True

    def _lengthen(self, numbers: np.ndarray) -> None:
        """Replace the file by one with room for more snapshots, and copy its snapshots."""
        self.make(numbers)
        with opened(self.path, "r") as old, opened(self._made_as, "r+") as new:
            new["times"][: len(self._written)] = self._written
            tables = [PLACES]
            tables += [
                f"{slots.name}/{kind.name}" for slots in self._layout for kind in slots.kinds
            ]
            for table in tables:
                for first in range(0, len(old[table]), _ROWS_OF_COPY):
                    rows = slice(first, min(first + _ROWS_OF_COPY, len(old[table])))
                    new[table][rows] = old[table][rows]
        self.publish()

    def publish(self) -> None:
        """Give a new file its name, in place of an earlier one, whose text goes; OSError if that
        fails."""
        if self._handle < 0 or self.is_published:
            return
        os.replace(self._made_as, self.path)
        self.is_published = True
        self._xdmf.unlink(missing_ok=True)

    def append(self, times: list[float], known: Gathered) -> None:
        """Write snapshots at ``times`` [s]; OSError if that fails."""
        check_uncut(self.path, self._handle, self._size)
        first = len(self._written)
        for slots, places in zip(self._layout, self._places, strict=True):
            for kind in slots.kinds:
                values = self._values.of(kind, slots, first, known)
                at = places[kind.name] + kind.item_bytes * slots.row_at(kind, first)
                write_at(self._handle, at, values)
        pantographs = np.ascontiguousarray(known.pantographs, dtype="<f8")
        write_at(self._handle, self._places_at + 8 * first * self._n_numbers, pantographs)
        write_at(self._handle, self._times_at + 8 * first, np.array(times, dtype="<f8"))
        self._written += times
        if self.is_published:
            check_in_place(self.path, self._handle)

    def close(self) -> None:
        """Close the file and write its text, or remove a file that was never published."""
        if self._handle < 0:
            return
        try:
            if self.is_published:
                self._describe()
            else:
                self._made_as.unlink(missing_ok=True)
        finally:
            os.close(self._handle)
            self._handle = -1

    def _describe(self) -> None:
        """Write the XDMF file of the snapshots that are there, if it can be written."""
        from catenary.postproc.record.snapshots.fields_schema import read_fields, xdmf_of

        with contextlib.suppress(Elsewhere, Cut):  # by which the run was ended
            check_in_place(self.path, self._handle)
            check_uncut(self.path, self._handle, self._size)
            try:
                with open_own(self.path, locking=False) as file:
                    write_whole(self._xdmf, xdmf_of(file, read_fields(file), self.path.name))
            except (*HDF5_ERRORS, InputError, Damage) as error:  # another program changed the file
                sentence = "writing %s failed (%s); `catenary paraview` does without it"
                logger.warning(sentence, self._xdmf, reason(error))

    def _open(self, path: Path) -> None:
        self._handle = os.open(path, os.O_RDWR)
        self._size = os.fstat(self._handle).st_size

    def _plan(self, numbers: np.ndarray) -> None:
        # To the last digit the times of the steps: readers take any other for a time of its own.
        times = self._steps * numbers * self._dt
        self._planned = times.tolist()
        self._layout = layout_of(self._record, self._blocks, times)

    def _n_bytes(self) -> int:
        """Largest size of the file [B]."""
        of_time = 8 * len(self._planned) * (1 + self._n_numbers)
        return MARGIN + of_time + sum(slots.bytes() for slots in self._layout)

    def _write_tables(self, file: h5py.File) -> None:
        set_attribute(file, "format", FORMAT)
        set_attribute(file, "n_nodes", self._n_nodes)
        set_attribute(file, RESTS_BEYOND, int(self._record.rests_beyond))
        set_attribute(file, "parts", json.dumps([slots.name for slots in self._layout]))
        put_array(file, "times", np.full(len(self._planned), np.nan))
        # Room in the file now, and no zeros written into it.
        how = h5p.create(h5p.DATASET_CREATE)
        how.set_alloc_time(h5d.ALLOC_TIME_EARLY)
        how.set_fill_time(h5d.FILL_TIME_NEVER)
        _create(file, PLACES, (len(self._planned), self._n_numbers), "<f8", how)
        put_array(file, SIZES, np.array(self._n_places, dtype="<i8"))
        for slots in self._layout:
            group = file.create_group(slots.name)
            for name, table in slots.tables().items():
                put_array(group, name, table)
            for kind in slots.kinds:
                shape = (slots.rows(kind), kind.components)[: 1 + (kind.components > 1)]
                made = _create(group, kind.name, shape, kind.number, how)
                set_attribute(made, "unit", kind.unit)
                set_attribute(made, "meaning", kind.meaning)

    def _find_places(self, file: h5py.File) -> None:
        """Offsets of the times and the tables in the file [B]; KeyError without one."""
        self._times_at = _place_of(file, "times")
        self._places_at = _place_of(file, PLACES)
        self._places: list[dict[str, int]] = []
        for slots in self._layout:
            group = file[slots.name]
            self._places.append({kind.name: _place_of(group, kind.name) for kind in slots.kinds})

    def _refuse_other(self, known: FieldTables, times: np.ndarray) -> None:
        """Raise ValueError if a file that is to be continued is not of this run and these places.

        ``known`` are the tables that it holds, ``times`` (n,) those of the kept snapshots [s].
        """
        apart = np.diff(times) - self._every
        if not (np.abs(apart) <= 0.01 * self._every).all():
            raise ValueError("times")
        if known.n_places.tolist() != list(self._n_places):
            raise ValueError(SIZES)
        spans = [
            (self._times_at, 8 * len(self._planned)),
            (self._places_at, 8 * len(self._planned) * self._n_numbers),
        ]
        for slots, places in zip(self._layout, self._places, strict=True):
            for name, table in slots.tables().items():
                there = known.blocks[slots.name].tables()[name]
                # Another machine or version may have found the line at rest by other round-off.
                if there.shape != table.shape or not (np.abs(there - table) <= SAME_PLACE).all():
                    raise ValueError(name)
            for kind in slots.kinds:
                spans.append((places[kind.name], kind.item_bytes * slots.rows(kind)))
        # Snapshots are written where they stand: none may reach into another, or beyond the file.
        spans.sort()
        starts, sizes = np.array(spans, dtype=np.int64).T
        ends = starts + sizes
        if (ends[:-1] > starts[1:]).any() or ends.max() > self.path.stat().st_size:
            raise ValueError("places")


def _create(
    group: h5py.Group, name: str, shape: tuple[int, ...], number: str, how: h5p.PropDCID
) -> h5py.Dataset:
    """Make a table with the settings ``how``."""
    kind = h5t.py_create(np.dtype(number))
    return h5py.Dataset(h5d.create(group.id, name.encode(), kind, h5s.create_simple(shape), how))


def _place_of(group: h5py.Group, name: str) -> int:
    """Offset of a table in the file [B], 0 if it has no numbers; KeyError without one."""
    return h5d.open(group.id, name.encode()).get_offset() or 0
