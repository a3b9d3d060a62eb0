"""The result file as its only writer, rank 0, handles it. Nothing here is collective.

Everything that grows does so in ``append`` alone, which leaves a file that is readable as it
stands; room on the disk is claimed one append ahead, so that a full disk costs no record. HDF5
writes its tables in no order that helps one who reads a file whose writer was killed: a table may
have got longer, and its rows not be there yet. Hence ``COMPLETE``, which is told after the rows.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from catenary.postproc import channels
from catenary.postproc.channels import Channel
from catenary.postproc.header import Header
from catenary.postproc.record.checked import (
    FORMAT_BOUNDS,
    create_checked,
    seal_arrays,
    seal_attributes,
    set_attribute,
)
from catenary.postproc.record.own_files import part_of
from catenary.postproc.storage import MARGIN, abandon, as_attribute, check_in_place, reserve
from catenary.solver.observation import Stage

FORMAT = "catenary-run-1"
# Rows that are whole, of the channels and of the energies; a table may be longer after a kill.
COMPLETE = "complete_rows"
RUNNING, DONE, INTERRUPTED = "running", "done", "interrupted"
# The state to continue from is kept twice and written in turn: a run that is killed while it
# writes one still has the other.
_SLOTS = ("0", "1")


class ResultFile:
    """A result file open for writing.

    A new one is made under another name, and takes its own when its first rows are on the disk:
    until then an earlier file, or a link, stays as it is. All writes go through one descriptor.

    Parameters
    ----------
    path : the file, replaced at the end of the first ``append`` unless ``resume``
    stage : of the run
    header : what the runner knows before the first step
    n_ranks : size of the run's communicator
    rows_per_append : largest number of rows of an append
    with_energies : whether energies will be appended
    resume : continue a file; what it holds from the stage's start time on is dropped
    on_begun : called when a new file has taken its place
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
        resume: bool,
        on_begun: Callable[[], None] = lambda: None,
    ) -> None:
        self._path = path
        self._made_as = path if resume else part_of(path, os.getpid())
        self._begun = resume
        self._on_begun = on_begun
        table = _table(stage, with_energies)
        width = sum(columns or 1 for _, columns in table.values())
        # An append touches the chunk begun last and one more.
        self._room = 2 * 8 * rows_per_append * width + MARGIN
        self._start_time = stage.start_time
        self._n_states = 0
        self._file = h5py.File(self._made_as, "r+" if resume else "w", libver=FORMAT_BOUNDS)
        try:
            if resume:
                _cut(self._file, stage.start_time - 0.5 * stage.dt)
            else:
                _write_head(self._file, stage, header, n_ranks)
                for name, (channel, columns) in table.items():
                    _create_growing(self._file, name, channel, columns, rows_per_append)
            # Kept open: closing a dataset writes what is left of it, and h5py ignores errors there.
            self._growing = {name: self._file[name] for name in table}
            self._complete = self._file[COMPLETE]
            set_attribute(self._file, "outcome", RUNNING)
            self._file.flush()
            self._reserve()
        except (OSError, RuntimeError):
            self.abandon()
            raise

    def append(self, blocks: Mapping[str, np.ndarray], state: Mapping[str, Any] | None) -> None:
        """Append rows to growing datasets and store a state to continue from.

        Parameters
        ----------
        blocks : path in the file -> (rows, ...) array
        state : what ``checkpoint`` is to hold, None to leave it

        Raises
        ------
        NoRoom
            If there is no room for another append; this one is complete.
        OSError, RuntimeError
            If HDF5 could not write.
        """
        for name, block in blocks.items():
            dataset = self._growing[name]
            start = dataset.shape[0]
            dataset.resize(start + block.shape[0], axis=0)
            dataset[start:] = block
        self._file.flush()
        self._complete[...] = _rows(self._file)
        self._file.flush()
        if state is not None:
            self._store(state)
        self._reserve()
        if not self._begun:
            os.replace(self._made_as, self._path)
            self._begun = True
            self._on_begun()

    def check_in_place(self) -> None:
        """Raise ``storage.Elsewhere`` if the path names this file no longer."""
        if self._begun:
            check_in_place(self._path, self._file.id.get_vfd_handle())

    def conclude(self, outcome: str) -> None:
        """Store how the run ended."""
        time = self._growing["time"]
        attributes = self._file.attrs
        set_attribute(self._file, "outcome", outcome)
        attributes["n_steps"] = max(time.shape[0] - 1, 0)
        attributes["simulated_s"] = float(time[-1] - time[0]) if time.shape[0] else 0.0
        # Of a resumed run the part that its wall time belongs to.
        attributes["marched_s"] = float(time[-1]) - self._start_time if time.shape[0] else 0.0
        self._file.flush()

    def close(self, performance: Mapping[str, Any]) -> None:
        """Store ``performance`` as root attributes and close the file."""
        for name, value in performance.items():
            set_attribute(self._file, name, as_attribute(value))
        self._file.close()
        self._forget()

    def abandon(self) -> None:
        """Close the file without writing to it, after a write has failed."""
        abandon(self._file)
        self._forget()

    def _forget(self) -> None:
        """Remove a new file that never held a row."""
        if not self._begun:
            self._made_as.unlink(missing_ok=True)

    def _store(self, state: Mapping[str, Any]) -> None:
        """Write a state, the first one into both slots, any other into the older one."""
        group = self._file.require_group("checkpoint")
        slots = (_SLOTS[self._n_states % 2],) if self._n_states else _SLOTS
        for slot in slots:
            place = group.require_group(slot)
            for name, value in state.items():
                _replace(place, name, value)
            seal_arrays(place, state)
            self._file.flush()
            set_attribute(group, "latest", slot)
        self._file.flush()
        self._n_states += 1

    def _reserve(self) -> None:
        handle = self._file.id.get_vfd_handle()
        reserve(handle, self._file.id.get_filesize(), self._room)


def _table(stage: Stage, with_energies: bool) -> dict[str, tuple[Channel, int]]:
    """Growing datasets: path -> channel and columns, 0 columns for one value a row."""
    columns = {
        channels.PANTOGRAPH: stage.n_pantographs,
        channels.ARM: int(stage.arm_x.size),
        channels.DROPPER: int(stage.dropper_x.size),
    }
    table = {"time": (channels.TIME, 0)}
    for channel in channels.CHANNELS.values():
        table[f"channels/{channel.name}"] = (channel, columns[channel.per])
    if stage.several_strips:
        table[f"channels/{channels.STRIP_FORCE.name}"] = (channels.STRIP_FORCE, sum(stage.n_strips))
    if stage.joints_in_loop:
        channel = channels.CONSTRAINT_VIOLATION
        table[f"channels/{channel.name}"] = (channel, columns[channel.per])
    if with_energies:
        table.update({f"energy/{c.name}": (c, 0) for c in channels.ENERGIES.values()})
    return table


def _write_head(file: h5py.File, stage: Stage, header: Header, n_ranks: int) -> None:
    fixed = {
        "format": FORMAT,
        "dt_s": stage.dt,
        "created": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "n_steps_planned": stage.n_steps,
        "n_strips": list(stage.n_strips),
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
    for name, array in {**header.datasets, **known, COMPLETE: [0, 0]}.items():
        create_checked(file, name, array)


def _create_growing(
    file: h5py.File, path: str, channel: Channel, columns: int, chunk_rows: int
) -> None:
    one_value_a_row = channel.per == channels.RUN
    # A fixed dimension of zero is narrower than any chunk: leave it open.
    shape, limit, chunks = (
        ((0,), (None,), (chunk_rows,))
        if one_value_a_row
        else ((0, columns), (None, columns or None), (chunk_rows, max(columns, 1)))
    )
    # A chunk that HDF5's index has lost reads as NaN, not as zeros.
    dataset = file.create_dataset(
        path,
        shape=shape,
        maxshape=limit,
        chunks=chunks,
        dtype="f8",
        fletcher32=True,
        fillvalue=np.nan,
    )
    set_attribute(dataset, "unit", channel.unit)
    set_attribute(dataset, "meaning", channel.meaning)


def _rows(file: h5py.File) -> list[int]:
    """Rows of the channels and of the energies."""
    return [file["time"].shape[0], file["energy/time"].shape[0] if "energy" in file else 0]


def complete_rows(file: h5py.File) -> list[int]:
    """Rows of the channels and of the energies that are whole; all in files of earlier versions."""
    return file[COMPLETE][...].tolist() if COMPLETE in file else _rows(file)


def _cut(file: h5py.File, time: float) -> None:
    """Drop the records from ``time`` [s] on."""
    parts = [(file["time"], [file["time"], *file["channels"].values()])]
    if "energy" in file:
        parts.append((file["energy/time"], list(file["energy"].values())))
    for (clock, datasets), complete in zip(parts, complete_rows(file), strict=False):
        keep = int(np.searchsorted(clock[:complete], time))
        for dataset in datasets:
            dataset.resize(keep, axis=0)
    _replace(file, COMPLETE, _rows(file))


def _replace(group: h5py.Group, name: str, value: Any) -> None:
    """Overwrite in place if shape and type are the same, so that the file does not grow."""
    array = np.asarray(value)
    old = group.get(name)
    if old is not None and old.shape == array.shape and old.dtype == array.dtype:
        old[...] = array
        return
    if old is not None:
        del group[name]
    group.create_dataset(name, data=value)
