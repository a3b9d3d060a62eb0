"""The result file as its only writer, rank 0, handles it. Nothing here is collective.

Everything that grows does so in ``append`` alone, which leaves a file that is readable as it
stands; room on the disk is claimed one append ahead, so that a full disk costs no record. HDF5
writes its tables in no order that helps one who reads a file whose writer was killed: a table may
have got longer, and its rows not be there yet. Hence the committed row counts ``COMPLETE``, which
are written after the rows.

A run that is to go on beyond its end gets its later head in a copy of the file, which takes its
place when it is whole (``extend_run``): what breaks leaves the run as it was.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.files import appears_whole, new_part
from catenary.postproc.files import dimensions
from catenary.postproc.files.committed_rows import (
    SLOTS,
    ForceFilter,
    cut,
    extremes_at,
    rows_of,
    store_extremes,
    store_filtered,
)
from catenary.postproc.files.disk import (
    MARGIN,
    abandon,
    as_attribute,
    check_in_place,
    check_uncut,
    open_to_write,
    opened,
    reserve,
    trimmed,
)
from catenary.postproc.files.disk_errors import reason
from catenary.postproc.files.facts import FACTS
from catenary.postproc.files.hdf5 import (
    ATTRIBUTE_SUMS,
    FORMAT_BOUNDS,
    append_rows,
    create_checked,
    grow,
    put_array,
    put_sealed_arrays,
    seal_arrays,
    seal_attributes,
    set_attribute,
    text_of,
    write_window,
)
from catenary.postproc.files.header import GZIP, GZIP_LEVEL, Header, LineRecord
from catenary.postproc.files.run_schema import (
    COMPLETE,
    FORMAT,
    INTERRUPTED,
    LINE_TIME,
    RUNNING,
    Chunk,
    chunks_of,
    growing_tables,
    room_of,
)
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Channel

if TYPE_CHECKING:
    from catenary.solver.time_loop.views.observers import Stage

# Steps of the run as it was begun: what is recorded follows from them.
BEGUN_FOR = "n_steps_begun_for"
# Attributes that a later end leaves: who wrote the rows that are there, how, and who chose effects.
_KEPT = ("versions", "petsc_options", "effects_on", "effects_off")
# Tables that a later end changes beside attributes and facts.
CHANGED = ("line/evaluation_range",)


class LineRows(NamedTuple):
    """Rows of the line's channels that a flush appends.

    Attributes
    ----------
    chosen : (n,) int, which of the flush's steps have a row
    values : name -> the first of the recorded columns that are given, and these (n, columns);
        all of them if there is no window
    extremes : name -> (2, all columns), smallest and largest of every step up to this flush
    """

    chosen: np.ndarray
    values: Mapping[str, tuple[int, np.ndarray]]
    extremes: Mapping[str, np.ndarray]


class ResultFile:
    """A result file open for writing.

    A new one is made under another name, and takes its own when its first rows are on the disk:
    until then an earlier file, or a link, stays as it is. All writes go through one descriptor.

    Parameters
    ----------
    path : the file, replaced at the end of the first ``append`` unless ``resume``
    stage : of the run
    header : facts of the run that are known before the first step
    n_ranks : size of the run's communicator
    rows_per_append : largest number of rows of an append
    with_energies : whether energies will be appended
    record : which part of the line's channels is recorded
    resume : continue a file; what it holds from the stage's start time on is dropped
    on_begun : called when a new file has taken its place

    Raises
    ------
    InputError
        If a file that is to be continued does not have the tables of the run; it is as it was.
    OSError, RuntimeError
        If HDF5 could not open or write it.
    """

    def __init__(
        self,
        path: Path,
        stage: Stage,
        header: Header,
        n_ranks: int,
        *,
        rows_per_append: int,
        with_energies: bool,
        record: LineRecord,
        resume: bool,
        on_begun: Callable[[], None] = lambda: None,
    ) -> None:
        self._path = path
        self._made_as = path if resume else new_part(path)
        self._begun = resume
        self._on_begun = on_begun
        self._record = record
        places = {kind: x for kind, (x, _) in stage.places.items()}
        self._columns = {
            name: record.columns(places[channels.CHANNELS[name].per]) for name in record.names
        }
        self._x = {
            name: places[channels.CHANNELS[name].per][columns]
            for name, columns in self._columns.items()
        }
        table = _table(stage, with_energies, record, self._x)
        shapes = chunks_of(table, stage.n_steps, rows_per_append, record.every)
        rows = min(rows_per_append, stage.n_steps + 1)
        self._room = room_of(table, shapes, rows, record) + MARGIN
        self._start_time, self._dt = stage.start_time, stage.dt
        self._n_states = 0
        place, mode = (path, "r+") if resume else (self._made_as, "w")
        self._file = open_to_write(place, mode, libver=FORMAT_BOUNDS)
        try:
            if resume:
                _refuse_other_tables(self._file, path, table)
                cut(self._file, stage.start_time - 0.5 * stage.dt)
            else:
                _write_head(self._file, stage, header, n_ranks, record)
                for name, columns_of in self._columns.items():
                    create_checked(self._file, f"line_columns/{name}", columns_of)
                for name, (channel, columns) in table.items():
                    _create_growing(self._file, name, channel, columns, shapes[name], record)
                of_columns = {channels.CHANNELS[name].per: x for name, x in self._x.items()}
                dimensions.describe(self._file, of_columns)
            # Kept open: closing a dataset writes what is left of it, and h5py ignores errors there.
            self._growing = {name: self._file[name] for name in table}
            set_attribute(self._file, "outcome", RUNNING)
            self._file.flush()
            reserve(self._file, self._room)
        except InputError:
            self._file.close()
            raise
        except (OSError, RuntimeError):
            self.abandon()
            raise

    def append(
        self, blocks: Mapping[str, np.ndarray], line: LineRows, state: Mapping[str, Any] | None
    ) -> None:
        """Append rows to growing datasets and store a state to continue from.

        Parameters
        ----------
        blocks : mapping
            Arrays (rows, ...) by path in the file.
        line : LineRows
            Rows of the line's channels.
        state : mapping or None
            Contents of ``checkpoint``, None to leave it.

        Raises
        ------
        NoRoom
            If there is no room for another append; this one is complete.
        OSError, RuntimeError
            If HDF5 could not write.
        """
        self._check_uncut()
        for name, block in blocks.items():
            dataset = self._growing[name]
            append_rows(dataset, dataset.id.shape[0], block)
        self._append_line(line, blocks)
        store_extremes(self._file, self._growing["time"].shape[0], line.extremes)
        self._order_writes()
        put_array(self._file, COMPLETE, rows_of(self._growing))
        if state is not None:
            self._store(state)
        self._file.flush()
        reserve(self._file, self._room)
        if not self._begun:
            os.replace(self._made_as, self._path)
            self._begun = True
            self._on_begun()

    def check_in_place(self) -> None:
        """Raise ``disk.Elsewhere`` if the path names this file no longer."""
        if self._begun:
            check_in_place(self._path, self._file.id.get_vfd_handle())

    def extremes(self) -> dict[str, np.ndarray] | None:
        """The extremes of the rows that are there by channel, (2, columns); None if not kept."""
        return extremes_at(self._file, self._growing["time"].shape[0])

    def conclude(self, outcome: str) -> None:
        """Store how the run ended."""
        self._check_uncut()
        time = self._growing["time"]
        attributes = self._file.attrs
        set_attribute(self._file, "outcome", outcome)
        attributes["n_steps"] = max(time.shape[0] - 1, 0)
        attributes["simulated_s"] = float(time[-1] - time[0]) if time.shape[0] else 0.0
        # Of a resumed run the part that its wall time belongs to.
        attributes["marched_s"] = float(time[-1]) - self._start_time if time.shape[0] else 0.0
        self._file.flush()

    def store_filtered(self, force: ForceFilter) -> None:
        """Store the filtered contact force of all steps."""
        store_filtered(self._file, force, self._dt)

    def close(self, performance: Mapping[str, Any]) -> None:
        """Store ``performance`` as root attributes and close the file."""
        for name, value in performance.items():
            set_attribute(self._file, name, as_attribute(value))
        self._file.flush()
        with trimmed(self._file):
            self._file.close()
        self._remove_if_empty()

    def _check_uncut(self) -> None:
        """Raise ``disk.Cut`` if something of what was written is gone."""
        check_uncut(self._path, self._file.id.get_vfd_handle(), self._file.id.get_filesize())

    def _append_line(self, line: LineRows, blocks: Mapping[str, np.ndarray]) -> None:
        """Append rows of the line's channels; blocks that are outside of the window are left out,
        so that they take no room."""
        start = self._growing[LINE_TIME].shape[0]
        edges = self._record.within(blocks["channels/contact_position"][line.chosen])
        for name, values in line.values.items():
            dataset = self._growing[f"line_channels/{name}"]
            if edges is None:
                append_rows(dataset, start, values[1])
                continue
            grow([dataset], start + line.chosen.size)
            if values[1].size:
                write_window(dataset, start, values, self._x[name], edges)
        append_rows(self._growing[LINE_TIME], start, blocks["time"][line.chosen])

    def abandon(self) -> None:
        """Close the file without writing to it, after a write has failed."""
        abandon(self._file)
        self._remove_if_empty()

    def _remove_if_empty(self) -> None:
        """Remove a new file that never held a row."""
        if not self._begun:
            self._made_as.unlink(missing_ok=True)

    def _store(self, state: Mapping[str, Any]) -> None:
        """Write a state, the first one into both slots, any other into the older one."""
        group = self._file.require_group("checkpoint")
        slots = (SLOTS[self._n_states % 2],) if self._n_states else SLOTS
        for slot in slots:
            place = group.require_group(slot)
            for name in set(place) - set(state):  # of the line as it was before an incident
                del place[name]
            put_sealed_arrays(place, state)
            dimensions.hide(place)
            self._order_writes()
            set_attribute(group, "latest", slot)
        self._n_states += 1

    def _order_writes(self) -> None:
        """Write all that waits, before what follows; not needed until the file has its name."""
        if self._begun:
            self._file.flush()


def _table(
    stage: Stage, with_energies: bool, record: LineRecord, x: Mapping[str, np.ndarray]
) -> dict[str, tuple[Channel, int]]:
    """Growing datasets: path -> channel and columns, 0 columns for one value a row."""
    steps, energies, line = growing_tables(record, stage.train)
    table = {
        path: (c, 0 if c.per == channels.RUN else c.n_columns(stage.train))
        for path, c in steps.items()
    }
    table |= {path: (c, int(x[c.name].size) if c.name in x else 0) for path, c in line.items()}
    return table | ({path: (c, 0) for path, c in energies.items()} if with_energies else {})


def _refuse_other_tables(
    file: h5py.File, path: Path, table: Mapping[str, tuple[Channel, int]]
) -> None:
    """Raise InputError unless a file has all growing tables of a run with their columns, and
    nothing but tables where states and extremes are written."""

    def refuse(what: str) -> InputError:
        return InputError(f"{path} cannot be continued: {what}; start the run anew")

    for name, (channel, columns) in table.items():
        if name not in file:
            raise refuse(f"{name} is missing")
        wanted = () if channel.per == channels.RUN else (columns,)
        if file[name].shape[1:] != wanted:
            raise refuse(f"{name} has the columns {file[name].shape[1:]} in place of {wanted}")
    for name in ("checkpoint", "extremes"):
        kept = file.get(name)
        if not isinstance(kept, h5py.Group):
            raise refuse(f"{name} is missing")
        for slot in kept.values():
            inner = slot.values() if isinstance(slot, h5py.Group) else [None]
            if not all(isinstance(one, h5py.Dataset) for one in inner):
                raise refuse(f"{slot.name[1:]} does not hold tables alone")


def _write_head(
    file: h5py.File, stage: Stage, header: Header, n_ranks: int, record: LineRecord
) -> None:
    fixed = {
        "format": FORMAT,
        "Conventions": dimensions.CONVENTIONS,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "n_steps_planned": stage.n_steps,
        "n_strips": list(stage.train.n_strips),
        "line_record": record.model_dump(by_alias=True),
    }
    for name, value in {**header.attributes, **fixed}.items():
        set_attribute(file, name, as_attribute(value))
    seal_attributes(file)
    # A restart changes it.
    file.attrs["n_ranks"] = n_ranks
    known = {
        "line/arm_x": stage.arm_x,
        "line/dropper_x": stage.dropper_x,
        "line/node_points": stage.node_points,
    }
    if stage.wire_ends:
        wires, x, outwards = zip(*stage.wire_ends, strict=True)
        known |= {
            "line/end_x": np.array(x),
            "line/end_wire": np.array(wires),
            "line/end_outwards": np.array(outwards),
        }
    for name, array in {**header.datasets, **known, COMPLETE: [0, 0, 0]}.items():
        create_checked(file, name, array)
    facts = file.create_group("facts")
    for name, value in header.facts.items():
        dataset = h5py.Dataset(put_array(facts, name, value))
        set_attribute(dataset, "unit", FACTS[name].unit)
        set_attribute(dataset, "meaning", FACTS[name].meaning)
    seal_arrays(facts, header.facts)


def _create_growing(
    file: h5py.File, path: str, channel: Channel, columns: int, chunk: Chunk, record: LineRecord
) -> None:
    # A fixed dimension of zero is narrower than any chunk: leave it open.
    shape, limit, chunks = (
        ((0,), (None,), (chunk.rows,))
        if channel.per == channels.RUN
        else ((0, columns), (None, columns or None), tuple(chunk))
    )
    known: dict[str, Any] = {}
    if channel.of_line and record.compression == GZIP:
        known = {"compression": "gzip", "compression_opts": GZIP_LEVEL, "shuffle": True}
    # A chunk that HDF5's index has lost, or that was never written, reads as NaN, not as zeros.
    dataset = file.create_dataset(
        path,
        shape=shape,
        maxshape=limit,
        chunks=chunks,
        dtype="f8",
        fletcher32=True,
        fillvalue=np.nan,
        **known,
    )
    set_attribute(dataset, "unit", channel.unit)
    set_attribute(dataset, "meaning", channel.meaning)


def extend_run(path: Path, header: Header, n_steps: int) -> None:
    """Turn a result file into that of a run of ``n_steps`` interrupted where it has ended.

    Parameters
    ----------
    path : Path
        Path of the result file.
    header : Header
        Header of the run with its later end.
    n_steps : int
        Number of steps up to the later end.

    Raises
    ------
    RunBroken
        If the file cannot be written; it is as it was.
    """
    try:
        with appears_whole(path) as made_as:
            shutil.copyfile(path, made_as, follow_symlinks=False)
            with opened(made_as, "r+") as file:
                _give_later_end(file, header, n_steps)
    except (OSError, RuntimeError) as error:
        raise RunBroken(
            f"{path} cannot be given a later end ({reason(error)}); it is as it was"
        ) from error


def _give_later_end(file: h5py.File, header: Header, n_steps: int) -> None:
    known = {
        name: as_attribute(value)
        for name, value in {**header.attributes, "n_steps_planned": n_steps}.items()
        if name not in _KEPT
    }
    reserve(file, MARGIN + sum(len(str(value).encode()) for value in known.values()))
    # A file whose checksums were taken away gets none.
    has_sums = ATTRIBUTE_SUMS in file.attrs
    sealed = list(json.loads(text_of(file.attrs[ATTRIBUTE_SUMS]))) if has_sums else []
    if BEGUN_FOR not in file.attrs:
        set_attribute(file, BEGUN_FOR, file.attrs["n_steps_planned"])
        sealed.append(BEGUN_FOR)
    for name, value in known.items():
        set_attribute(file, name, value)
    if has_sums:
        seal_attributes(file, sealed)
    set_attribute(file, "outcome", INTERRUPTED)
    for name in CHANGED:
        file[name][...] = header.datasets[name]
    for name, value in header.facts.items():
        put_array(file["facts"], name, value)
    seal_arrays(file["facts"], header.facts)
