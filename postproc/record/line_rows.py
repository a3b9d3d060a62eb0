"""The line's channels of the steps between two flushes: extremes, thinned rows, gathered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.record.column_gather import ColumnGather
from catenary.postproc.record.extremes import Extremes
from catenary.postproc.record.kept_rows import KeptRows
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import Stage


class LineRows(NamedTuple):
    """What a flush appends of the line's channels, on rank 0.

    Attributes
    ----------
    chosen : (n,) int, which of the buffered rows are recorded
    values : name -> the first of the columns that are kept, and these (n, columns)
    extremes : name -> (2, all columns), smallest and largest since the start of the run
    """

    chosen: np.ndarray
    values: dict[str, tuple[int, np.ndarray]]
    extremes: dict[str, np.ndarray]


class _Part(NamedTuple):
    """A channel on this rank: which of its columns are recorded, what keeps and what gathers them.

    ``gather`` and ``kept`` are None if the channel is not recorded.
    """

    columns: np.ndarray
    gather: ColumnGather | None
    kept: KeptRows | None
    extremes: Extremes


class LineGather:
    """Takes the line's channels of steps together. Collective to make, as its ``__call__``.

    Parameters
    ----------
    comm : mpi4py communicator
    stage : of the run
    record : what is recorded
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
            extremes = Extremes(comm, owned, x.size)
            gather = kept = None
            if name in record.names:
                gather = ColumnGather(comm, place[owned[mine]], recorded.size, rows)
                # Ranks send all their columns: what they keep of a row is then the same in each.
                in_parts = record.window is not None and comm.size == 1
                kept = KeptRows(rows, mine.size, x[owned[mine]] if in_parts else None)
            self._parts[name] = _Part(mine, gather, kept, extremes)

    def restore(self, extremes: Mapping[str, np.ndarray]) -> None:
        """Continue from extremes by name, (2, all columns) each, on all ranks. Not collective."""
        for name, whole in extremes.items():
            self._parts[name].extremes.restore(whole)

    def take(
        self, first_step: int, rows: np.ndarray, parts: Mapping[str, slice], *, all_move: bool
    ) -> None:
        """Take in steps that follow one another. Not collective.

        Parameters
        ----------
        first_step : number of the first one
        rows : (steps, n) contiguous, of all channels
        parts : name of a channel -> where in a row its owned columns are
        all_move : whether any column may have changed; those of ``stage.moving`` if not
        """
        every, position = self._record.every, rows[:, parts["contact_position"]]
        start, n_steps = -first_step % every, len(position)
        self._chosen.append(np.arange(start, n_steps, every) + self._n_taken)
        self._n_taken += n_steps
        edges = self._record.within(position[start::every])
        for name, part in self._parts.items():
            moved = slice(None) if all_move else self._moving.columns(name)
            part.extremes.take(rows, parts[name], moved)
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
                first, kept = part.kept.whole()
                values[name] = first, part.gather(kept) if part.kept.is_whole else kept
        extremes = {name: part.extremes.whole() for name, part in self._parts.items()}
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *self._chosen])
        self._chosen.clear()
        self._n_taken = 0
        return LineRows(chosen, values, extremes)
