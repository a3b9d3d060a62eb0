"""The line's channels of the steps between two flushes: extremes, thinned rows, gathered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.files.result_file import LineRows
from catenary.postproc.record.column_gather import ColumnGather
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import Stage


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
