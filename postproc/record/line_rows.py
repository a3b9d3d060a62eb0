"""The line's channels of the steps between two flushes: extremes, thinned rows, gathered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.record.column_gather import ColumnGather
from catenary.postproc.record.extremes import Extremes
from catenary.solver.time_loop import channels
from catenary.solver.time_loop.observers import Stage


class LineRows(NamedTuple):
    """What a flush appends of the line's channels, on rank 0.

    Attributes
    ----------
    chosen : (n,) int, which of the buffered rows are recorded
    values : name -> (n, recorded columns)
    extremes : name -> (2, all columns), smallest and largest since the start of the run
    """

    chosen: np.ndarray
    values: dict[str, np.ndarray]
    extremes: dict[str, np.ndarray]


class _Part(NamedTuple):
    """A channel on this rank: which of its columns are recorded, and what gathers them."""

    columns: np.ndarray
    gather: ColumnGather | None
    extremes: Extremes


class LineGather:
    """Takes the line's channels of buffered steps together. Collective, as its ``__call__``.

    Parameters
    ----------
    comm : mpi4py communicator
    stage : of the run
    record : what is recorded
    max_rows : rows of the largest buffer
    """

    def __init__(self, comm: Any, stage: Stage, record: LineRecord, max_rows: int) -> None:
        self._every = record.every
        places = {
            channels.ARM: (stage.arm_x, stage.owned_arms),
            channels.DROPPER: (stage.dropper_x, stage.owned_droppers),
        }
        self._parts: dict[str, _Part] = {}
        for name in channels.line_channels():
            x, owned = places[channels.CHANNELS[name].per]
            owned = np.asarray(owned, dtype=np.int64)
            recorded = record.columns(x)
            place = np.full(x.size, -1)
            place[recorded] = np.arange(recorded.size)
            mine = np.flatnonzero(place[owned] >= 0)
            extremes = Extremes(comm, owned, x.size)
            gather = None
            if name in record.names:
                rows = max_rows // record.every + 1
                gather = ColumnGather(comm, place[owned[mine]], recorded.size, rows)
            self._parts[name] = _Part(mine, gather, extremes)

    def restore(self, extremes: Mapping[str, np.ndarray]) -> None:
        """Continue from extremes by name, (2, all columns) each, on all ranks. Not collective."""
        for name, whole in extremes.items():
            self._parts[name].extremes.restore(whole)

    def __call__(self, first_step: int, rows: Callable[[str], np.ndarray]) -> LineRows:
        """Take in buffered rows and gather what is recorded. Collective.

        Parameters
        ----------
        first_step : number of the step of the first buffered row
        rows : name of a channel -> (buffered rows, owned columns)
        """
        values, extremes = {}, {}
        chosen = np.zeros(0, dtype=np.int64)
        for name, part in self._parts.items():
            block = rows(name)
            part.extremes.take(block)
            extremes[name] = part.extremes.whole()
            start = -first_step % self._every
            chosen = np.arange(start, block.shape[0], self._every)
            if part.gather is not None:
                kept = block[start :: self._every]
                if part.columns.size != block.shape[1]:
                    kept = kept[:, part.columns]
                values[name] = part.gather(np.ascontiguousarray(kept))
        return LineRows(chosen, values, extremes)
