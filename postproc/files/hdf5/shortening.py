"""Cuts growing tables of a result file where a run goes on, around chunks that are damaged."""

from __future__ import annotations

import h5py
import numpy as np

_NO_FILTER = 0xFFFFFFFF


class DamagedClock(Exception):
    """A table of times cannot be read where a run would go on; the message is a clause."""


def rows_before(clock: h5py.Dataset, n: int, time: float) -> int:
    """How many of the first ``n`` ascending times of a table are before ``time``.

    By bisection: nothing that grows with the run is read. Times that cannot be read count as late.

    Raises
    ------
    DamagedClock
        If the first of the late times cannot be read, so that there may be more early ones.
    """
    low, high, damaged = 0, n, -1
    while low < high:
        middle = (low + high) // 2
        try:
            early = bool(clock[middle] < time)
        except OSError:
            early, damaged = False, middle
        if early:
            low = middle + 1
        else:
            high = middle
    if low == damaged:
        raise DamagedClock(f"{clock.name[1:]} is damaged from record {low} on, of {n}")
    return low


def shorten(file: h5py.File, path: str, rows: int) -> int:
    """Cut a growing table to ``rows``; returns how many of them were found lost at its end.

    HDF5 reads the last chunk that stays in part, and refuses to cut it or to append to it if its
    checksum is wrong. Such a chunk is replaced by one of NaN. The table must not be open elsewhere.
    """
    lost = _mend_end(file[path], rows)
    # Opened anew: an open table remembers the chunk that it has read last, filters included.
    table = file[path]
    table.resize(min(rows, table.shape[0]), axis=0)
    return lost


def _mend_end(table: h5py.Dataset, rows: int) -> int:
    """Replace damaged chunks of the last ``rows`` that stay; returns how many rows are lost."""
    lost = 0
    rows = min(rows, table.shape[0])
    begin = rows - rows % table.chunks[0]
    width = table.chunks[1] if table.ndim > 1 else 1
    for first in range(0, table.shape[1] if table.ndim > 1 else 1, width):
        part = (slice(begin, rows), slice(first, first + width))[: table.ndim]
        try:
            table[part]
        except OSError:
            empty = np.full(table.chunks, np.nan, dtype=table.dtype)
            table.id.write_direct_chunk((begin, first)[: table.ndim], empty.tobytes(), _NO_FILTER)
            lost = rows - begin
    return lost
