"""Writes the channels of a run into its result file while the run goes on.

Between flushes a step only copies numbers into buffers. A flush gathers them to rank 0, which
appends them with the serial driver, stores the state to continue from and makes HDF5 write all
tables, so that a killed run leaves a file that is readable up to its last flush.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import RunBroken
from catenary.postproc.channels.header import Header
from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.files.disk import Elsewhere, NoRoom, broken_write
from catenary.postproc.files.filtered_force import ForceFilter
from catenary.postproc.files.result_file import LineRows, ResultFile
from catenary.postproc.files.run_schema import DONE, INTERRUPTED
from catenary.postproc.record.file_observer import FileObserver
from catenary.postproc.record.line_rows import LineGather
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import NEVER, Stage, StepView

# Single steps of which the line's channels are taken in together.
_WAITING = 16


class Recorder(FileObserver[ResultFile]):
    """Observer that writes ``run.h5``.

    Collective, like all its methods except ``observe`` between flushes. Call ``close`` after
    ``finish``.

    Parameters
    ----------
    comm : mpi4py communicator
    path : the result file; its folder is made. A new file takes the place of an earlier one when
        its first step is on the disk
    header : on rank 0 what the runner knows before the first step; ignored elsewhere
    flush_every : steps between two flushes
    energy_every : steps between two records of the energies, None for none
    record : which part of the line's channels is recorded
    resume : continue a file: what it holds from the stage's start time on is replaced
    on_begun : called on rank 0 when a new file has taken its place
    force_filter : called on rank 0 when a run is done; the contact force is stored filtered by it
        too, unless it is None
    """

    def __init__(
        self,
        comm: Any,
        path: Path | str,
        header: Header | None,
        *,
        flush_every: int = 500,
        energy_every: int | None = None,
        record: LineRecord | None = None,
        resume: bool = False,
        on_begun: Callable[[], None] = lambda: None,
        force_filter: Callable[[], ForceFilter | None] = lambda: None,
    ) -> None:
        if comm.rank == 0 and header is None:
            raise ValueError("rank 0 needs the head of the result file")
        super().__init__(comm, flush_every)
        self._path = Path(path)
        self._header = header
        self._energy_every = energy_every
        self._record = record or LineRecord()
        self._resume = resume
        self._on_begun = on_begun
        self._force_filter = force_filter
        self._is_done = False
        self._view: StepView | None = None
        # Parts of a row of a view by channel, and the buffers that they go to.
        self._kept: dict[str, tuple[slice, np.ndarray]] = {}
        self._flushed_once = False
        self._extremes: dict[str, np.ndarray] = {}
        # Columns of the channels in a row, and rows in which the line's channels wait.
        self._parts: dict[str, slice] = {}
        self._waiting = np.zeros((0, 0))
        self._n_waiting = self._n_taken = 0
        self._rows = 0
        self._first_step = 0
        self._energies: list[tuple[float, ...]] = []

    @property
    def begun(self) -> bool:
        """Whether the result file holds this run; not before its first step. The same on all."""
        return self._resume or self._flushed_once

    def start(self, stage: Stage) -> None:
        """Make the buffers and open the file. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the file cannot be written.
        """
        rows = self._flush_every
        self._last_time, self._moving = stage.start_time, stage.moving
        self._record = self._record.of(stage.train)
        self._line = LineGather(self._comm, stage, self._record, rows)
        self._energies_follow_motion = channels.energies_follow_motion()
        self._time = np.zeros(rows)
        self._names = [channel.name for channel in channels.train_channels(stage.train)]
        self._guarded(lambda: self._open(stage), self._failed)
        if self._resume:
            self._guarded(self._read_extremes, self._failed)
            self._line.restore(self._comm.bcast(self._extremes, root=0))

    def observe(self, view: StepView) -> None:
        """Copy steps into the buffers; collective at the first step and whenever they are full."""
        begin = self._rows
        if begin == 0:
            self._first_step = view.first_step
        if not self._kept:
            self._make_room(view.columns)
        end = self._rows = begin + len(view.times)
        self._time[begin:end] = view.times
        for part, kept in self._kept.values():
            kept[begin:end] = view.rows[:, part]
        self._take_line(view)
        self._view = view
        self._last_time = view.time
        if self._energy_every and view.step % self._energy_every == 0:
            self._energies.append((view.time, *view.energies()))
        # The first step is written at once: it makes room for the state to continue from. After it
        # each flush ends with a chunk of the file: a chunk is written once, so that a kill in the
        # midst of writing one spoils no checksum of earlier rows.
        if (view.step + 1) % self._flush_every == 0 or not self._flushed_once:
            self._flush(view)

    def next_state(self, step: int) -> int:
        """The step of the next flush, or record of energies that need more than the motion."""
        following = super().next_state(step)
        if not self._energies_follow_motion:
            following = min(following, self._next_energies(step))
        return following

    def next_motion(self, step: int) -> int:
        """The step of the next record of the energies."""
        return self._next_energies(step)

    def _next_energies(self, step: int) -> int:
        every = self._energy_every
        return step - step % every + every if every else NEVER

    def finish(self, outcome: str) -> None:
        """Write what is left and the outcome. Collective.

        The state to continue from is renewed only if the run ended in good order.
        """
        if self._broken:
            return
        if self._kept:
            self._flush(self._view if outcome in (DONE, INTERRUPTED) else None)
        self._guarded(lambda: self._open_file.conclude(outcome), self._failed)
        self._is_done = outcome == DONE

    def close(self, performance: Mapping[str, Any] | None = None) -> None:
        """Write what is known at the very end as root attributes and close the file. Collective.

        Parameters
        ----------
        performance : mapping, optional
            Figures such as ``phase_wall_s``, ``march_wall_s`` and ``inner_iterations``,
            which rank 0 alone needs.
        """
        if not self._broken:
            self._guarded(lambda: self._close(performance or {}), self._failed)

    def _flush(self, view: StepView | None) -> None:
        """Gather the buffers, append them, and store the state of ``view``. Collective."""
        self._take_waiting()
        line = self._line()
        state = view.state() if view is not None else None
        self._guarded(lambda: self._append(self._blocks(), line, state), self._failed)
        self._rows = self._n_taken = 0
        self._energies.clear()
        self._flushed_once = True

    def _make_room(self, columns: Mapping[str, slice]) -> None:
        """Make a buffer for each channel of the train, so that a flush copies nothing."""
        self._parts = dict(columns)
        for name in self._names:
            part = columns[name]
            self._kept[name] = part, np.empty((self._flush_every, part.stop - part.start))
        width = max((part.stop for part in columns.values()), default=0)
        self._waiting = np.empty((_WAITING, width))

    def _take_line(self, view: StepView) -> None:
        """Take in the line's channels, of single steps a few together if all of the line moves."""
        if len(view.rows) > 1 or not self._moving.are_all:
            self._take_waiting()
            self._take(view.first_step, view.rows, all_move=False)
            return
        self._waiting[self._n_waiting] = view.row
        self._n_waiting += 1
        if self._n_waiting == _WAITING:
            self._take_waiting()

    def _take_waiting(self) -> None:
        """Flush the pending rows into the buffers of the line's channels."""
        n, self._n_waiting = self._n_waiting, 0
        if n:
            self._take(self._first_step + self._n_taken, self._waiting[:n], all_move=True)

    def _take(self, first_step: int, rows: np.ndarray, *, all_move: bool) -> None:
        self._line.take(first_step, rows, self._parts, all_move=all_move)
        self._n_taken += len(rows)

    def _columns(self, name: str) -> np.ndarray:
        """The buffer of a channel of the train, as far as it is filled, (rows, columns)."""
        return self._kept[name][1][: self._rows]

    # ---- rank 0 ------------------------------------------------------------------------------

    def _failed(self, error: Exception) -> RunBroken:
        """The error for the user; the file is closed with it, or abandoned."""
        broken = broken_write(self._path, self._last_time, error, self.begun)
        if isinstance(error, (NoRoom, Elsewhere)) and self._file is not None:
            self._file.conclude(str(broken))
            self._file.close({})
        elif self._file is not None:
            self._file.abandon()
        return broken

    def _open(self, stage: Stage) -> None:
        assert self._header is not None
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._file = ResultFile(
            self._path,
            stage,
            self._header,
            self._comm.size,
            rows_per_append=self._flush_every,
            with_energies=bool(self._energy_every),
            record=self._record,
            resume=self._resume,
            on_begun=self._on_begun,
        )
        self._header = None  # that of a long line is large

    def _append(
        self, blocks: Mapping[str, np.ndarray], line: LineRows, state: Mapping[str, Any] | None
    ) -> None:
        # In this order nothing is lost of a file that was moved.
        self._open_file.append(blocks, line, state)
        self._open_file.check_in_place()

    def _close(self, performance: Mapping[str, Any]) -> None:
        self._open_file.check_in_place()
        force_filter = self._force_filter() if self._is_done else None
        if force_filter is not None:
            self._open_file.store_filtered(force_filter)
        self._open_file.close(performance)

    def _read_extremes(self) -> None:
        found = self._open_file.extremes()
        if found is None:
            raise OSError("the extremes up to the state to continue from are missing")
        self._extremes = found

    def _blocks(self) -> dict[str, np.ndarray]:
        """Rows of the steps that a flush appends, by path."""
        blocks = {f"channels/{name}": self._columns(name) for name in self._names}
        if self._energies:
            table = np.array(self._energies)
            blocks.update({f"energy/{n}": table[:, i] for i, n in enumerate(channels.ENERGIES)})
        return {**blocks, "time": self._time[: self._rows]}
