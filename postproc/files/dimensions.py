"""Names, places and units of a result file's dimensions, as netCDF-4 and CF have them.

xarray and other readers of netCDF-4 then show time, places and units. A dimension is a dataset of
the root group, which HDF5 calls a dimension scale: with values where these are places, numbers or
the time, else of its size alone. Everything is written with the head of the file: attached tables
may grow, and no flush writes anything here. Not collective.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import h5py
import numpy as np
from h5py import h5ds

from catenary.postproc.channels.facts import FACTS, Fact
from catenary.postproc.channels.facts import WIRE as CONTACT_WIRE
from catenary.postproc.files.hdf5.checked import create_checked, set_attribute
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
ARM, DROPPER, WIRE_END = "steady_arm", "dropper", "wire_end"
# What a column of a channel is, of the line's channels as far as they are recorded.
_OF_COLUMNS = {
    channels.PANTOGRAPH: "pantograph",
    channels.STRIP: "strip",
    channels.WIRE: "contact_wire_of_pantograph",
    channels.CONTACT: "contact",
    channels.ARM: f"recorded_{ARM}",
    channels.DROPPER: f"recorded_{DROPPER}",
    channels.WIRE_END: f"recorded_{WIRE_END}",
}
_ALL_OF = {channels.ARM: ARM, channels.DROPPER: DROPPER, channels.WIRE_END: WIRE_END}
# The dimension of a group's rows. Groups with a clock of their own have another dimension than the
# root's ``time``, which they would otherwise share.
_ROWS = {"channels": "time", "line_channels": "line_row", "energy": "energy_row"}
# How netCDF-4 names a scale that is a size and has no values.
_SIZE = b"This is a netCDF dimension but not a netCDF variable. %10d"


class _Table(NamedTuple):
    """Dimensions, unit and meaning of a table, and which tables of its group say where it is."""

    dimensions: tuple[str, ...]
    unit: str
    meaning: str
    coordinates: str = ""


_PLACE = "position along the track"
_CONSTANTS: dict[str, _Table] = {
    "complete_rows": _Table(
        ("clock",), "-", "rows that are whole: of channels, energies, and channels of the line"
    ),
    "line/arm_x": _Table((ARM,), "m", f"{_PLACE} of steady arms"),
    "line/arm_wire": _Table((ARM,), "-", "number of the wire that each steady arm holds"),
    "line/dropper_x": _Table((DROPPER,), "m", f"{_PLACE} of droppers"),
    "line/dropper_span": _Table((DROPPER,), "-", "span of each dropper, from 0"),
    "line/droppers": _Table((DROPPER, "upper_lower"), "-", "nodes of each dropper"),
    "line/end_x": _Table((WIRE_END,), "m", f"{_PLACE} of ends of wires"),
    "line/end_wire": _Table((WIRE_END,), "-", "number of the wire"),
    "line/end_outwards": _Table((WIRE_END,), "-", "1 where the wire ends, -1 where it begins"),
    "line/node_points": _Table(("node", "xyz"), "m", "places of the nodes at rest"),
    "line/support_x": _Table(("support",), "m", f"{_PLACE} of supports"),
    "line/running_range": _Table(("from_to",), "m", "where trains run"),
    "line/evaluation_range": _Table(("from_to",), "m", "stretch of the statistics"),
    "static/dropper_length": _Table((DROPPER,), "m", "length of droppers as cut"),
    "static/dropper_force": _Table((DROPPER,), "N", "tension of droppers at rest"),
    "static/contact_x": _Table(("contact_node",), "m", f"{_PLACE} of the contact wires' nodes"),
    "static/contact_height": _Table(
        ("contact_node",), "m", "height of the contact wires at rest", "contact_x"
    ),
    "static/contact_y": _Table(
        ("contact_node",), "m", "lateral place of the contact wires at rest", "contact_x"
    ),
    "static/elasticity_x": _Table(("elasticity_place",), "m", f"{_PLACE} of the unit force"),
    "static/elasticity": _Table(
        ("elasticity_place",), "m/N", "lift of a head under a unit force", "elasticity_x"
    ),
    "static/elasticity_of_wires": _Table(
        ("elasticity_place", "contact_wire"), "m/N",
        "lift of each contact wire under a unit force on it alone", "elasticity_x",
    ),
    "static/arm_stagger": _Table((ARM,), "m", "lateral place of the wire at steady arms"),
    "static/arm_force": _Table((ARM, "radial_lift_along"), "N", "force of steady arms at rest"),
    "static/arm_tension": _Table((ARM,), "N", "tension of steady arms at rest"),
}  # fmt: skip


def describe(file: h5py.File, places: dict[str, np.ndarray]) -> None:
    """Name the dimensions of all tables that are there. The root group has its attributes already.

    Parameters
    ----------
    file : a new result file
    places : what a column of a recorded channel of the line stands for -> where these are along
        the track, (recorded,) [m]
    """
    time = file["time"]
    h5ds.set_scale(time.id, b"time")
    _describe(time, channels.TIME.unit, channels.TIME.meaning)
    for name, own in ((ARM, "line/arm_x"), (DROPPER, "line/dropper_x"), (WIRE_END, "line/end_x")):
        if own in file:
            _add_places(file, name, file[own][...])
    for per, x in places.items():
        if _OF_COLUMNS[per] not in file:
            _add_places(file, _OF_COLUMNS[per], x)
    for path, table in _CONSTANTS.items():
        if path in file:
            _attach(file[path], table.dimensions)
            _describe(file[path], table.unit, table.meaning, table.coordinates)
    for group in ("wires", "breaks"):
        for name, dataset in file.get(f"line/{group}", {}).items():
            _attach(dataset, (f"{group}_{name}",))
            _describe(dataset, "-", f"{group} of {name}: numbers of nodes")
    for name, dataset in file["facts"].items():
        _attach(dataset, _of_fact(FACTS[name]))
        _describe(dataset, FACTS[name].unit, FACTS[name].meaning)
    for group, rows in _ROWS.items():
        for name, dataset in file.get(group, {}).items():
            channel = _channel(name)
            columns = () if dataset.ndim == 1 else (_OF_COLUMNS[channel.per],)
            _attach(dataset, (rows, *columns))
            clock = "time" if rows != "time" and name != "time" else ""
            _describe(dataset, channel.unit, channel.meaning, clock)
    for name, dataset in file.get("line_columns", {}).items():
        _attach(dataset, (_OF_COLUMNS[_channel(name).per],))
        _describe(dataset, "-", f"which columns of {name} are recorded, from 0")


def describe_extremes(dataset: h5py.Dataset, name: str) -> None:
    """Name the dimensions of a new table (2, columns) of the extremes of a channel."""
    channel = _channel(name)
    _attach(dataset, ("smallest_largest", _ALL_OF[channel.per]))
    _describe(dataset, channel.unit, f"extremes of the {channel.meaning}")


def hide(dataset: h5py.Dataset) -> None:
    """Let readers of netCDF-4 take a table of a state to continue from for a dimension alone.

    They need a name for each dimension of each table; whatever else a state holds is not for them.
    """
    if not h5ds.is_scale(dataset.id):
        h5ds.set_scale(dataset.id, _SIZE % dataset.shape[0])


def _channel(name: str) -> Channel:
    known = {**channels.CHANNELS, **channels.ENERGIES, "time": channels.TIME}
    return known[name]


def _of_fact(fact: Fact) -> tuple[str, ...]:
    named = {channels.PANTOGRAPH: ("pantograph",), CONTACT_WIRE: ("contact_wire",)}
    return named.get(fact.per, ())


def _describe(dataset: h5py.Dataset, unit: str, meaning: str, coordinates: str = "") -> None:
    """Unit and meaning under the names of CF, whose unit of a mere number is 1."""
    set_attribute(dataset, "units", "1" if unit == "-" else unit)
    set_attribute(dataset, "long_name", meaning)
    if coordinates:
        set_attribute(dataset, "coordinates", coordinates)


def _add_places(file: h5py.File, name: str, x: np.ndarray) -> None:
    made = create_checked(file, name, x)
    h5ds.set_scale(made.id, name.encode())
    _describe(made, "m", f"{_PLACE} of each {name.replace('_', ' ')}")


def _attach(dataset: h5py.Dataset, names: tuple[str, ...]) -> None:
    """Name the dimensions of a table; scales that are not there are made with its sizes."""
    for axis, name in enumerate(names):
        size, most = dataset.shape[axis], dataset.maxshape[axis]
        if name not in dataset.file:
            _add(dataset.file, name, size, most)
        h5ds.attach_scale(dataset.id, dataset.file[name].id, axis)


def _add(file: h5py.File, name: str, size: int, most: int | None) -> None:
    if name in _COUNTED:
        made = create_checked(file, name, np.arange(1, size + 1))
        h5ds.set_scale(made.id, name.encode())
        _describe(made, "-", _COUNTED[name])
        return
    open_end: dict[str, Any] = {"maxshape": (None,), "chunks": (1,)} if most is None else {}
    made = file.create_dataset(name, shape=(size,), dtype="f4", **open_end)
    h5ds.set_scale(made.id, _SIZE % size)
