"""Attributes and arrays of a result file with checksums, so that damage shows when they are read.

Object headers, links and dense attributes carry checksums of HDF5 from ``FORMAT_BOUNDS`` on. Text
of variable length lies in HDF5's global heap, which has none: text is stored with a fixed length.
Attributes above 4 KiB and arrays without a filter have none either: they get a CRC-32 of ours.

Arrays and attributes are written by HDF5's own calls, in a fourth to a third of the time of h5py's
general ones, which find out anew what is the same for all of ours: numbers in contiguous arrays,
written as they are. Not collective.
"""

from __future__ import annotations

import functools
import json
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5p, h5s, h5t


def put_array(group: h5py.Group, name: str, values: Any) -> h5d.DatasetID:
    """Store an array in place of an earlier one of its name; returns its table.

    One of the same shape and type is overwritten where it stands, so that the file does not grow.
    Text and what else is no number goes through h5py.
    """
    array = np.asarray(values, order="C")
    plain = array.dtype.kind in "fiu"
    key = name.encode()
    if key in group.id:
        old = h5d.open(group.id, key)
        if plain and old.shape == array.shape and old.dtype == array.dtype:
            old.write(h5s.ALL, h5s.ALL, array)
            return old
        del group[name]
    if not plain:
        return group.create_dataset(name, data=values).id
    how = _how_to_create()
    made = h5d.create(group.id, key, _number_type(array.dtype), _space_of(array), how)
    if array.size:
        made.write(h5s.ALL, h5s.ALL, array)
    return made


def set_attribute(place: h5py.HLObject | h5d.DatasetID, name: str, value: Any) -> None:
    """Store an attribute, text with a fixed length in UTF-8; one that is there is replaced so that
    no moment is without it.

    Parameters
    ----------
    place : h5py.HLObject or h5py.h5d.DatasetID
        File, group or dataset, or the latter's identifier.
    name : str
        Name of the attribute.
    value : object
        Text or a number.
    """
    if isinstance(value, str):
        text = value.encode()
        kind, stored = _text_type(max(1, len(text)))
        array = np.array(text, dtype=kind)
    else:
        array = np.asarray(value)
        plain = array.dtype.kind in "fiu"
        stored = _number_type(array.dtype) if plain else h5t.py_create(array.dtype, logical=True)
    key = name.encode()
    where = place.id if isinstance(place, h5py.HLObject) else place
    if h5a.exists(where, key):
        owner = place if isinstance(place, h5py.HLObject) else h5py.Dataset(place)
        owner.attrs.create(name, array)
        return
    h5a.create(where, key, stored, _space_of(array)).write(array)


def _space_of(array: np.ndarray) -> h5s.SpaceID:
    return h5s.create_simple(array.shape) if array.ndim else h5s.create(h5s.SCALAR)


# Objects that are made of the same few arguments again and again.


@functools.cache
def _how_to_create() -> h5p.PropDCID:
    how = h5p.create(h5p.DATASET_CREATE)
    how.set_obj_track_times(False)
    return how


@functools.cache
def _number_type(dtype: np.dtype) -> h5t.TypeID:
    return h5t.py_create(dtype, logical=True)


@functools.cache
def _text_type(size: int) -> tuple[np.dtype, h5t.TypeID]:
    kind = h5py.string_dtype("utf-8", size)
    return kind, h5t.py_create(kind, logical=True)


# The oldest format of HDF5 whose object headers, links and attributes carry checksums. The next
# one marks a file as open for writing: after a kill nobody could open it.
FORMAT_BOUNDS = ("v108", "v108")
# Exceptions of HDF5 and h5py at a damaged file.
HDF5_ERRORS = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError)
# Attribute with the checksums of the other attributes, by name, as JSON.
ATTRIBUTE_SUMS = "attribute_crc32"
# Attribute of a group with one checksum of all its arrays.
ARRAYS_SUM = "crc32"


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


def seal_arrays(group: h5py.Group, arrays: Mapping[str, Any]) -> None:
    """Store one checksum of the arrays of a group, ``arrays`` by name."""
    set_attribute(group, ARRAYS_SUM, sum_of_arrays(arrays))


def put_sealed_arrays(group: h5py.Group, arrays: Mapping[str, Any]) -> None:
    """Store arrays by name, and their checksum; each is read from ``arrays`` once, and not kept."""
    total = 0
    for name in sorted(arrays):
        array = arrays[name]
        put_array(group, name, array)
        total = _added(total, name, array)
        del array  # before there is the next one
    set_attribute(group, ARRAYS_SUM, total)


def sum_of_arrays(arrays: Mapping[str, Any]) -> int:
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
    return np.ndim(known) == 0 and bool(known == sum_of_arrays(arrays))


def create_checked(file: h5py.Group, path: str, values: Any) -> h5py.Dataset:
    """A dataset with HDF5's own checksum; an empty one has nothing to check."""
    array = np.asarray(values)
    return file.create_dataset(path, data=array, fletcher32=bool(array.size) and array.ndim > 0)


def _sum_of(value: Any) -> int:
    """CRC-32 of an attribute's value as Python's own type."""
    return zlib.crc32(repr(value).encode())
