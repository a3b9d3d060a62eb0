"""Finds out what of a file is valid: attributes, tables that are written once, and records.

Attributes and tables are compared with their declarations; records are read once, by blocks, up to
the first that is damaged. Faults are clauses that follow the name of the file. Not collective.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection
from typing import Any, NamedTuple

import h5py
import numpy as np
from pydantic import BaseModel, ValidationError

from catenary.postproc.files.committed_rows import committed_rows
from catenary.postproc.files.hdf5 import (
    ATTRIBUTE_SUMS,
    COLUMNS_AT_ONCE,
    HDF5_ERRORS,
    Damage,
    broken_seals,
    row_blocks,
    text_of,
    unwritten,
)
from catenary.postproc.files.header import LineRecord
from catenary.postproc.files.run_schema import (
    ALL_COLUMNS,
    CLOCKS,
    COLUMNS,
    DISPENSABLE,
    JSON,
    RUNNING,
    SIZES,
    Table,
    growing_tables,
    largest,
)
from catenary.solver.time_loop.views.channels import RUN, Channel

# Faults of a file that one sentence names.
_MOST_NAMED = 3
# Rows of a run whose number is not known.
_ANY = 10**12
# A time may be this share of a step off its place.
_OFF = 1e-3


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


def read_attributes(file: h5py.File, model: type[BaseModel]) -> tuple[dict[str, Any], list[str]]:
    """Valid root attributes as Python's own values, lists and tables decoded, and faults.

    One that is missing has the default of ``model`` if that has one; attributes that it does not
    declare are taken as they are. An attribute that is ``DISPENSABLE`` has its default also where
    it is damaged, which is told as a clause.

    Raises
    ------
    Damage
        If another one is missing that has no default, invalid, or not the sealed one.
    """
    values, faults = {}, {}
    try:
        for name in set(file.attrs) - {ATTRIBUTE_SUMS}:
            try:
                values[name] = text_of(file.attrs[name])
            except HDF5_ERRORS:
                faults[name] = "cannot be read"
    except HDF5_ERRORS as error:
        raise Damage("one of its attributes cannot be read") from error
    try:
        broken = broken_seals(file, values)
    except HDF5_ERRORS as error:
        raise Damage("the checksums of its attributes cannot be read") from error
    for name in broken:
        faults.setdefault(name, "differs from its checksum" if name in values else "is missing")
    for name in values.keys() & model.model_fields.keys():
        if JSON in model.model_fields[name].metadata:
            values[name] = _decoded(values[name])
    faults = {**_invalid_attributes(values, model), **faults}
    clauses = {name: f'its attribute "{name}" {words}' for name, words in faults.items()}
    for name, clause in clauses.items():
        if name not in model.model_fields or DISPENSABLE not in model.model_fields[name].metadata:
            raise Damage(clause)
        values.pop(name, None)
    for name, field in model.model_fields.items():
        if field.get_default() is not None and not field.is_required():
            values.setdefault(name, field.get_default())
    return values, list(clauses.values())


def _invalid_attributes(values: dict[str, Any], model: type[BaseModel]) -> dict[str, str]:
    """Faults of attributes by name, as the ends of clauses."""
    try:
        model.model_validate(values)
    except ValidationError as error:
        rows = error.errors(include_url=False, include_context=False, include_input=False)
        return {
            name: f"is not {model.model_fields[name].description}{_shown(values[name])}"
            if name in values
            else "is missing"
            for name in (str(row["loc"][0]) for row in rows)
        }
    return {}


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


def table_values(file: h5py.File, path: str, declared: Table, sizes: dict[str, int]) -> np.ndarray:
    """The values of a table as it is ``declared``; `Damage` if it is another one.

    ``sizes`` are those of dimensions that earlier tables have, to which its own are added.
    """
    try:
        values = np.asarray(file[path][()])
    except (*HDF5_ERRORS, MemoryError) as error:
        raise Damage(f"{path} is missing or cannot be read") from error
    check_values(path, values, declared, sizes)
    return values


def check_values(path: str, values: np.ndarray, declared: Table, sizes: dict[str, int]) -> None:
    """Raise `Damage` unless ``values`` are those of a table as ``table_values`` says."""
    if values.dtype.kind not in ("iu" if declared.whole else "fiu"):
        raise Damage(f"{path} holds {values.dtype} where numbers belong")
    if values.ndim != len(declared.dimensions):
        raise Damage(f"{path} has {values.ndim} dimensions in place of {len(declared.dimensions)}")
    for name, size in zip(declared.dimensions, values.shape, strict=True):
        wanted = SIZES.get(name) or sizes.setdefault(name, size)
        if size != wanted:
            raise Damage(f"{path} has {size} entries in place of {wanted}")
    with np.errstate(invalid="ignore"):
        valid = (values >= declared.low) & (values <= declared.high)
        valid |= declared.may_be_nan & np.isnan(values)
    if not valid.all():
        found, unit = values[~valid].flat[0], "" if declared.unit == "-" else f" {declared.unit}"
        bounds = f"{declared.low:g} to {declared.high:g}{unit}"
        raise Damage(f"{path} holds {found:g} in place of {bounds}")
    if declared.ascending and (values.size < 2 or not (np.diff(values) > 0).all()):
        raise Damage(f"{path} does not ascend")


def listed(faults: Collection[str]) -> str:
    """Faults as one clause; the first few are named, the others counted."""
    shown, more = list(faults)[:_MOST_NAMED], len(faults) - _MOST_NAMED
    return "; ".join(shown) + (f"; and {more} more faults" if more > 0 else "")


class Records(NamedTuple):
    """Valid records of a file.

    Attributes
    ----------
    rows : of the steps, the energies and the line's channels, before the first damage in a table
        of these; in a channel of the line damage ends that channel alone
    damaged : path of a damaged channel of the line -> its rows before; later ones read as NaN
    faults : the faults, as clauses
    last : time of the last valid step [s], NaN without one
    """

    rows: list[int]
    damaged: dict[str, int]
    faults: list[str]
    last: float


def check_tables(file: h5py.File, record: LineRecord, sizes: dict[str, int], most: int) -> None:
    """Raise `Damage` if a growing table is missing, of the wrong type or of the wrong width.

    Parameters
    ----------
    file : h5py.File
        Open result file.
    record : LineRecord
        Which of the line's channels are recorded.
    sizes : dict
        Sizes of dimensions by name; those of the columns are added.
    most : int
        Number of rows that the run plans.
    """
    steps, energies, line = growing_tables(record)
    _check_known(file, steps, sizes, most)
    _check_known(file, energies if is_there(file, "energy") else {}, sizes, most)
    for path, channel in line.items():
        _check_shape(file, path, channel, sizes, most)


def _check_known(
    file: h5py.File, tables: dict[str, Channel], sizes: dict[str, int], most: int
) -> None:
    """Check tables that are there, and that the essential ones are: versions add others."""
    for path, channel in tables.items():
        if path == "time" or channel.essential or is_there(file, path):
            _check_shape(file, path, channel, sizes, most)


def _check_shape(
    file: h5py.File, path: str, channel: Channel, sizes: dict[str, int], most: int
) -> None:
    try:
        table = file[path]
        shape, kind = table.shape, table.dtype.kind
    except HDF5_ERRORS as error:
        raise Damage(f"{path} is missing or cannot be read") from error
    if kind != "f":
        raise Damage(f"{path} does not hold numbers")
    if len(shape) != (1 if channel.per == RUN else 2):
        raise Damage(f"{path} has {len(shape)} dimensions")
    if shape[0] > most:
        raise Damage(f"{path} has {shape[0]} rows, of {most} that the run plans")
    if channel.per != RUN:
        # Without a list of the columns that are recorded all of them are.
        all_of = sizes.get(ALL_COLUMNS.get(channel.per, ""), shape[1])
        wanted = sizes.setdefault(COLUMNS[channel.per], all_of)
        if shape[1] != wanted:
            raise Damage(f"{path} has {shape[1]} columns in place of {wanted}")


def scan(
    file: h5py.File,
    about: dict[str, Any],
    record: LineRecord,
    dt: float,
    complete: tuple[list[int], str] | None = None,
) -> Records:
    """Read all records once, by blocks, up to the first that is damaged in a table of its kind.

    Parameters
    ----------
    file : h5py.File
        Open result file, whose tables are checked.
    about : dict
        Valid root attributes.
    record : LineRecord
        Which of the line's channels are recorded.
    dt : float
        Time between two records [s].
    complete : tuple, optional
        Counts that ``committed_rows`` found earlier, None to find them now.
    """
    n_complete, fault = committed_rows(file) if complete is None else complete
    rows, damaged, clauses = list[int](), dict[str, int](), [fault] if fault else []
    for number, tables in enumerate(growing_tables(record)):
        of_line = number == len(CLOCKS) - 1
        usable = {p: c for p, c in tables.items() if is_there(file, p)}
        n = n_complete[number] if usable else 0
        for path, channel in usable.items():
            if file[path].shape[0] < n:
                clauses.append(f"{path} ends after {file[path].shape[0]} of {n} records")
                n = file[path].shape[0]
            may_be_nan = channel.may_be_nan or (of_line and record.window is not None)
            valid = valid_rows(file[path], n, largest(channel.unit), may_be_nan)
            if path == CLOCKS[number]:
                valid = min(valid, _in_order(file[path], valid, dt if number == 0 else None))
            if valid < n:
                clauses.append(f"{path} is damaged from record {valid} on")
                if of_line and path != CLOCKS[number]:
                    damaged[path] = valid
                else:
                    n = valid
        rows.append(n)
    clauses += _missing_end(about, rows[0])
    return Records(rows, damaged, clauses, _time_before(file, rows[0]))


def valid_until(file: h5py.File, complete: tuple[list[int], str] | None = None) -> float:
    """Time of the last step up to which all tables of steps are valid in a file whose head is
    damaged [s]; NaN if there is none, or a table is missing or of the wrong kind.

    ``complete`` are counts that ``committed_rows`` found earlier, None to find them now.
    """
    steps, *_ = growing_tables(LineRecord())
    try:
        _check_known(file, steps, {}, _ANY)
        n = (committed_rows(file) if complete is None else complete)[0][0]
        for path, channel in steps.items():
            if is_there(file, path):
                n = min(n, file[path].shape[0])
                n = valid_rows(file[path], n, largest(channel.unit), channel.may_be_nan)
        return _time_before(file, _in_order(file["time"], n, None))
    except (Damage, *HDF5_ERRORS):
        return math.nan


def _time_before(file: h5py.File, n: int) -> float:
    return float(file["time"][n - 1]) if n else math.nan


def valid_rows(table: h5py.Dataset, n_rows: int, most: float, may_be_nan: bool) -> int:
    """Number of the first ``n_rows`` rows of a table before one that cannot be read, or holds
    infinity, more than ``most``, or NaN unless it ``may_be_nan``."""
    n_columns = int(np.prod(table.shape[1:]))
    chunk = table.chunks[0] if table.chunks else 1
    parts = list(row_blocks(n_rows, min(n_columns, COLUMNS_AT_ONCE), chunk))
    while parts:
        part = parts.pop(0)
        try:
            bad = _invalid(table, part, n_columns, most, may_be_nan)
        except HDF5_ERRORS:
            if part.stop - part.start <= chunk:
                return part.start
            # Somewhere in this block, which is read again chunk by chunk.
            begins = range(part.start, part.stop, chunk)
            parts[:0] = [slice(first, min(first + chunk, part.stop)) for first in begins]
            continue
        if bad.any():
            return part.start + int(bad.argmax())
    return n_rows


def _invalid(
    table: h5py.Dataset, part: slice, n_columns: int, most: float, may_be_nan: bool
) -> np.ndarray:
    """Mask of rows with impossible values, (rows,) bool."""
    bad = np.zeros(part.stop - part.start, dtype=bool)
    for first in range(0, n_columns, COLUMNS_AT_ONCE):
        columns = (slice(first, first + COLUMNS_AT_ONCE),) if table.ndim == 2 else ()
        if may_be_nan and columns and unwritten(table, part, columns[0]):
            continue
        values = np.asarray(table[(part, *columns)]).reshape(bad.size, -1)
        # Not true of NaN. As good as all blocks are valid, and this makes no arrays.
        if values.size and -most <= values.min() and values.max() <= most:
            continue
        with np.errstate(invalid="ignore"):
            valid = np.abs(values) <= most
        bad |= ~(valid | np.isnan(values) if may_be_nan else valid).all(axis=1)
    return bad


def _in_order(table: h5py.Dataset, n: int, dt: float | None) -> int:
    """Times before the first that is not after the one before, or not a number of steps of
    ``dt`` [s] after the first."""
    first, before = float(table[0]) if n else 0.0, -np.inf
    for part in row_blocks(n, 1):
        time = np.asarray(table[part])
        wrong = np.diff(time, prepend=before) <= 0.0
        if dt is not None:
            wrong |= np.abs(time - first - dt * np.arange(part.start, part.stop)) > _OFF * dt
        if wrong.any():
            return part.start + int(wrong.argmax())
        before = time[-1]
    return n


def _missing_end(about: dict[str, Any], n: int) -> list[str]:
    """Fault of a file with fewer steps than its head states; none otherwise."""
    wanted = about.get("n_steps")
    if wanted is None or about["outcome"] == RUNNING or n == wanted + 1:
        return []
    if not n and not wanted:  # it broke before the first step
        return []
    return [f"{n} of {wanted + 1} records are valid"]
