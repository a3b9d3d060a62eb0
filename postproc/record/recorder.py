"""Writes the channels of a run into its result file while the run goes on.

Between flushes a step only copies numbers into buffers; of the line's channels it takes extremes,
and the rows and columns that are recorded. A flush gathers all of it to rank 0, which appends it
with the serial driver, stores the state to continue from and makes HDF5 write all tables, so that a
killed run leaves a file that is readable up to its last flush.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.postproc.files.committed_rows import ForceFilter
from catenary.postproc.files.disk import Elsewhere, NoRoom, broken_write
from catenary.postproc.files.header import Header, LineRecord
from catenary.postproc.files.result_file import LineRows, ResultFile
from catenary.postproc.files.run_schema import DONE, INTERRUPTED
from catenary.postproc.record.file_observer import ColumnGather, FileObserver
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


def take_extremes(rows: np.ndarray, kept: np.ndarray) -> None:
    """Take rows (n, m) into ``kept`` (2, m), the smallest and the largest of each column."""
    smallest, largest = kept
    np.fmin(smallest, np.fmin.reduce(rows, axis=0, initial=np.inf), out=smallest)
    np.fmax(largest, np.fmax.reduce(rows, axis=0, initial=-np.inf), out=largest)


class _KeptRows:
    """Rows of columns along the line, all of them or those near the train, until the next flush.

    Parameters
    ----------
    n_rows : most rows
    n_columns : of a row
    x : (n_columns,) where the columns are [m], if those near the train are enough; None for all

    Attributes
    ----------
    is_whole : whether all columns are kept
    """

    def __init__(self, n_rows: int, n_columns: int, x: np.ndarray | None) -> None:
        # Columns between two places stand side by side only in the order of the track.
        self.is_whole = x is None or bool((np.diff(x) < 0.0).any())
        self._x, self._n_columns, self._n_rows = x, n_columns, 0
        self._rows = np.empty((n_rows if self.is_whole else 0, n_columns))
        self._parts: list[tuple[int, np.ndarray]] = []

    def columns_within(self, edges: tuple[np.ndarray, np.ndarray] | None) -> slice:
        """Columns to keep of rows whose window reaches from and to ``edges`` [m]."""
        if self.is_whole or edges is None or self._x is None:
            return slice(0, self._n_columns)
        begin = int(np.searchsorted(self._x, edges[0].min()))
        end = int(np.searchsorted(self._x, edges[1].max(), side="right"))
        return slice(begin, max(begin, end))

    def put(self, rows: np.ndarray, columns: slice) -> None:
        """Append ``rows`` (n, ...) of some columns."""
        if self.is_whole:
            self._rows[self._n_rows : self._n_rows + len(rows)] = rows
        else:
            self._parts.append((columns.start, rows.copy()))
        self._n_rows += len(rows)

    def take_out(self) -> tuple[int, np.ndarray]:
        """The first of the columns that were kept, and all rows of these, (n, columns), NaN where
        they were not. Valid until the next ``put``."""
        n_rows, self._n_rows = self._n_rows, 0
        if self.is_whole:
            return 0, self._rows[:n_rows]
        begin = min((first for first, _ in self._parts), default=0)
        end = max((first + part.shape[1] for first, part in self._parts), default=begin)
        result, at = np.full((n_rows, end - begin), np.nan), 0
        for first, part in self._parts:
            result[at : at + len(part), first - begin : first - begin + part.shape[1]] = part
            at += len(part)
        self._parts.clear()
        return begin, result


class _Part(NamedTuple):
    """A channel on this rank.

    Attributes
    ----------
    owned : (n,) numbers of the rank's columns
    columns : which of these are recorded
    gather, kept : of the recorded ones; None if the channel is not recorded
    extremes : (2, n) smallest and largest value of every step
    gather_extremes : of all columns
    """

    owned: np.ndarray
    columns: np.ndarray
    gather: ColumnGather | None
    kept: _KeptRows | None
    extremes: np.ndarray
    gather_extremes: ColumnGather


class LineGather:
    """Takes the line's channels of steps together. Collective to make, as its ``__call__``.

    Parameters
    ----------
    comm : mpi4py communicator
    stage : of the run
    record : recorded part of the channels
    max_rows : steps between two calls at most
    """

    def __init__(self, comm: Any, stage: Stage, record: LineRecord, max_rows: int) -> None:
        self._record, self._moving = record, stage.moving
        places = stage.places
        rows = max_rows // record.every + 1
        self._parts: dict[str, _Part] = {}
        self._chosen: list[np.ndarray] = []
        self._n_taken = 0
        for name in channels.line_channels(stage.train):
            x, owned = places[channels.CHANNELS[name].per]
            owned = np.asarray(owned, dtype=np.int64)
            recorded = record.columns(x)
            place = np.full(x.size, -1)
            place[recorded] = np.arange(recorded.size)
            mine = np.flatnonzero(place[owned] >= 0)
            extremes = np.repeat([[np.inf], [-np.inf]], owned.size, axis=1)
            all_columns = ColumnGather(comm, owned, x.size, 2)
            gather = kept = None
            if name in record.names:
                gather = ColumnGather(comm, place[owned[mine]], recorded.size, rows)
                # Ranks send all their columns: what they keep of a row is then the same in each.
                in_parts = record.window is not None and comm.size == 1
                kept = _KeptRows(rows, mine.size, x[owned[mine]] if in_parts else None)
            self._parts[name] = _Part(owned, mine, gather, kept, extremes, all_columns)

    def restore(self, extremes: Mapping[str, np.ndarray]) -> None:
        """Continue from extremes by name, (2, all columns) each, on all ranks. Not collective."""
        for name, whole in extremes.items():
            part = self._parts[name]
            part.extremes[:] = whole[:, part.owned]

    def take(
        self, first_step: int, rows: np.ndarray, parts: Mapping[str, slice], *, all_move: bool
    ) -> None:
        """Take in steps that follow one another. Not collective.

        Parameters
        ----------
        first_step : int
            Number of the first step.
        rows : ndarray, shape (steps, n)
            Rows of all channels, contiguous.
        parts : mapping
            Where in a row the owned columns of a channel are, by its name.
        all_move : bool
            Whether any column may have changed; those of ``stage.moving`` if not.
        """
        every, position = self._record.every, rows[:, parts["contact_position"]]
        start, n_steps = -first_step % every, len(position)
        self._chosen.append(np.arange(start, n_steps, every) + self._n_taken)
        self._n_taken += n_steps
        edges = self._record.within(position[start::every])
        for name, part in self._parts.items():
            moved = slice(None) if all_move else self._moving.columns(name)
            mine = rows[:, parts[name]][:, : part.owned.size]
            take_extremes(mine[:, moved], part.extremes[:, moved])
            if part.kept is not None and start < n_steps:
                shown = rows[start::every, parts[name]]
                own = part.kept.columns_within(edges)
                if part.columns.size != shown.shape[1]:
                    part.kept.put(shown[:, part.columns[own]], own)
                else:
                    part.kept.put(shown[:, own], own)

    def __call__(self) -> LineRows:
        """Gather what was taken in since the latest call. Collective."""
        values = {}
        for name, part in self._parts.items():
            if part.gather is not None and part.kept is not None:
                first, kept = part.kept.take_out()
                values[name] = first, part.gather(kept) if part.kept.is_whole else kept
        extremes = {name: part.gather_extremes(part.extremes) for name, part in self._parts.items()}
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *self._chosen])
        self._chosen.clear()
        self._n_taken = 0
        return LineRows(chosen, values, extremes)
