"""Writes the channels of a run into its result file while the run goes on.

Between flushes a step only copies numbers into buffers. A flush gathers them to rank 0, which
appends them with the serial driver, stores the state to continue from and makes HDF5 write all
tables, so that a killed run leaves a file that is readable up to its last flush.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from catenary.postproc import channels
from catenary.postproc.gathering import ColumnGather
from catenary.postproc.header import Header
from catenary.postproc.storage import MARGIN, as_attribute, broken_write, reserve
from catenary.solver.errors import RunBroken
from catenary.solver.observation import Stage, StepView
from catenary.solver.parallel import on_root

FORMAT = "catenary-run-1"
RUNNING, DONE, INTERRUPTED = "running", "done", "interrupted"
# The state to continue from is kept twice and written in turn: a run that is killed while it
# writes one still has the other.
_SLOTS = ("0", "1")
_PANTOGRAPH_CHANNELS = tuple(c for c in channels.CHANNELS.values() if c.per == channels.PANTOGRAPH)


class Recorder:
    """Observer that writes ``run.h5``.

    Collective, like all its methods except ``observe`` between flushes. Call ``close`` after
    ``finish``.

    Parameters
    ----------
    comm : mpi4py communicator
    path : the result file, overwritten unless ``resume``
    header : on rank 0 what the runner knows before the first step; ignored elsewhere
    flush_every : steps between two flushes
    energy_every : steps between two records of the energies, None for none
    resume : continue a file: what it holds from the stage's start time on is replaced
    """

    def __init__(
        self,
        comm: Any,
        path: Path | str,
        header: Header | None,
        *,
        flush_every: int = 500,
        energy_every: int | None = None,
        resume: bool = False,
    ) -> None:
        self._comm = comm
        self._path = Path(path)
        self._header = header
        self._flush_every = flush_every
        self._energy_every = energy_every
        self._resume = resume
        self._file: h5py.File | None = None
        self._broken = False
        self._view: StepView | None = None
        self._n_flushes = 0
        self._rows = 0
        self._energies: list[tuple[float, float, float]] = []

    def start(self, stage: Stage) -> None:
        """Make the buffers and open the file. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the file cannot be written.
        """
        rows, n_p = self._flush_every, stage.n_pantographs
        self._start_time = self._last_time = stage.start_time
        self._time = np.zeros(rows)
        self._pantographs = {c.name: np.zeros((rows, n_p)) for c in _PANTOGRAPH_CHANNELS}
        self._gather_arms = ColumnGather(self._comm, stage.owned_arms, stage.arm_x.size, rows)
        self._gather_droppers = ColumnGather(
            self._comm, stage.owned_droppers, stage.dropper_x.size, rows
        )
        self._arms = np.zeros((rows, self._gather_arms.n_owned))
        self._droppers = np.zeros((rows, self._gather_droppers.n_owned))
        self._position = self._pantographs["contact_position"]
        self._root_buffers = (
            [self._pantographs[name] for name in ("contact_force", "head_height", "wire_height")]
            if self._comm.rank == 0
            else None
        )
        width = 1 + len(_PANTOGRAPH_CHANNELS) * n_p + stage.arm_x.size + stage.dropper_x.size
        # An append touches the chunk begun last and one more.
        self._bytes_per_flush = 2 * 8 * rows * width
        self._guarded(lambda: self._open(stage))

    def observe(self, view: StepView) -> None:
        """Copy a step into the buffers; collective at the first step and whenever they are full."""
        row = self._rows
        self._time[row] = view.time
        self._position[row] = view.contact_position
        if self._root_buffers is not None:
            force, head, wire = self._root_buffers
            force[row] = view.contact_force
            head[row] = view.head_height
            wire[row] = view.wire_height
        self._arms[row] = view.arm_uplift
        self._droppers[row] = view.dropper_force
        self._rows = row + 1
        self._view = view
        self._last_time = view.time
        if self._energy_every and view.step % self._energy_every == 0:
            self._energies.append((view.time, *view.energies()))
        # The first step is written at once: it makes room for the state to continue from.
        if self._rows == self._flush_every or self._n_flushes == 0:
            self._flush(view)

    def finish(self, outcome: str) -> None:
        """Write what is left and the outcome. Collective.

        The state to continue from is renewed only if the run ended in good order.
        """
        if self._broken:
            return
        self._flush(self._view if outcome in (DONE, INTERRUPTED) else None)
        self._guarded(lambda: self._conclude(outcome))

    def close(self, performance: Mapping[str, Any] | None = None) -> None:
        """Write what is known at the very end as root attributes and close the file. Collective.

        Parameters
        ----------
        performance : for instance ``phase_wall_s``, ``march_wall_s``, ``inner_iterations``;
            needed on rank 0 only
        """
        if self._broken:
            return
        self._guarded(lambda: self._close(performance or {}))

    # ---- rank 0 and the file ----------------------------------------------------------------

    def _guarded(self, work: Callable[[], None]) -> None:
        """Run ``work`` on rank 0; if it fails, all ranks raise RunBroken. Collective."""

        def attempt() -> None:
            try:
                work()
            except (OSError, RuntimeError) as error:  # both come from h5py when a disk is full
                broken = broken_write(self._path, self._last_time, error)
                self._leave_word(str(broken))
                raise broken from error

        try:
            on_root(self._comm, attempt)
        except RunBroken:
            self._broken = True
            raise

    def _leave_word(self, sentence: str) -> None:
        """Store why the run broke, as far as the disk allows, and let go of the file."""
        if self._file is None:
            return
        with contextlib.suppress(OSError, RuntimeError):
            self._conclude(sentence)
        with contextlib.suppress(OSError, RuntimeError):
            self._file.close()
        self._file = None

    def _open(self, stage: Stage) -> None:
        if self._resume:
            self._file = h5py.File(self._path, "r+")
            self._cut(self._file, stage.start_time - 0.5 * stage.dt)
        else:
            self._file = h5py.File(self._path, "w")
            self._create(self._file, stage)
        self._file.attrs["outcome"] = RUNNING
        self._file.flush()
        self._reserve()

    def _create(self, file: h5py.File, stage: Stage) -> None:
        if self._header is None:
            raise ValueError("rank 0 needs the head of the result file")
        fixed = {
            "format": FORMAT,
            "n_ranks": self._comm.size,
            "dt_s": stage.dt,
            "created": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "n_steps_planned": stage.n_steps,
        }
        for name, value in {**fixed, **self._header.attributes}.items():
            file.attrs[name] = as_attribute(value)
        known = {
            "line/arm_x": stage.arm_x,
            "line/dropper_x": stage.dropper_x,
            "line/node_points": stage.node_points,
        }
        for name, array in {**self._header.datasets, **known}.items():
            file.create_dataset(name, data=array)

        rows = self._flush_every
        columns = {
            channels.PANTOGRAPH: stage.n_pantographs,
            channels.ARM: stage.arm_x.size,
            channels.DROPPER: stage.dropper_x.size,
        }
        _growing(file, "time", channels.TIME, (), rows)
        for channel in channels.CHANNELS.values():
            _growing(
                file, f"channels/{channel.name}", channel, (int(columns[channel.per]),), rows
            )
        if self._energy_every:
            for channel in channels.ENERGIES.values():
                _growing(file, f"energy/{channel.name}", channel, (), rows)

    def _cut(self, file: h5py.File, time: float) -> None:
        """Drop the records from ``time`` [s] on, which the resumed run writes anew."""
        keep = int(np.searchsorted(file["time"][...], time))
        for dataset in (file["time"], *file["channels"].values()):
            dataset.resize(keep, axis=0)
        if self._energy_every:
            keep = int(np.searchsorted(file["energy/time"][...], time))
            for dataset in file["energy"].values():
                dataset.resize(keep, axis=0)

    def _flush(self, view: StepView | None) -> None:
        """Gather the buffers, append them, and store the state of ``view``. Collective."""
        rows = self._rows
        arms = self._gather_arms(self._arms[:rows])
        droppers = self._gather_droppers(self._droppers[:rows])
        state = view.checkpoint() if view is not None else None
        self._guarded(lambda: self._append(rows, arms, droppers, state))
        self._rows = 0
        self._energies.clear()
        self._n_flushes += 1

    def _append(
        self, rows: int, arms: np.ndarray, droppers: np.ndarray, state: dict[str, Any] | None
    ) -> None:
        file = self._open_file
        blocks = {name: buffer[:rows] for name, buffer in self._pantographs.items()}
        blocks.update(arm_uplift=arms, dropper_force=droppers)
        for name, block in blocks.items():
            _extend(file[f"channels/{name}"], block)
        if self._energies:
            table = np.array(self._energies)
            for column, name in enumerate(channels.ENERGIES):
                _extend(file[f"energy/{name}"], table[:, column])
        _extend(file["time"], self._time[:rows])
        file.flush()
        if state is not None:
            self._store(state)
        self._reserve()

    def _store(self, state: dict[str, Any]) -> None:
        """Write the state to continue from, first into both slots, then into the older one."""
        group = self._open_file.require_group("checkpoint")
        slots = _SLOTS if self._n_flushes == 0 else (_SLOTS[self._n_flushes % 2],)
        for slot in slots:
            place = group.require_group(slot)
            for name, value in state.items():
                _replace(place, name, value)
            place.attrs["time"] = self._last_time
            self._open_file.flush()
            group.attrs["latest"] = slot
        self._open_file.flush()

    def _reserve(self) -> None:
        start = self._open_file.id.get_filesize()
        reserve(self._path, start, self._bytes_per_flush + MARGIN)

    def _conclude(self, outcome: str) -> None:
        file = self._open_file
        time = file["time"]
        file.attrs["outcome"] = outcome
        file.attrs["n_steps"] = max(time.shape[0] - 1, 0)
        file.attrs["simulated_s"] = float(time[-1] - time[0]) if time.shape[0] else 0.0
        file.flush()

    def _close(self, performance: Mapping[str, Any]) -> None:
        file = self._open_file
        for name, value in performance.items():
            file.attrs[name] = as_attribute(value)
        file.close()
        self._file = None

    @property
    def _open_file(self) -> h5py.File:
        if self._file is None:
            raise RuntimeError("the result file is not open")
        return self._file


def _growing(
    file: h5py.File, path: str, channel: channels.Channel, columns: tuple[int, ...], rows: int
) -> None:
    chunks = (rows, *(max(n, 1) for n in columns))
    # A fixed dimension of zero is narrower than any chunk: leave it open.
    limit = (None, *(n or None for n in columns))
    dataset = file.create_dataset(
        path, shape=(0, *columns), maxshape=limit, chunks=chunks, dtype="f8"
    )
    dataset.attrs["unit"] = channel.unit
    dataset.attrs["meaning"] = channel.meaning


def _extend(dataset: h5py.Dataset, block: np.ndarray) -> None:
    start = dataset.shape[0]
    dataset.resize(start + block.shape[0], axis=0)
    dataset[start:] = block


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
