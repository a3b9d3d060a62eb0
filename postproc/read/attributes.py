"""Reads the attributes of a result file against their table; reports what cannot be."""

from __future__ import annotations

import json
from typing import Any

import h5py

from catenary.postproc.files.hdf5.checked import ATTRIBUTE_SUMS, broken_seals, text_of
from catenary.postproc.read.file_schema import ATTRIBUTES, REQUIRED

# What HDF5 and h5py raise at a damaged file.
HDF5_ERRORS = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError)
MISSING = object()


def read_attributes(file: h5py.File) -> tuple[dict[str, Any], list[str], list[str]]:
    """Sound root attributes, faults that make the file unusable, and faults that do not.

    Values are Python's own, lists and tables decoded. An attribute that is missing or damaged has
    its fallback if it has one; those of later versions are taken as they are. Not collective.
    """
    raw, unreadable = _raw(file)
    try:
        broken = set(broken_seals(file, raw)) | unreadable
    except HDF5_ERRORS:
        return {}, ["the checksums of its attributes cannot be read"], []
    values: dict[str, Any] = {
        name: value for name, value in raw.items() if name not in ATTRIBUTES and name not in broken
    }
    fatal, partial = [], []
    for name, declared in ATTRIBUTES.items():
        value = raw.get(name, MISSING)
        fault = ""
        if name in broken:
            fault = f'its attribute "{name}" ' + (
                "is missing" if value is MISSING else "differs from its checksum"
            )
        elif value is not MISSING:
            value = decoded(value, declared.is_json)
            if value is MISSING or not declared.sound(value):
                fault = f'its attribute "{name}" is not {declared.must_be}{_where(value)}'
        if not fault and value is not MISSING:
            values[name] = value
        elif declared.fallback is REQUIRED:
            fatal.append(fault or f'its attribute "{name}" is missing')
        else:
            if declared.fallback is not None:
                values[name] = declared.fallback
            partial += [fault] if fault else []
    return values, fatal, partial


def is_there(file: h5py.File, path: str) -> bool:
    """Whether a file names a dataset or group, one that cannot be opened included."""
    try:
        return path in file
    except HDF5_ERRORS:
        return True


def _raw(file: h5py.File) -> tuple[dict[str, Any], set[str]]:
    """Attributes as Python's own values, and the names of those that cannot be read."""
    values, unreadable = {}, set()
    for name in list(file.attrs):
        if name == ATTRIBUTE_SUMS:
            continue
        try:
            values[name] = text_of(file.attrs[name])
        except HDF5_ERRORS:
            unreadable.add(name)
    return values, unreadable


def decoded(value: Any, is_json: bool) -> Any:
    """The value, of JSON what it says, ``MISSING`` if it says nothing."""
    if not is_json:
        return value
    try:
        return json.loads(value, parse_constant=_refuse)
    except (ValueError, TypeError, RecursionError):
        return MISSING


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def _where(value: Any) -> str:
    """A value, cut short."""
    if value is MISSING:
        return ""
    shown = " ".join(str(value).split())
    return f" ({shown[:40]}{'...' if len(shown) > 40 else ''})"
