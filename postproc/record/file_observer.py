"""Base of observers that write a file: ranks keep rows, rank 0 gathers their columns and writes.

Between flushes ranks keep rows in memory. At a flush the blocks of rows, whose columns are spread
over the ranks, are put together on rank 0 (`ColumnGather`), which writes; a failure there ends the
run on all ranks.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

from catenary.base.errors import RunBroken
from catenary.base.parallel import on_root
from catenary.solver.time_loop.views.observers import Observer

File = TypeVar("File")


class FileObserver(Observer, Generic[File]):
    """Observer whose file rank 0 writes.

    Parameters
    ----------
    comm : mpi4py communicator
    flush_every : steps between two flushes
    """

    def __init__(self, comm: Any, flush_every: int) -> None:
        self._comm = comm
        self._flush_every = flush_every
        self._broken = False
        # On rank 0, once it is open.
        self._file: File | None = None

    def next_state(self, step: int) -> int:
        """The step of the next flush, the last of ``flush_every``."""
        return step + self._flush_every - (step + 1) % self._flush_every

    def _guarded(self, work: Callable[[], None], broken: Callable[[Exception], RunBroken]) -> None:
        """Run ``work`` on rank 0; if it fails, all ranks raise what ``broken`` makes of the error.

        Collective.
        """

        def attempt() -> None:
            try:
                work()
            except (OSError, RuntimeError) as error:  # h5py raises both when a disk is full
                raise broken(error) from error

        try:
            on_root(self._comm, attempt)
        except RunBroken:
            self._broken = True
            raise

    @property
    def _open_file(self) -> File:
        assert self._file is not None  # since the start
        return self._file


class ColumnGather:
    """Gathers (rows, owned columns) blocks of all ranks into one (rows, all columns) on rank 0.

    Collective. Buffers are made once, so that a later gather allocates nothing that grows with the
    line.

    Parameters
    ----------
    comm : mpi4py communicator
    owned : (n_owned,) int, global numbers of this rank's columns; may be empty
    n_columns : number of columns over all ranks
    max_rows : rows of the largest block

    Raises
    ------
    ValueError
        On rank 0, RuntimeError elsewhere, if a column has no owner or more than one.
    """

    def __init__(self, comm: Any, owned: np.ndarray, n_columns: int, max_rows: int) -> None:
        self._comm = comm
        owned = np.asarray(owned, dtype=np.int64)
        parts = comm.gather(owned, root=0)
        self._parts: list[np.ndarray] = parts if parts is not None else []
        on_root(comm, lambda: _check_partition(self._parts, n_columns))
        self.n_owned = int(owned.size)
        self.n_columns = n_columns
        # One rank's columns need no putting together, if they are all there.
        self._in_order = comm.size == 1 and np.array_equal(owned, np.arange(n_columns))
        self._max_rows, self._has_room = max_rows, False

    def twin(self) -> ColumnGather:
        """Another one of the same columns, with room of its own. Not collective."""
        twin = copy.copy(self)
        twin._has_room = False
        return twin

    def _make_room(self) -> None:
        """Room for what is received, at the first gather that needs it."""
        self._has_room = True
        self._received = np.empty(self._max_rows * self.n_columns)
        self._whole = np.zeros((self._max_rows, self.n_columns))

    def __call__(self, block: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
        """All columns of the ranks' blocks on rank 0, an empty array elsewhere. Collective.

        Parameters
        ----------
        block : ndarray
            Rows (rows, n_owned) of the rank's columns, float64 and C-contiguous, the
            same number on all ranks; with ``among`` of these columns alone.
        among : ndarray, shape (n_columns,), dtype bool, optional
            Mask of the columns that are gathered, the same on all ranks; None for all.

        Returns
        -------
        (rows, n_columns) view that the next call overwrites, or the block itself
        """
        rows = block.shape[0]
        if self._comm.rank != 0:
            self._comm.Gatherv(block, None, root=0)
            return np.empty((rows, 0))
        if self._in_order and among is None:
            return block
        if not self._has_room:
            self._make_room()
        whole = self._whole[:rows]
        parts = self._parts if among is None else [part[among[part]] for part in self._parts]
        counts = [rows * part.size for part in parts]
        self._comm.Gatherv(block, [self._received[: sum(counts)], counts], root=0)
        start = 0
        for part, count in zip(parts, counts, strict=True):
            whole[:, part] = self._received[start : start + count].reshape(rows, part.size)
            start += count
        return whole


def _check_partition(parts: list[np.ndarray], n_columns: int) -> None:
    claimed = np.sort(np.concatenate(parts))
    if not np.array_equal(claimed, np.arange(n_columns)):
        raise ValueError(
            f"the ranks own {claimed.size} of {n_columns} columns, each must have one owner"
        )
