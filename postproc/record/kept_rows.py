"""Rows of a channel of the line that wait for the next flush."""

from __future__ import annotations

import numpy as np


class KeptRows:
    """Rows of columns along the line: all of them, or those near the train.

    Not collective.

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
        """Columns that rows are to have, of which ``edges`` are from and to of a window [m]."""
        if self.is_whole or edges is None or self._x is None:
            return slice(0, self._n_columns)
        begin = int(np.searchsorted(self._x, edges[0].min()))
        end = int(np.searchsorted(self._x, edges[1].max(), side="right"))
        return slice(begin, max(begin, end))

    def put(self, rows: np.ndarray, columns: slice) -> None:
        """Keep ``rows`` (n, ...) of these columns, behind those that were kept before."""
        if self.is_whole:
            self._rows[self._n_rows : self._n_rows + len(rows)] = rows
        else:
            self._parts.append((columns.start, rows.copy()))
        self._n_rows += len(rows)

    def whole(self) -> tuple[int, np.ndarray]:
        """The first of the columns that were kept, and all rows of these, (n, columns), NaN where
        they were not; they count as written. Valid until the next ``put``."""
        n_rows, self._n_rows = self._n_rows, 0
        if self.is_whole:
            return 0, self._rows[:n_rows]
        begin = min((first for first, _ in self._parts), default=0)
        end = max((first + part.shape[1] for first, part in self._parts), default=begin)
        result = np.full((n_rows, end - begin), np.nan)
        at = 0
        for first, part in self._parts:
            there = slice(first - begin, first - begin + part.shape[1])
            result[at : at + len(part), there] = part
            at += len(part)
        self._parts.clear()
        return begin, result
