"""Names, places and units of a result file's dimensions, as netCDF-4 and CF have them.

xarray and other readers of netCDF-4 then show time, places and units. A dimension is a dataset of
the root group, which HDF5 calls a dimension scale: with values where these are places, numbers or
the time, else of its size alone. Everything is written with the head of the file: attached tables
may grow, and no flush writes anything here. Not collective.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5ds

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
_SIZE = "This is a netCDF dimension but not a netCDF variable. %10d"


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
    file["time"].make_scale("time")
    _describe(file["time"], channels.TIME.unit, channels.TIME.meaning)
    for name, own in PLACES.items():
        if own in file:
            _add_places(file, name, file[own][...])
    for per, x in places.items():
        if COLUMNS[per] not in file:
            _add_places(file, COLUMNS[per], x)
    tables = constant_tables(file["line/wires"], file.get("line/breaks", ()))
    for path, table in {COMPLETE: COUNTS, **tables, **fact_tables()}.items():
        if path in file:
            dataset = file[path]
            _attach(file, dataset, table.dimensions)
            _describe(dataset, table.unit, table.meaning, table.coordinates)
    for group, rows in _ROWS.items():
        for name in file.get(group, ()):
            dataset, channel = file[f"{group}/{name}"], _channel(name)
            columns = () if dataset.ndim == 1 else (COLUMNS[channel.per],)
            _attach(file, dataset, (rows, *columns))
            clock = "time" if rows != "time" and name != "time" else ""
            _describe(dataset, channel.unit, channel.meaning, clock)


def describe_extremes(file: h5py.File, dataset: h5py.Dataset, name: str) -> None:
    """Name the dimensions of a new table (2, columns) of the extremes of a channel."""
    channel = _channel(name)
    _attach(file, dataset, ("smallest_largest", ALL_COLUMNS[channel.per]))
    _describe(dataset, channel.unit, f"smallest and largest of all steps: {channel.meaning}")


def describe_filtered(dataset: h5py.Dataset) -> None:
    """Name the dimensions of a new table (n, n_pantographs) of filtered contact forces."""
    channel = _channel("contact_force")
    _attach(dataset.file, dataset, ("time", COLUMNS[channel.per]))
    _describe(dataset, channel.unit, f"filtered {channel.meaning}", "time")


def hide(group: h5py.Group) -> None:
    """Mark tables of a state to continue from as mere dimensions for readers of netCDF-4.

    They need a name for each dimension of each table; whatever else a state holds is not for them.
    A flush looks at all of them, by HDF5's own calls.
    """
    for name in group:
        dataset = h5d.open(group.id, name.encode())
        if dataset.rank and not h5ds.is_scale(dataset):
            h5ds.set_scale(dataset, (_SIZE % dataset.shape[0]).encode())


def _channel(name: str) -> Channel:
    known = {**channels.CHANNELS, **channels.ENERGIES, "time": channels.TIME}
    return known[name]


def _describe(dataset: h5py.Dataset, unit: str, meaning: str, coordinates: str = "") -> None:
    """Unit and meaning under the names of CF, whose unit of a mere number is 1."""
    set_attribute(dataset, "units", "1" if unit == "-" else unit)
    set_attribute(dataset, "long_name", meaning)
    if coordinates:
        set_attribute(dataset, "coordinates", coordinates)


def _add_values(file: h5py.File, name: str, values: np.ndarray, unit: str, meaning: str) -> None:
    """Make a scale with values."""
    made = create_checked(file, name, values)
    made.make_scale(name)
    _describe(made, unit, meaning)


def _add_places(file: h5py.File, name: str, x: np.ndarray) -> None:
    words = f"position along the track of each {name.replace('_', ' ')}"
    _add_values(file, name, x, "m", words)


def _attach(file: h5py.File, dataset: h5py.Dataset, names: tuple[str, ...]) -> None:
    """Name the dimensions of a table; scales that are not there are made with its sizes."""
    for axis, (name, size, most) in enumerate(
        zip(names, dataset.shape, dataset.maxshape, strict=True)
    ):
        if name not in file and name in _COUNTED:
            _add_values(file, name, np.arange(1, size + 1), "-", _COUNTED[name])
        elif name not in file:
            grows: dict[str, Any] = {"maxshape": (None,), "chunks": (1,)} if most is None else {}
            file.create_dataset(name, (size,), "f4", **grows).make_scale(_SIZE % size)
        dataset.dims[axis].attach_scale(file[name])
