"""Extremes of the line's channels over every step, kept on the ranks while a run goes on."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.postproc.record.column_gather import ColumnGather
from catenary.solver.kernels import native


class Extremes:
    """Smallest and largest value of each column over all rows that were taken in.

    Collective to make.

    Parameters
    ----------
    comm : mpi4py communicator
    owned : (n_owned,) int, global numbers of this rank's columns
    n_columns : number of columns over all ranks
    """

    def __init__(self, comm: Any, owned: np.ndarray, n_columns: int) -> None:
        self._owned = np.asarray(owned, dtype=np.int64)
        self._gather = ColumnGather(comm, self._owned, n_columns, 2)
        self._kept = np.empty((2, self._owned.size))
        self._kept[0], self._kept[1] = np.inf, -np.inf

    def restore(self, whole: np.ndarray) -> None:
        """Continue from what ``whole`` gave, (2, n_columns), on any ranks. Not collective."""
        self._kept[:] = whole[:, self._owned]

    def take(self, rows: np.ndarray, part: slice, columns: slice) -> None:
        """Take in rows of a step's channels, as far as the owned columns have changed.

        Not collective.

        Parameters
        ----------
        rows : (rows, n) contiguous
        part : where in a row the owned columns are
        columns : which of these have changed
        """
        begin, end, _ = columns.indices(self._owned.size)
        native.take_extremes(rows, part.start, begin, end, self._kept)

    def whole(self) -> np.ndarray:
        """Smallest and largest value of all columns, (2, n_columns), on rank 0. Collective."""
        return self._gather(self._kept)
