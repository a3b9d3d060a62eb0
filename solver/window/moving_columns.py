"""Columns of the rows that steps show, which change with the moving stations of a line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.solver.kernels import native

_ALL = slice(None)


class Columns(native.Columns):
    """Columns of several tables by the stations that they follow from, see ``native.Columns``."""

    __slots__ = ()

    @property
    def n_stations(self) -> int:
        return self.starts.size - 1


def columns_of(
    tables: Sequence[np.ndarray], n_unknowns: int, stations: tuple[np.ndarray, np.ndarray] | None
) -> Columns:
    """Columns of several tables by the stations that they follow from. Not collective.

    Parameters
    ----------
    tables : sequence of ndarray, shape (m, l)
        Unknowns that each of the m columns of a table follows from.
    n_unknowns : int
        Unknowns of the rank.
    stations : tuple of ndarray or None
        ``ends`` and ``starts``; without them the line is a single station, which moves.
    """
    ends, starts = (np.array([0, 1]), np.array([0, n_unknowns])) if stations is None else stations
    n = starts.size - 1
    # A line has so many stations that numbers of half the length are worth it.
    first = np.empty((n + 1, len(tables)), dtype=np.int32)
    last = np.zeros_like(first)
    for k, unknowns in enumerate(tables):
        of_column = np.searchsorted(starts, unknowns, side="right") - 1
        columns = np.arange(len(unknowns), dtype=first.dtype)
        first[:, k] = len(unknowns)
        np.minimum.at(first[:, k], of_column.max(axis=1, initial=0), columns)
        np.maximum.at(last[:, k], of_column.min(axis=1, initial=n) + 1, columns + 1)
    first = np.minimum.accumulate(first[::-1], axis=0)[::-1]
    last = np.maximum.accumulate(last, axis=0)
    starts = np.asarray(starts, dtype=np.int64)
    return Columns(ends, starts, np.ascontiguousarray(first), last)


def widen(stations: np.ndarray, begin: int, end: int) -> None:
    """Extend a range (2,) of stations, in place, to those from ``begin`` to ``end``."""
    stations[0] = min(int(stations[0]), begin)
    stations[1] = max(int(stations[1]), end)


class MovingColumns:
    """Columns of the rows that steps show, with those that changed since the rows before.

    Those who step the line keep it up to date. Not collective.
    """

    def __init__(self) -> None:
        self._columns: dict[str, slice] = {}

    def all_move(self) -> None:
        """Say that any column may have changed."""
        self._columns.clear()

    def follow(self, columns: Columns, names: Sequence[str], stations: np.ndarray) -> None:
        """Say that only ``stations`` (2,), from and to, have moved.

        Parameters
        ----------
        columns : Columns
            Columns by stations.
        names : sequence of str
            Names of the first tables of ``columns``.
        stations : ndarray, shape (2,)
            First station that has moved and the one after the last.
        """
        begin, end = stations.tolist()
        firsts, lasts = columns.first[begin].tolist(), columns.last[end].tolist()
        for name, first, last in zip(names, firsts, lasts, strict=False):
            self._columns[name] = slice(first, max(first, last))

    def columns(self, name: str) -> slice:
        """Columns of a channel that may have changed."""
        return self._columns.get(name, _ALL)

    @property
    def are_all(self) -> bool:
        """Whether any may have."""
        return not self._columns


class MovedStations:
    """For each of several rows that are filled again and again: where they are out of date.

    Only what has moved since a row was filled last has to be filled in again. Not collective.

    Attributes
    ----------
    now : (2,) first station that moved in the present block of steps and the one after the last
    behind : (n_rows, 2) the same of each row, since it was filled
    """

    def __init__(self, n_rows: int, columns: Columns) -> None:
        self._columns = columns
        self.behind = np.zeros((n_rows, 2), dtype=np.int64)
        self.now = np.zeros(2, dtype=np.int64)
        self._last_step = -1

    def begin(self, step: int) -> None:
        """Before a block of steps after the one of number ``step``."""
        self.now[:] = self._columns.ends[:2]
        if step != self._last_step:
            self.behind[:] = 0, self._columns.n_stations

    def end(self, step: int, filled: int) -> None:
        """After a block up to step ``step``, of which the first rows were ``filled``."""
        if self._columns.n_stations == 1:
            return  # all of a row is filled each time
        self.behind[:filled] = self.now
        np.minimum(self.behind[filled:, 0], self.now[0], out=self.behind[filled:, 0])
        np.maximum(self.behind[filled:, 1], self.now[1], out=self.behind[filled:, 1])
        self._last_step = step
