"""The filtered contact force in the result file of a run that is done, named with its filter.

It is derived from the record beside it: a file without it, or with a damaged one, lacks nothing.
Not collective.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.files.dimensions import describe_filtered
from catenary.postproc.files.disk import MARGIN, NoRoom, reserve
from catenary.postproc.files.hdf5.checked import HDF5_ERRORS, create_checked, set_attribute, text_of
from catenary.postproc.files.hdf5.table_rows import column

logger = logging.getLogger("catenary.results")

GROUP = "filtered"
PATH = f"{GROUP}/contact_force"
# Names of the attributes of the table that name its filter.
_ABOUT = ("filter", "cut_off_Hz", "order")


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
    table = create_checked(file, PATH, values)
    set_attribute(table, "unit", "N")
    for name in _ABOUT:
        set_attribute(table, name, force.about[name])
    describe_filtered(table)


def drop_filtered(file: h5py.File) -> None:
    """Forget the filtered force of a run that goes on."""
    if GROUP in file:
        del file[GROUP]


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
    if PATH not in file:
        return None
    try:
        table = file[PATH]
        if table.shape != shape or table.dtype != np.float64:
            return None
        values = table[...] if index is None else column(table, slice(0, shape[0]), index)
        about = {name: text_of(table.attrs[name]) for name in _ABOUT}
    except (*HDF5_ERRORS, InputError):
        return None
    return (values, about) if np.isfinite(values).all() else None
