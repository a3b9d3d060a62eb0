"""Committed rows of a result file, and what the file keeps that is derived from them.

Rows are counted, judged before a run goes on, and cut to its time; what was derived from all of
them then goes, too. Two things are derived:

- the extremes of the line's channels. Each of the two that are kept says for how many steps it
  holds. The one that holds for the rows that are whole is never the one that is being written;
- the filtered contact force of a run that is done, named with its filter. A file without it, or
  with a damaged one, lacks nothing.

Not collective.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.files.dimensions import describe_extremes, describe_filtered
from catenary.postproc.files.disk import MARGIN, NoRoom, reserve
from catenary.postproc.files.hdf5 import (
    HDF5_ERRORS,
    Damage,
    column,
    create_checked,
    open_own,
    put_array,
    rows_before,
    seal_arrays,
    set_attribute,
    shorten,
    sum_is_kept,
    text_of,
)
from catenary.postproc.files.run_schema import CLOCKS, COMPLETE

logger = logging.getLogger("catenary.results")

# What is kept twice is written in turn, in the slot of the older one: a run that is killed while
# it writes one still has the other.
SLOTS = ("0", "1")
_EXTREMES, ROWS = "extremes", "rows"
FILTERED_FORCE = "filtered/contact_force"
# Names of the attributes of the table that name its filter.
_ABOUT = ("filter", "cut_off_Hz", "order")


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
        except Damage as error:
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
    _drop_filtered(file)
    for keep, paths in zip(_rows_to_keep(file, time), _tables_by_clock(file), strict=True):
        for path in paths:
            lost = shorten(file, path, keep)
            if lost:
                sentence = "%s is damaged: its records %d to %d are lost"
                logger.warning(sentence, path, keep - lost, keep - 1)
    counted = rows_of(file)
    put_array(file, COMPLETE, counted)
    drop_extremes(file, counted[0])


def store_extremes(file: h5py.File, n_rows: int, extremes: Mapping[str, np.ndarray]) -> None:
    """Store the extremes of the first ``n_rows`` steps in place of the older of the two kept.

    Parameters
    ----------
    file : h5py.File
        Result file, open for writing.
    n_rows : int
        Number of steps that the extremes cover.
    extremes : mapping
        Smallest and largest values, (2, columns), by channel.
    """
    group = file.require_group(_EXTREMES)
    counts = [_steps_in(group[slot]) if slot in group else -1 for slot in SLOTS]
    place = group.require_group(SLOTS[int(np.argmin(counts))])
    arrays = {**extremes, ROWS: np.array(n_rows, dtype=np.int64)}
    for name, values in arrays.items():
        is_new = name not in place
        table = put_array(place, name, values)
        if is_new and name != ROWS:
            describe_extremes(file, h5py.Dataset(table), name)
    seal_arrays(place, arrays)


def drop_extremes(file: h5py.File, n_rows: int) -> None:
    """Forget extremes of more steps than a run that goes on after ``n_rows`` has shown."""
    for slot in file[_EXTREMES].values():
        if _steps_in(slot) > n_rows + 1:
            slot[ROWS][...] = -1


def extremes_at(file: h5py.File, n_rows: int) -> dict[str, np.ndarray] | None:
    """The extremes of the first ``n_rows`` steps by channel, (2, columns) each; None if not kept.

    Those of one step more serve as well: a run that goes on from a state shows it again. Those
    whose checksum is wrong count as not kept.
    """
    found = {_steps_in(slot): slot for slot in file.get(_EXTREMES, {}).values()}
    slot = found.get(n_rows, found.get(n_rows + 1))
    if slot is None:
        return None
    arrays = {name: values[...] for name, values in slot.items()}
    if not sum_is_kept(slot, arrays):
        return None
    del arrays[ROWS]
    return arrays


def _steps_in(slot: h5py.Group) -> int:
    """For how many steps a slot holds, -1 if that is not a single whole number."""
    rows = slot.get(ROWS)
    if not isinstance(rows, h5py.Dataset) or rows.shape != () or rows.dtype.kind not in "iu":
        return -1
    return int(rows[()])


class ForceFilter(NamedTuple):
    """A filter of contact forces.

    Attributes
    ----------
    about : "filter" in words, "cut_off_Hz", "order"
    filtered : gives forces (n, columns) [N] at steps of a length [s] filtered
    """

    about: Mapping[str, Any]
    filtered: Callable[[np.ndarray, float], np.ndarray]


def store_filtered(file: h5py.File, force: ForceFilter, dt: float) -> None:
    """Store the filtered contact force of all steps [N].

    It is left out where the disk has no room for it, which is logged.

    Raises
    ------
    OSError, RuntimeError
        If HDF5 could not write.
    """
    record = file["channels/contact_force"]
    if not record.size or not np.isfinite(record[...]).all():
        return
    values = force.filtered(record[...], dt)
    try:
        reserve(file, values.nbytes + MARGIN)
    except NoRoom:
        logger.warning("the disk has no room for the filtered contact force: it is left out")
        return
    table = create_checked(file, FILTERED_FORCE, values)
    set_attribute(table, "unit", "N")
    for name in _ABOUT:
        set_attribute(table, name, force.about[name])
    describe_filtered(table)


def _drop_filtered(file: h5py.File) -> None:
    """Forget the filtered force of a run that goes on."""
    group = FILTERED_FORCE.split("/")[0]
    if group in file:
        del file[group]


def filtered_in(
    file: Any, shape: tuple[int, int], index: int | None = None
) -> tuple[np.ndarray, dict[str, Any]] | None:
    """The filtered force (n, n_pantographs) [N], or (n,) of one, and what its filter is; None if
    there is none that is valid, or one of an earlier version, which is to single precision.

    Parameters
    ----------
    file : object
        Result file, or the tables of a march.
    shape : tuple of int
        Shape of the force of all steps.
    index : int or None
        Number of the pantograph; all if None.
    """
    if FILTERED_FORCE not in file:
        return None
    try:
        table = file[FILTERED_FORCE]
        if table.shape != shape or table.dtype != np.float64:
            return None
        values = table[...] if index is None else column(table, slice(0, shape[0]), index)
        about = {name: text_of(table.attrs[name]) for name in _ABOUT}
    except (*HDF5_ERRORS, InputError):
        return None
    return (values, about) if np.isfinite(values).all() else None
