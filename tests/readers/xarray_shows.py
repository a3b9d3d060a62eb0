"""Whether xarray shows times, places and units of a run: `make test-readers` runs it.

python xarray_shows.py FOLDER        # needs xarray, h5netcdf, netCDF4, h5py
"""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import xarray

TABLES = (
    "time", "channels/contact_force", "line/arm_x", "line_channels/time", "energy/time",
    "static/contact_x",
)  # fmt: skip


def check(folder: Path, engine: str) -> str:
    """Raise AssertionError unless all of a run is there by names."""
    path = folder / "run.h5"
    with h5py.File(path, "r") as file:
        wanted = {name: file[name][...] for name in TABLES}
    tree = xarray.open_datatree(path, engine=engine)
    for node in tree.subtree:
        own = node.to_dataset(inherit=False)
        assert not [name for name in own.dims if "phony" in str(name)], node.path
    force, uplift = tree["channels/contact_force"], tree["line_channels/arm_uplift"]
    assert force.dims == ("time", "pantograph") and force.attrs["units"] == "N"
    assert np.array_equal(tree["time"], wanted["time"]) and tree["time"].attrs["units"] == "s"
    at = force.sel(time=wanted["time"][7], pantograph=1)
    assert at.item() == wanted["channels/contact_force"][7, 0]
    assert np.array_equal(uplift["recorded_steady_arm"], wanted["line/arm_x"])
    assert uplift["recorded_steady_arm"].attrs["units"] == "m"
    assert np.array_equal(uplift["time"], wanted["line_channels/time"])
    assert np.array_equal(tree["energy/kinetic"]["time"], wanted["energy/time"])
    assert np.array_equal(tree["static/contact_height"]["contact_x"], wanted["static/contact_x"])
    return f"xarray {xarray.__version__} with {engine}: all by names"


if __name__ == "__main__":
    for each in ("h5netcdf", "netcdf4"):
        print(check(Path(sys.argv[1]), each))
