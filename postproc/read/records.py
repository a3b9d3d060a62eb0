"""Finds out which records of a result file are sound. Not collective."""

from __future__ import annotations

from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.postproc.files.result_file import COMPLETE
from catenary.postproc.read.attributes import HDF5_ERRORS, is_there
from catenary.postproc.read.file_schema import (
    CLOCK,
    LINE_CLOCK,
    Growing,
    energy_tables,
    largest,
    line_tables,
    step_tables,
)
from catenary.postproc.read.tables import damaged_rows

# A time may be this share of a step off its place.
_OFF = 1e-3
# Times that are read and checked together.
_TIMES = 1 << 18


class Records(NamedTuple):
    """Which records are sound.

    ``rows`` as the dataset ``complete_rows``, cut to what is sound; ``damaged`` table -> ranges of
    rows that read as NaN; ``told`` a clause for each thing that is damaged; ``last`` time of the
    last sound record [s], NaN without one.
    """

    rows: list[int]
    damaged: dict[str, list[tuple[int, int]]]
    told: list[str]
    last: float


class TableFault(NamedTuple):
    """A growing dataset that is not what it should be, and whether the run needs it."""

    path: str
    fault: str
    essential: bool


def table_faults(file: h5py.File, about: dict[str, Any], sizes: dict[str, int]) -> list[TableFault]:
    """Growing datasets that are missing or have the wrong type or width.

    Parameters
    ----------
    about : sound root attributes
    sizes : letter -> number of columns; those of pantographs and strips are added
    """
    found = []
    with_steps, apart = line_tables(about)
    (always, others), energies = step_tables(), _energies(file)
    most = about["n_steps_planned"] + 1
    for path, declared in {"time": CLOCK, **always, **with_steps}.items():
        fault = _shape_fault(file, path, declared, sizes, most)
        if fault:
            found.append(TableFault(path, fault, declared.essential))
    for path, declared in apart.items():
        fault = _shape_fault(file, path, declared, sizes, most)
        if fault:
            found.append(TableFault(path, fault, False))
    for path, declared in {**others, **energies}.items():
        fault = _shape_fault(file, path, declared, sizes, most)
        if fault and is_there(file, path.split("/")[0] if path in energies else path):
            found.append(TableFault(path, fault, False))
    return found


def scan(
    file: h5py.File,
    about: dict[str, Any],
    dt: float,
    faults: list[TableFault],
    complete: tuple[list[int], str] | None = None,
) -> Records:
    """Read all records once, by blocks, and find the sound ones.

    Parameters
    ----------
    about : sound root attributes
    dt : time between two records [s]
    faults : from ``table_faults``, none of them essential
    complete : what ``complete_of`` found earlier, None to find it now
    """
    unusable = {fault.path for fault in faults}
    told = [f"{path} {fault}" for path, fault, _ in faults]
    damaged: dict[str, list[tuple[int, int]]] = {}
    with_steps, apart = line_tables(about)
    n_complete, fault = complete_of(file) if complete is None else complete
    told += [fault] if fault else []
    (always, others), energies = step_tables(), _energies(file)
    of_steps = {**always, **others, **with_steps}
    there = {path: d for path, d in of_steps.items() if is_there(file, path)}
    rows = [0, 0, 0]
    # What is missing is a fault already, but for a file whose attributes are damaged.
    energies, lines = (
        {path: declared for path, declared in tables.items() if is_there(file, path)}
        for tables in (energies, apart)
    )
    parts = ({"time": CLOCK, **there}, energies, lines)
    for number, tables in enumerate(parts):
        clock = next(iter(tables), "")
        if not clock or clock in unusable or not is_there(file, clock):
            continue
        if tables is energies and unusable & energies.keys():
            continue
        period = dt if number == 0 else None
        usable = {path: declared for path, declared in tables.items() if path not in unusable}
        rows[number] = _rows(file, n_complete[number], period, usable, damaged, told)
    damaged |= {path: [] for path in unusable if path in of_steps or path in apart}
    told += _missing_end(about, rows[0])
    last = float(file["time"][rows[0] - 1]) if rows[0] else float("nan")
    return Records(rows, damaged, told, last)


def _energies(file: h5py.File) -> dict[str, Growing]:
    """The tables of the energies, without those that only some versions record."""
    return {path: t for path, t in energy_tables().items() if t.essential or is_there(file, path)}


def _rows(
    file: h5py.File,
    complete: int,
    dt: float | None,
    tables: dict[str, Growing],
    damaged: dict[str, list[tuple[int, int]]],
    told: list[str],
) -> int:
    """Sound rows of tables with a common clock, the first; other damage goes to the lists."""
    lengths = {path: file[path].shape[0] for path in tables}
    n = min(complete, *lengths.values(), complete)
    clock = next(iter(tables))
    if n < complete:
        short = min(lengths, key=lambda path: lengths[path])
        told.append(f"{short} ends after {n} of {complete} records")
    found: dict[str, list[tuple[int, int]]] = {}
    for path, declared in tables.items():
        parts = damaged_rows(file[path], n, largest(declared.unit), declared.may_be_nan)
        if path == clock:
            parts = parts or _disorder(file[path], n, dt)
        if parts and declared.essential:
            told.append(f"{path} is damaged from record {parts[0][0]} on")
            n = parts[0][0]
        elif parts:
            found[path] = parts
    for path, parts in found.items():
        n_bad = sum(min(end, n) - min(begin, n) for begin, end in parts)
        told.append(f"{path} is damaged in {n_bad} of {n} records, which are left out")
    damaged |= found
    return n


def _disorder(table: h5py.Dataset, n: int, dt: float | None) -> list[tuple[int, int]]:
    """From the first time on that is not after the one before, or not a number of steps of
    ``dt`` [s] after the first."""
    first = float(table[0]) if n else 0.0
    before = -np.inf
    for start in range(0, n, _TIMES):
        time = np.asarray(table[start : min(start + _TIMES, n)])
        wrong = np.diff(time, prepend=before) <= 0.0
        if dt is not None:
            wrong |= np.abs(time - first - dt * np.arange(start, start + time.size)) > _OFF * dt
        if wrong.any():
            return [(start + int(wrong.argmax()), n)]
        before = time[-1]
    return []


def complete_of(file: h5py.File) -> tuple[list[int], str]:
    """Rows that are whole, all where that is not known, and what is wrong with the numbers."""
    there = [_length(file, clock) for clock in ("time", "energy/time", LINE_CLOCK)]
    if not is_there(file, COMPLETE):  # a file of an earlier version
        return there, ""
    try:
        found = np.asarray(file[COMPLETE][...])
        if found.ndim == 1 and found.dtype.kind in "iu" and 2 <= found.size <= 3:
            told = [int(rows) for rows in found]
            told += there[len(told) :]
            if all(0 <= n <= most for n, most in zip(told, there, strict=True)):
                return told, ""
    except HDF5_ERRORS:
        pass
    return there, f"{COMPLETE} is damaged, the length of the tables counts instead"


def _missing_end(about: dict[str, Any], n: int) -> list[str]:
    """That the file says it holds more steps than it does."""
    wanted = about.get("n_steps")
    if wanted is None or about["outcome"] == "running" or n == wanted + 1:
        return []
    if not n and not wanted:  # it broke before the first step
        return []
    return [f"{n} of {wanted + 1} records are sound"]


def _length(file: h5py.File, path: str) -> int:
    try:
        return int(file[path].shape[0])
    except (*HDF5_ERRORS, IndexError):
        return 0


def _shape_fault(
    file: h5py.File, path: str, declared: Growing, sizes: dict[str, int], most: int
) -> str:
    """What is wrong with the shape of a growing table, empty if nothing is; ``most`` rows are
    planned."""
    try:
        table = file[path]
        shape, kind = table.shape, table.dtype.kind
    except HDF5_ERRORS:
        return "is missing or cannot be read"
    if kind != "f":
        return "does not hold numbers"
    if len(shape) != (2 if declared.columns else 1):
        return f"has {len(shape)} dimensions"
    if shape[0] > most:
        return f"has {shape[0]} rows, of {most} that the run plans"
    if declared.columns and shape[1] != sizes.setdefault(declared.columns, shape[1]):
        return f"has {shape[1]} columns in place of {sizes[declared.columns]}"
    return ""
