"""Validates attributes and tables of a file against their declarations; says what is wrong.

Faults are clauses that follow the name of the file. Not collective.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection
from typing import Any

import h5py
import numpy as np
from pydantic import BaseModel, ValidationError

from catenary.postproc.files.hdf5.checked import ATTRIBUTE_SUMS, HDF5_ERRORS, broken_seals, text_of
from catenary.postproc.files.run_schema import JSON, SIZES, Table

# Faults of a file that one sentence names.
_MOST_NAMED = 3


def is_number(value: Any, low: float = -math.inf) -> bool:
    """Whether ``value`` is a finite number, of at least ``low``."""
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    return known and math.isfinite(value) and low <= value


def is_there(file: h5py.File, path: str) -> bool:
    """Whether a file names a dataset or group, one that cannot be opened included."""
    try:
        return path in file
    except HDF5_ERRORS:
        return True


def names_in(file: h5py.File, path: str) -> list[str]:
    """Names in a group, none if it cannot be opened."""
    try:
        return list(file[path])
    except HDF5_ERRORS:
        return []


def read_attributes(
    file: h5py.File, model: type[BaseModel]
) -> tuple[dict[str, Any], list[str], list[str]]:
    """Valid root attributes, faults that make the file unusable, and faults that do not.

    Values are Python's own, lists and tables decoded. An attribute that is missing or damaged has
    the default of ``model`` if that has one; attributes that it does not declare are taken as they
    are.
    """
    raw, broken = {}, set()
    for name in set(file.attrs) - {ATTRIBUTE_SUMS}:
        try:
            raw[name] = text_of(file.attrs[name])
        except HDF5_ERRORS:
            broken.add(name)
    try:
        broken |= set(broken_seals(file, raw))
    except HDF5_ERRORS:
        return {}, ["the checksums of its attributes cannot be read"], []
    return _validated({n: value for n, value in raw.items() if n not in broken}, model, broken, raw)


def _validated(
    values: dict[str, Any], model: type[BaseModel], broken: Collection[str], raw: Collection[str]
) -> tuple[dict[str, Any], list[str], list[str]]:
    for name in values.keys() & model.model_fields.keys():
        if JSON in model.model_fields[name].metadata:
            values[name] = _decoded(values[name])
    wrong: set[int | str] = set()
    try:
        model.model_validate(values)
    except ValidationError as error:
        rows = error.errors(include_url=False, include_context=False, include_input=False)
        wrong = {row["loc"][0] for row in rows}
    fatal: list[str] = []
    partial: list[str] = []
    for name, field in model.model_fields.items():
        if name in values and name not in wrong:
            continue
        clause = ""
        if name in broken:
            clause = "differs from its checksum" if name in raw else "is missing"
        elif name in values:
            clause = f"is not {field.description}{_shown(values.pop(name))}"
        elif field.is_required():
            clause = "is missing"
        if clause:
            (fatal if field.is_required() else partial).append(f'its attribute "{name}" {clause}')
        if field.get_default() is not None and not field.is_required():
            values[name] = field.get_default()
    return values, fatal, partial


def _decoded(text: Any) -> Any:
    """The value of JSON text, None if it is invalid."""
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, TypeError, RecursionError):
        return None


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def _shown(value: Any) -> str:
    """A value in brackets, cut short."""
    words = " ".join(str(value).split())
    return "" if value is None else f" ({words[:40]}{'...' if len(words) > 40 else ''})"


def table_values(
    file: h5py.File, path: str, declared: Table, sizes: dict[str, int]
) -> tuple[np.ndarray | None, str]:
    """The values of a table and an empty text, or None and its fault.

    Parameters
    ----------
    file : h5py.File
        Open result file.
    path : str
        Path of the table in the file.
    declared : Table
        Declaration of the table.
    sizes : dict
        Sizes of dimensions by name; those of the table are added.
    """
    try:
        values = np.asarray(file[path][()])
    except (*HDF5_ERRORS, MemoryError):
        return None, f"{path} is missing or cannot be read"
    fault = values_fault(values, declared, sizes)
    return (None, f"{path} {fault}") if fault else (values, "")


def values_fault(values: np.ndarray, declared: Table, sizes: dict[str, int]) -> str:
    """The fault of the ``values`` of a table that the layout ``declared``, empty if they are valid.

    ``sizes`` are those of dimensions that earlier tables have, to which these are added.
    """
    if values.dtype.kind not in ("iu" if declared.whole else "fiu"):
        return f"holds {values.dtype} where numbers belong"
    if values.ndim != len(declared.dimensions):
        return f"has {values.ndim} dimensions in place of {len(declared.dimensions)}"
    for name, size in zip(declared.dimensions, values.shape, strict=True):
        wanted = SIZES.get(name) or sizes.setdefault(name, size)
        if size != wanted:
            return f"has {size} entries in place of {wanted}"
    with np.errstate(invalid="ignore"):
        valid = (values >= declared.low) & (values <= declared.high)
        valid |= declared.may_be_nan & np.isnan(values)
    if not valid.all():
        found, unit = values[~valid].flat[0], "" if declared.unit == "-" else f" {declared.unit}"
        return f"holds {found:g} in place of {declared.low:g} to {declared.high:g}{unit}"
    if declared.ascending and (values.size < 2 or not (np.diff(values) > 0).all()):
        return "does not ascend"
    return ""


def listed(faults: Collection[str]) -> str:
    """Faults as one clause; the first few are named, the others counted."""
    shown, more = list(faults)[:_MOST_NAMED], len(faults) - _MOST_NAMED
    return "; ".join(shown) + (f"; and {more} more faults" if more > 0 else "")
