"""Attributes, arrays and growing tables in HDF5, such that damage shows when they are read.

Object headers, links and dense attributes carry checksums of HDF5 from ``FORMAT_BOUNDS`` on. Text
of variable length lies in HDF5's global heap, which has none: text is stored with a fixed length.
Attributes above 4 KiB and arrays without a filter have none either: they get a CRC-32 of ours.

Tables are read by blocks of rows: memory does not grow with a run.

HDF5 follows links and external storage by itself. A file from a stranger could so read, and a run
that is continued overwrite, any file of the user: ``open_own`` opens no file that links to another
one, or has a table in it. Not collective.
"""

from __future__ import annotations

import functools
import json
import os
import stat
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5l, h5o, h5p, h5s, h5t

from catenary.base.errors import InputError

# The oldest format of HDF5 whose object headers, links and attributes carry checksums. The next
# one marks a file as open for writing: after a kill nobody could open it.
FORMAT_BOUNDS = ("v108", "v108")
# Exceptions of HDF5 and h5py at a damaged file.
HDF5_ERRORS = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError)
# Attribute with the checksums of the other attributes, by name, as JSON.
ATTRIBUTE_SUMS = "attribute_crc32"
# Attribute of a group with one checksum of all its arrays.
ARRAYS_SUM = "crc32"
# Description of a link or a table that leads elsewhere, in the error.
_LINKS = {h5l.TYPE_SOFT: "is a soft link", h5l.TYPE_EXTERNAL: "is a link into another file"}
_OWN_KINDS = {
    stat.S_IFLNK: "is a symbolic link, and result files are not opened through links; name the "
    "folder in which the file itself lies",
    stat.S_IFDIR: "is a folder",
}
_NO_FILTER = 0xFFFFFFFF
# Largest size of a block of rows [B].
BLOCK_BYTES = 16e6
# Columns of a wide table that are read at once.
COLUMNS_AT_ONCE = 256
# Rows of a column that are read at once.
_SLICE = 1 << 18


class Damage(Exception):
    """A file is damaged; the message is a clause that follows its name."""


def put_array(group: h5py.Group, name: str, values: Any) -> h5d.DatasetID:
    """Store an array in place of an earlier one of its name; returns its table.

    One of the same shape and type is overwritten where it stands, so that the file does not grow.
    Text and what else is no number goes through h5py.
    """
    # A flush does so with each array of a state. HDF5's own calls take a fourth to a third of the
    # time of h5py's general ones, which find out anew what is the same for all of ours: numbers in
    # contiguous arrays, written as they are.
    array, key = np.asarray(values, order="C"), name.encode()
    is_plain = array.dtype.kind in "fiu"
    if key in group.id:
        old = h5d.open(group.id, key)
        if is_plain and old.shape == array.shape and old.dtype == array.dtype:
            old.write(h5s.ALL, h5s.ALL, array)
            return old
        del group[name]
    if not is_plain:
        return group.create_dataset(name, data=values).id
    space = h5s.create_simple(array.shape) if array.ndim else h5s.create(h5s.SCALAR)
    made = h5d.create(group.id, key, _number_type(array.dtype), space, _how_to_create())
    if array.size:
        made.write(h5s.ALL, h5s.ALL, array)
    return made


@functools.cache
def _how_to_create() -> h5p.PropDCID:
    how = h5p.create(h5p.DATASET_CREATE)
    how.set_obj_track_times(False)
    return how


@functools.cache
def _number_type(dtype: np.dtype) -> h5t.TypeID:
    return h5t.py_create(dtype, logical=True)


def set_attribute(place: h5py.HLObject, name: str, value: Any) -> None:
    """Store an attribute, text with a fixed length in UTF-8; one that is there is replaced so that
    no moment is without it."""
    if isinstance(value, str):
        text = value.encode()
        value = np.array(text, dtype=h5py.string_dtype("utf-8", max(1, len(text))))
    place.attrs.create(name, value)


def text_of(value: Any) -> Any:
    """An attribute's value as Python's own type: text as ``str``, a NumPy scalar as its item.

    Raises
    ------
    UnicodeDecodeError
        If text is no UTF-8.
    """
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.generic):
        return value.item()
    return value


def seal_attributes(place: h5py.HLObject, names: Iterable[str] | None = None) -> None:
    """Store the checksums of attributes of ``place``, of all that it has now if none are named."""
    chosen = list(place.attrs) if names is None else names
    sums = {name: _sum_of(text_of(place.attrs[name])) for name in chosen}
    set_attribute(place, ATTRIBUTE_SUMS, json.dumps(sums))


def broken_seals(place: h5py.HLObject, values: Mapping[str, Any]) -> list[str]:
    """Names of attributes whose value is not the sealed one or that are missing.

    Parameters
    ----------
    place : h5py.HLObject
        File, group or dataset with sealed attributes.
    values : mapping
        Name -> attribute of ``place``.

    Raises
    ------
    ValueError
        If the checksums themselves are damaged.
    """
    if ATTRIBUTE_SUMS not in place.attrs:  # a file of an earlier version
        return []
    sums = json.loads(text_of(place.attrs[ATTRIBUTE_SUMS]))
    if not isinstance(sums, dict):
        raise ValueError("it is no table")
    return [
        name for name, known in sums.items() if name not in values or _sum_of(values[name]) != known
    ]


def _sum_of(value: Any) -> int:
    """CRC-32 of an attribute's value as Python's own type."""
    return zlib.crc32(repr(value).encode())


def seal_arrays(group: h5py.Group, arrays: Mapping[str, Any]) -> None:
    """Store one checksum of the arrays of a group, ``arrays`` by name."""
    set_attribute(group, ARRAYS_SUM, _sum_of_arrays(arrays))


def put_sealed_arrays(group: h5py.Group, arrays: Mapping[str, Any]) -> None:
    """Store arrays by name, and their checksum; each is read from ``arrays`` once, and not kept."""
    total = 0
    for name in sorted(arrays):
        array = arrays[name]
        put_array(group, name, array)
        total = _added(total, name, array)
        del array  # before there is the next one
    set_attribute(group, ARRAYS_SUM, total)


def _sum_of_arrays(arrays: Mapping[str, Any]) -> int:
    """CRC-32 of arrays with their names, in order of the names."""
    total = 0
    for name in sorted(arrays):
        total = _added(total, name, arrays[name])
    return total


def _added(total: int, name: str, array: Any) -> int:
    """``total``, a CRC-32, continued by the name and the numbers of an array."""
    total, values = zlib.crc32(name.encode(), total), np.asarray(array)
    if values.dtype.kind in "OSU":
        return zlib.crc32(str(text_of(values.item())).encode(), total)
    return zlib.crc32(np.ascontiguousarray(values).data, total)


def sum_is_kept(group: h5py.Group, arrays: Mapping[str, Any]) -> bool | None:
    """Whether arrays have the checksum that stands beside them, None if none does."""
    known = group.attrs.get(ARRAYS_SUM)
    if known is None:
        return None
    return np.ndim(known) == 0 and bool(known == _sum_of_arrays(arrays))


def create_checked(file: h5py.Group, path: str, values: Any) -> h5py.Dataset:
    """A dataset with HDF5's own checksum; an empty one has nothing to check."""
    array = np.asarray(values)
    return file.create_dataset(path, data=array, fletcher32=bool(array.size) and array.ndim > 0)


def open_own(path: Path, mode: str = "r", **options: Any) -> h5py.File:
    """An HDF5 file all of whose tables lie in itself, open for reading or for changes.

    Parameters
    ----------
    path : Path
        A regular file; a symbolic link is not followed, a pipe not waited for.
    mode : str, optional
        "r" or "r+".
    **options : object
        Further arguments of ``h5py.File``.

    Raises
    ------
    InputError
        If it is no regular file, or holds a soft or external link, a table with external storage
        or a virtual table; nothing of the other file was read.
    OSError, RuntimeError
        If HDF5 cannot open the file, or not list its tables.
    """
    _refuse_irregular(path)
    file = h5py.File(path, mode, **options)
    try:
        fault = _leads_elsewhere(file)
        if fault:
            raise InputError(
                f"{path} is refused: {fault}; a result file must hold all of its tables itself"
            )
    except BaseException:
        file.close()
        raise
    return file


def _refuse_irregular(path: Path) -> None:
    """Raise InputError if a path names a link, pipe, device or folder; OSError if nothing."""
    kind = stat.S_IFMT(os.lstat(path).st_mode)
    if kind != stat.S_IFREG:
        raise InputError(f"{path} {_OWN_KINDS.get(kind, 'is a pipe or a device, not a file')}")


def _leads_elsewhere(file: h5py.File) -> str:
    """The first link or table that leads out of a file, as a clause; empty if there is none."""

    size = os.fstat(file.id.get_vfd_handle()).st_size

    def judge(name: bytes, link: Any) -> str | None:
        if link.type != h5l.TYPE_HARD:
            return f"{_text(name)} {_LINKS.get(link.type, 'is a link of an unknown kind')}"
        try:
            item = h5o.open(file.id, name)
        except (OSError, RuntimeError, KeyError, ValueError):
            return None  # it is damaged: nobody can open it
        if not isinstance(item, h5d.DatasetID):
            return None
        how = item.get_create_plist()
        if how.get_layout() == h5d.VIRTUAL:
            return f"{_text(name)} is a virtual table, whose numbers lie in other files"
        if how.get_external_count():
            return f"{_text(name)} keeps its numbers in another file"
        return _oversize(name, item, size)

    found: str | None = file.id.links.visit(judge, info=True)
    return found or ""


def _oversize(name: bytes, table: h5d.DatasetID, size: int) -> str | None:
    """The clause for a table of a fixed length that is larger than its file of ``size`` [B]: it
    would be made up of numbers that nobody wrote, and may not fit into memory. Ours are not
    compressed."""
    space = table.get_space()
    if space.get_simple_extent_ndims() == 0 or h5s.UNLIMITED in space.get_simple_extent_dims(True):
        return None
    takes = space.get_simple_extent_npoints() * table.get_type().get_size()
    return f"{_text(name)} has {takes:.3g} bytes and the file {size:.3g}" if takes > size else None


def _text(name: bytes) -> str:
    return name.decode(errors="replace")


def append_rows(dataset: h5py.Dataset, start: int, rows: np.ndarray) -> None:
    """Write ``rows`` (n, ...) behind the first ``start`` of a growing dataset, which ends there."""
    grow((dataset,), start + rows.shape[0])
    if not rows.size:
        return
    block = np.ascontiguousarray(rows, dtype=np.float64)
    there = dataset.id.get_space()
    there.select_hyperslab((start,) + (0,) * (block.ndim - 1), block.shape)
    dataset.id.write(h5s.create_simple(block.shape), there, block)


def grow(datasets: Iterable[h5py.Dataset], rows: int) -> None:
    """Resize growing datasets to so many rows, which read as NaN until they are written."""
    for dataset in datasets:
        dataset.id.set_extent((rows, *dataset.id.shape[1:]))


def write_window(
    dataset: h5py.Dataset,
    start: int,
    values: tuple[int, np.ndarray],
    x: np.ndarray,
    edges: tuple[np.ndarray, np.ndarray],
) -> None:
    """Write rows from ``start`` on, NaN outside of a window. Not collective.

    Chunks without a value in the window are not touched: they take no room in the file.

    Parameters
    ----------
    dataset : h5py.Dataset
        Table with chunks.
    start : int
        First row to be written.
    values : tuple
        Number of the first column that is given, and the columns (rows, columns), which
        reach over the window of each row.
    x : ndarray, shape (columns,)
        Places of the columns [m].
    edges : tuple of ndarray
        First and last place of the window at each row, (rows,) each [m].
    """
    rows, columns = dataset.chunks
    low, high = edges
    given, numbers = values
    end = start + numbers.shape[0]
    for first in range(start - start % rows, end, rows):
        part = slice(max(first, start), min(first + rows, end))
        own = slice(part.start - start, part.stop - start)
        near = np.flatnonzero((x >= low[own].min()) & (x <= high[own].max()))
        for block in np.unique(near // columns):
            across = slice(block * columns, min((block + 1) * columns, x.size))
            at = x[across]
            inside = (at >= low[own, None]) & (at <= high[own, None])
            if inside.any():
                kept = slice(max(across.start, given), min(across.stop, given + numbers.shape[1]))
                shown = np.full(inside.shape, np.nan)
                there = slice(kept.start - across.start, kept.stop - across.start)
                shown[:, there] = numbers[own, kept.start - given : kept.stop - given]
                dataset[part, across] = np.where(inside, shown, np.nan)


def rows_before(clock: h5py.Dataset, n: int, time: float) -> int:
    """Number of the first ``n`` times of a ``clock``, a table of ascending times, before ``time``
    [s]; `Damage` if they cannot be read."""
    try:
        return int(np.searchsorted(clock[:n], time))
    except OSError as error:
        raise Damage(f"{clock.name[1:]} is damaged") from error


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


def row_blocks(n_rows: int, n_columns: int, step: int = 1) -> Iterator[slice]:
    """Rows 0 to ``n_rows`` in order, in slices that start at multiples of ``step``.

    Parameters
    ----------
    n_rows : int
        Rows of the table.
    n_columns : int
        Columns that are read, 8 bytes each.
    step : int, optional
        Rows of a chunk.
    """
    rows = max(1, int(BLOCK_BYTES / (8 * max(n_columns, 1))))
    rows = max(step, rows - rows % step)
    for start in range(0, n_rows, rows):
        yield slice(start, min(start + rows, n_rows))


def unwritten(dataset: h5py.Dataset, part: slice, columns: slice) -> bool:
    """Whether part of a table reads as NaN because none of its chunks was ever written.

    With a window those are most of a long line, and HDF5 takes longer to fill them than it marched.
    """
    if not dataset.chunks or not np.isnan(dataset.fillvalue):
        return False
    down, across = dataset.chunks
    last = min(columns.stop, dataset.shape[1])
    return not any(
        _is_written(dataset, (row, column))
        for row in range(part.start - part.start % down, part.stop, down)
        for column in range(columns.start - columns.start % across, last, across)
    )


def _is_written(dataset: h5py.Dataset, corner: tuple[int, int]) -> bool:
    """Whether the chunk at a corner is in the file; of one that cannot be read that is supposed."""
    try:
        return len(dataset.id.read_direct_chunk(corner)[1]) > 0
    except HDF5_ERRORS as error:
        return "not allocated" not in str(error)


def column(dataset: h5py.Dataset, part: slice, index: int) -> np.ndarray:
    """Column number ``index`` of the rows ``part`` of a table, (rows,).

    In slices: of all chunks that it reads at once HDF5 makes tables, and keeps their memory.
    """
    values = np.empty(part.stop - part.start)
    for start in range(0, values.size, _SLICE):
        own = slice(start, min(start + _SLICE, values.size))
        rows = np.s_[part.start + own.start : part.start + own.stop, index]
        dataset.read_direct(values[own], rows)
    return values


def extremes(dataset: h5py.Dataset, n_rows: int) -> np.ndarray:
    """Smallest and largest value of each column, (2, columns); NaN if there are no rows."""
    n_columns = dataset.shape[1]
    found = np.full((2, n_columns), np.nan)
    rows = dataset.chunks[0] if dataset.chunks else 1
    for part in row_blocks(n_rows, n_columns, rows):
        block = dataset[part]
        low, high = block.min(axis=0), block.max(axis=0)
        if part.start == 0:
            found[:] = low, high
        np.minimum(found[0], low, out=found[0])
        np.maximum(found[1], high, out=found[1])
    return found
