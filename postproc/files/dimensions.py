"""Names, places and units of a result file's dimensions, as netCDF-4 and CF have them.

xarray and other readers of netCDF-4 then show time, places and units. A dimension is a dataset of
the root group, which HDF5 calls a dimension scale: with values where these are places, numbers or
the time, else of its size alone. Everything is written with the head of the file: attached tables
may grow, and no flush writes anything here. Tables are handled by HDF5's identifiers: to make an
object of h5py of each took half of the time. Not collective.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5ds, h5s

from catenary.postproc.files.hdf5 import create_checked, set_attribute
from catenary.postproc.files.run_schema import (
    ALL_COLUMNS,
    COLUMNS,
    COMPLETE,
    COUNTS,
    PLACES,
    constant_tables,
    fact_tables,
)
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Channel

CONVENTIONS = "CF-1.11"
# Dimensions of numbers from 1 on, and what is counted.
_COUNTED = {
    "pantograph": "number of the pantograph in running order",
    "strip": "number of the strip, pantograph by pantograph, the leading strip first",
    "contact_wire": "number of the contact wire in the order of the line",
    "contact_wire_of_pantograph": "number of the contact wire, pantograph by pantograph",
    "contact": "number of the contact: pantographs, their strips, contact wires",
}
# The dimension of a group's rows. Groups with a clock of their own have another dimension than the
# root's ``time``, which they would otherwise share.
_ROWS = {"channels": "time", "line_channels": "line_row", "energy": "energy_row"}
# Name of netCDF-4 for a scale that is a size and has no values.
_SIZE = b"This is a netCDF dimension but not a netCDF variable. %10d"


def describe(file: h5py.File, places: dict[str, np.ndarray]) -> None:
    """Name the dimensions of all tables that are there. The root group has its attributes already.

    Parameters
    ----------
    file : h5py.File
        New result file.
    places : dict
        Places along the track of the recorded columns, (recorded,), by what a column stands
        for [m].
    """
    time = _table(file, "time")
    h5ds.set_scale(time, b"time")
    _describe(time, channels.TIME.unit, channels.TIME.meaning)
    for name, own in PLACES.items():
        if own in file:
            _add_places(file, name, file[own][...])
    for per, x in places.items():
        if COLUMNS[per] not in file:
            _add_places(file, COLUMNS[per], x)
    tables = constant_tables(file["line/wires"], file.get("line/breaks", ()))
    for path, table in {COMPLETE: COUNTS, **tables, **fact_tables()}.items():
        if path in file:
            dataset = _table(file, path)
            _attach(file, dataset, table.dimensions)
            _describe(dataset, table.unit, table.meaning, table.coordinates)
    for group, rows in _ROWS.items():
        for name in file.get(group, ()):
            dataset, channel = _table(file, f"{group}/{name}"), _channel(name)
            columns = () if dataset.rank == 1 else (COLUMNS[channel.per],)
            _attach(file, dataset, (rows, *columns))
            clock = "time" if rows != "time" and name != "time" else ""
            _describe(dataset, channel.unit, channel.meaning, clock)


def describe_extremes(file: h5py.File, dataset: h5d.DatasetID, name: str) -> None:
    """Name the dimensions of a new table (2, columns) of the extremes of a channel."""
    channel = _channel(name)
    _attach(file, dataset, ("smallest_largest", ALL_COLUMNS[channel.per]))
    _describe(dataset, channel.unit, f"smallest and largest of all steps: {channel.meaning}")


def describe_filtered(dataset: h5py.Dataset) -> None:
    """Name the dimensions of a new table (n, n_pantographs) of filtered contact forces."""
    channel = _channel("contact_force")
    _attach(dataset.file, dataset.id, ("time", COLUMNS[channel.per]))
    _describe(dataset, channel.unit, f"filtered {channel.meaning}", "time")


def hide(group: h5py.Group) -> None:
    """Mark tables of a state to continue from as mere dimensions for readers of netCDF-4.

    They need a name for each dimension of each table; whatever else a state holds is not for them.
    """
    for name in group:
        dataset = _table(group, name)
        if dataset.rank and not h5ds.is_scale(dataset):
            h5ds.set_scale(dataset, _SIZE % dataset.shape[0])


def _table(group: h5py.Group, path: str) -> h5d.DatasetID:
    return h5d.open(group.id, path.encode())


def _channel(name: str) -> Channel:
    known = {**channels.CHANNELS, **channels.ENERGIES, "time": channels.TIME}
    return known[name]


def _describe(
    dataset: h5py.Dataset | h5d.DatasetID, unit: str, meaning: str, coordinates: str = ""
) -> None:
    """Unit and meaning under the names of CF, whose unit of a mere number is 1."""
    set_attribute(dataset, "units", "1" if unit == "-" else unit)
    set_attribute(dataset, "long_name", meaning)
    if coordinates:
        set_attribute(dataset, "coordinates", coordinates)


def _add_places(file: h5py.File, name: str, x: np.ndarray) -> None:
    made = create_checked(file, name, x)
    h5ds.set_scale(made.id, name.encode())
    _describe(made, "m", f"position along the track of each {name.replace('_', ' ')}")


def _attach(file: h5py.File, dataset: h5d.DatasetID, names: tuple[str, ...]) -> None:
    """Name the dimensions of a table; scales that are not there are made with its sizes."""
    most = dataset.get_space().get_simple_extent_dims(True)
    for axis, name in enumerate(names):
        if name.encode() not in file.id:
            _add(file, name, dataset.shape[axis], most[axis] == h5s.UNLIMITED)
        h5ds.attach_scale(dataset, _table(file, name), axis)


def _add(file: h5py.File, name: str, size: int, grows: bool) -> None:
    if name in _COUNTED:
        made = create_checked(file, name, np.arange(1, size + 1))
        h5ds.set_scale(made.id, name.encode())
        _describe(made, "-", _COUNTED[name])
        return
    open_end: dict[str, Any] = {"maxshape": (None,), "chunks": (1,)} if grows else {}
    made = file.create_dataset(name, shape=(size,), dtype="f4", **open_end)
    h5ds.set_scale(made.id, _SIZE % size)
