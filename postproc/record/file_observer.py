"""Base of observers that write a file: rank 0 writes at flushes, and failures end runs.

Between flushes ranks keep rows in memory.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

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
