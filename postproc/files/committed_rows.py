"""Committed rows of a result file: counted, judged before a run goes on, and cut to its time."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from catenary.postproc.files.filtered_force import drop_filtered
from catenary.postproc.files.hdf5.checked import HDF5_ERRORS, put_array
from catenary.postproc.files.hdf5.self_contained import open_own
from catenary.postproc.files.hdf5.table_rows import DamagedClock, rows_before, shorten
from catenary.postproc.files.kept_extremes import drop_extremes
from catenary.postproc.files.run_schema import CLOCKS, COMPLETE

logger = logging.getLogger("catenary.results")


def rows_of(tables: Mapping[str, h5py.Dataset]) -> list[int]:
    """Rows of the tables of the channels, of the energies and of the line's channels, by path."""
    return [tables[name].shape[0] if name in tables else 0 for name in CLOCKS]


def committed_rows(file: h5py.File) -> tuple[list[int], str]:
    """Committed rows of the three clocks, and the fault of the counts, empty if there is none.

    Damaged counts are replaced by the lengths of the tables. Not collective.
    """
    there = [_length(file, clock) for clock in CLOCKS]
    try:
        found = np.asarray(file[COMPLETE][...])
        if found.shape == (len(CLOCKS),) and found.dtype.kind in "iu":
            rows = [int(n) for n in found]
            if all(0 <= n <= most for n, most in zip(rows, there, strict=True)):
                return rows, ""
    except HDF5_ERRORS:
        pass
    return there, f"{COMPLETE} is damaged, the length of the tables counts instead"


def _length(file: h5py.File, path: str) -> int:
    try:
        return int(file[path].shape[0])
    except (*HDF5_ERRORS, IndexError):
        return 0


def fault_to_continue(path: Path, time: float) -> str:
    """Fault of a result file in which a run is to go on, as a clause; "" if none. Not collective.

    Parameters
    ----------
    path : Path
        Path of the result file.
    time : float
        Time from which on it goes on [s].

    Raises
    ------
    InputError
        If the file is none of its own, see ``open_own``.
    """
    with open_own(path, locking=False) as file:
        try:
            kept = _rows_to_keep(file, time)
        except DamagedClock as error:
            return str(error)
        for rows, paths in zip(kept, _tables_by_clock(file), strict=True):
            for table_path in paths:
                fault = _fault_to_append(file[table_path], rows)
                if fault:
                    return f"{table_path} {fault}"
    return ""


def _fault_to_append(table: Any, rows: int) -> str:
    """Fault of a table that is to be appended to behind its first ``rows``, "" if none."""
    if not isinstance(table, h5py.Dataset) or table.dtype != np.float64 or not table.ndim:
        return "is no table of numbers"
    if table.chunks is None or table.maxshape[0] is not None:
        return "cannot grow"
    if table.shape[0] < rows:
        return f"ends after {table.shape[0]} of {rows} records"
    return ""


def _tables_by_clock(file: h5py.File) -> list[list[str]]:
    """Paths of the growing tables that share each of ``CLOCKS``."""
    groups = ("channels", "energy", "line_channels")
    found = [[f"{group}/{name}" for name in file.get(group, ())] for group in groups]
    return [["time", *found[0]], *found[1:]]


def _rows_to_keep(file: h5py.File, time: float) -> list[int]:
    """Records before ``time`` [s] of each clock."""
    return [
        rows_before(file[clock], complete, time) if clock in file else 0
        for clock, complete in zip(CLOCKS, committed_rows(file)[0], strict=True)
    ]


def cut(file: h5py.File, time: float) -> None:
    """Drop the records of a file from ``time`` [s] on, and what was derived from all of them."""
    drop_filtered(file)
    for keep, paths in zip(_rows_to_keep(file, time), _tables_by_clock(file), strict=True):
        for path in paths:
            lost = shorten(file, path, keep)
            if lost:
                sentence = "%s is damaged: its records %d to %d are lost"
                logger.warning(sentence, path, keep - lost, keep - 1)
    counted = rows_of(file)
    put_array(file, COMPLETE, counted)
    drop_extremes(file, counted[0])
