"""Attributes and arrays of a result file with checksums, so that damage shows when they are read.

Object headers, links and dense attributes carry checksums of HDF5 from ``FORMAT_BOUNDS`` on. Text
of variable length lies in HDF5's global heap, which has none: text is stored with a fixed length.
Attributes above 4 KiB and arrays without a filter have none either: they get a CRC-32 of ours.

Not collective.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import h5py
import numpy as np

from catenary.postproc.files.hdf5.array_writes import put_array, set_attribute

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
