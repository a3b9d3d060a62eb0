"""Tables of a result file that are read around their damage."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from catenary.postproc.read.attributes import HDF5_ERRORS


class PartialTable:
    """A growing dataset of which some rows are damaged: they read as NaN. Not collective.

    Read like an h5py dataset, by rows first.

    Parameters
    ----------
    table : the dataset, None if there is none that can be opened
    shape : rows and columns, rows only for one value a row
    damaged : from and to of the damaged rows, none of which are read
    """

    def __init__(
        self, table: h5py.Dataset | None, shape: tuple[int, ...], damaged: list[tuple[int, int]]
    ) -> None:
        self._table = table
        self.shape = shape
        self.chunks = table.chunks if table is not None else None
        self.dtype = np.dtype(float)
        self._damaged = damaged if table is not None else [(0, shape[0])]

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of values."""
        return int(np.prod(self.shape))

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype: Any = None) -> np.ndarray:
        return np.asarray(self[...], dtype=dtype)

    def read_direct(self, values: np.ndarray, source: Any) -> None:
        """Read a part into an array, as ``h5py.Dataset.read_direct``."""
        values[...] = self[source]

    def __getitem__(self, key: Any) -> Any:
        first, *others = key if isinstance(key, tuple) else (key,)
        if first is Ellipsis:
            first, others = slice(None), []
        if not isinstance(first, slice):  # a row
            row = int(first) % max(self.shape[0], 1)
            return self._rows(row, row + 1)[(0, *others)]
        start, stop, step = first.indices(self.shape[0])
        if step < 1:
            raise ValueError("rows are read in order")
        if len(others) == 1 and isinstance(others[0], int | np.integer):
            return self._column(int(others[0]), start, max(start, stop))[::step]
        return self._rows(start, max(start, stop))[(slice(None, None, step), *others)]

    def _rows(self, start: int, stop: int) -> np.ndarray:
        values = np.full((stop - start, *self.shape[1:]), np.nan)
        for begin, end in sound_parts(self._damaged, start, stop):
            assert self._table is not None
            values[begin - start : end - start] = self._table[begin:end]
        return values

    def _column(self, index: int, start: int, stop: int) -> np.ndarray:
        """Rows of one column, without those of the others in memory."""
        values = np.full(stop - start, np.nan)
        for begin, end in sound_parts(self._damaged, start, stop):
            assert self._table is not None
            values[begin - start : end - start] = self._table[begin:end, index]
        return values


def sound_parts(damaged: list[tuple[int, int]], start: int, stop: int) -> list[tuple[int, int]]:
    """Ranges of rows from ``start`` to ``stop`` without the damaged ones, which are in order."""
    parts, at = [], start
    for begin, end in damaged:
        if end <= at:
            continue
        if begin >= stop:
            break
        if begin > at:
            parts.append((at, begin))
        at = end
    if at < stop:
        parts.append((at, stop))
    return parts


# Values checked at once.
_BLOCK = 1 << 18


def damaged_rows(
    table: h5py.Dataset, n_rows: int, largest: float, may_be_nan: bool = False
) -> list[tuple[int, int]]:
    """Ranges of rows that cannot be read, or hold NaN, infinity or what is beyond ``largest``."""
    found: list[tuple[int, int]] = []
    chunk = table.chunks[0] if table.chunks else 1
    step = max(1, _BLOCK // _columns(table) // chunk) * chunk
    for start in range(0, n_rows, step):
        stop = min(start + step, n_rows)
        try:
            bad = _bad(table, start, stop, largest, may_be_nan)
            found += [(start + a, start + b) for a, b in _runs(bad)]
        except HDF5_ERRORS:
            found += _by_chunks(table, start, stop, chunk, largest, may_be_nan)
    return _joined(found)


def _by_chunks(
    table: h5py.Dataset, start: int, stop: int, chunk: int, largest: float, may_be_nan: bool
) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    for begin in range(start, stop, chunk):
        end = min(begin + chunk, stop)
        try:
            bad = _bad(table, begin, end, largest, may_be_nan)
            found += [(begin + a, begin + b) for a, b in _runs(bad)]
        except HDF5_ERRORS:
            found.append((begin, end))
    return found


def _columns(table: h5py.Dataset) -> int:
    """Columns that are read at once, of a table of columns whole chunks; one if it has none."""
    width = int(np.prod(table.shape[1:])) if table.ndim > 1 else 1
    if table.ndim != 2 or not table.chunks:
        return max(width, 1)
    rows, columns = table.chunks
    return int(max(1, min(width, max(1, _BLOCK // (rows * columns)) * columns)))


def _bad(
    table: h5py.Dataset, start: int, stop: int, largest: float, may_be_nan: bool
) -> np.ndarray:
    """Which rows from ``start`` to ``stop`` hold something that cannot be, (rows,) bool."""
    if table.ndim != 2:
        return _beyond(table[start:stop], largest, may_be_nan)
    bad, step = np.zeros(stop - start, dtype=bool), _columns(table)
    for first in range(0, table.shape[1], step):
        values = table[start:stop, first : first + step]
        bad |= _beyond(values, largest, may_be_nan)
    return bad


def _beyond(values: np.ndarray, largest: float, may_be_nan: bool) -> np.ndarray:
    """Which rows of ``values`` (rows, ...) hold something that cannot be, (rows,) bool."""
    with np.errstate(invalid="ignore"):
        sound = np.abs(values) <= largest
        if may_be_nan:
            sound |= np.isnan(values)
    return np.asarray(~sound.all(axis=tuple(range(1, values.ndim))))


def _runs(bad: np.ndarray) -> list[tuple[int, int]]:
    """From and to of each run of true entries."""
    change = np.diff(np.concatenate([[0], bad.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _joined(parts: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Ranges in order with those that touch as one."""
    joined: list[tuple[int, int]] = []
    for begin, end in parts:
        if joined and joined[-1][1] == begin:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return joined
