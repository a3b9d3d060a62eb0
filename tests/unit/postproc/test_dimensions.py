"""Dimensions of a result file have names and units, as readers of netCDF-4 want them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from catenary.postproc.files.run_schema import (
    COMPLETE,
    RunAttributes,
    constant_tables,
    fact_tables,
    growing_tables,
)
from catenary.postproc.read.results import Results


@pytest.fixture(scope="module")
def tables(run_folder: Path) -> dict[str, h5py.Dataset]:
    """All tables of a result file by path."""
    found: dict[str, h5py.Dataset] = {}

    def take(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item

    h5py.File(run_folder / "run.h5", "r", locking=False).visititems(take)
    return found


def is_size(table: h5py.Dataset) -> bool:
    """Whether a dimension has no values."""
    return bytes(table.attrs.get("NAME", b"")).startswith(b"This is a netCDF dimension but not")


def test_each_dimension_of_each_table_has_one_name(tables: dict[str, h5py.Dataset]) -> None:
    scaled = 0
    for path, table in tables.items():
        if "CLASS" in table.attrs:  # its own dimension, or one that is hidden
            continue
        for axis, dimension in enumerate(table.dims):
            (scale,) = dimension.values()
            assert scale.name.count("/") == 1, "readers look for it in the root group"
            size = scale.shape[0]
            if table.maxshape[axis] is None and is_size(scale):
                assert scale.maxshape == (None,)  # its length is that of the longest table
            else:
                assert size == table.shape[axis], path
            scaled += 1
    assert scaled > 40


def test_all_that_a_file_holds_is_declared(
    run_folder: Path, tables: dict[str, h5py.Dataset]
) -> None:
    """In the schema, which its reader checks; states and extremes have checks of their own."""
    with Results(run_folder) as results:
        record, wires = results.line_record, results.wires()
        attributes = set(results.attributes)
    declared = {COMPLETE, *constant_tables(wires, ()), *fact_tables()}
    declared |= set().union(*growing_tables(record))
    found = {path for path in tables if not path.startswith(("checkpoint/", "extremes/"))}
    assert {path for path in found - declared if "CLASS" not in tables[path].attrs} == set()
    required = {path for path, own in constant_tables(wires, ()).items() if not own.optional}
    assert required | set(fact_tables()) <= found
    assert attributes - set(RunAttributes.model_fields) == {"format", "Conventions"}


def test_states_to_continue_from_are_hidden(tables: dict[str, h5py.Dataset]) -> None:
    states = [table for path, table in tables.items() if path.startswith("checkpoint/")]
    assert states and all(is_size(table) for table in states if table.ndim)


def test_each_table_that_is_shown_has_its_unit(tables: dict[str, h5py.Dataset]) -> None:
    for path, table in tables.items():
        if not is_size(table) and not path.startswith(("checkpoint/", "extremes/")):
            assert table.attrs["units"] and table.attrs["long_name"], path
    assert tables["channels/contact_force"].attrs["units"] == b"N"
    assert tables["static/elasticity"].attrs["units"] == b"m/N"
    assert (
        tables["line/end_wire" if "line/end_wire" in tables else "line/dropper_span"].attrs["units"]
        == b"1"
    )


def test_extremes_say_what_they_are_of(tables: dict[str, h5py.Dataset]) -> None:
    """Before a channel's own meaning, which may begin with an article or with "how far"."""
    kept = [path for path in tables if path.startswith("extremes/0/") and tables[path].ndim == 2]
    assert kept
    for path in kept:
        meaning = tables["line_channels/" + path.rpartition("/")[2]].attrs["long_name"]
        said = tables[path].attrs["long_name"]
        assert bytes(said) == b"smallest and largest of all steps: " + bytes(meaning)


def test_places_and_numbers_are_the_values_of_dimensions(tables: dict[str, h5py.Dataset]) -> None:
    for name, table in (("steady_arm", "line/arm_x"), ("dropper", "line/dropper_x")):
        np.testing.assert_array_equal(tables[name], tables[table])
        columns = tables[
            f"line_columns/{'arm_uplift' if name == 'steady_arm' else 'dropper_force'}"
        ]
        np.testing.assert_array_equal(tables[f"recorded_{name}"], tables[table][...][columns[...]])
    n = tables["channels/contact_force"].shape[1]
    np.testing.assert_array_equal(tables["pantograph"], np.arange(1, n + 1))


def test_clocks_apart_from_the_steps_do_not_share_their_dimension(
    tables: dict[str, h5py.Dataset],
) -> None:
    """xarray refuses a group whose times are others than those of the group above."""
    for group, rows in (("energy", "energy_row"), ("line_channels", "line_row")):
        (scale,) = tables[f"{group}/time"].dims[0].values()
        assert scale.name == f"/{rows}"
        others = [table for path, table in tables.items() if path.startswith(f"{group}/")]
        assert {bytes(t.attrs.get("coordinates", b"")) for t in others} == {b"time", b""}


def test_a_file_without_names_is_read(run_folder: Path, tmp_path: Path) -> None:
    """As earlier ones are: no reader of ours needs them."""
    with (
        h5py.File(run_folder / "run.h5", locking=False) as source,
        h5py.File(tmp_path / "run.h5", "w") as file,
    ):
        for name, value in source.attrs.items():
            file.attrs[name] = value
        for name, item in source.items():
            if isinstance(item, h5py.Group) or name in ("time", "complete_rows"):
                source.copy(item, file, name=name, without_attrs=False)
        dropped = ("CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "units", "long_name")

        def strip(name: str, item: h5py.Group | h5py.Dataset) -> None:
            for attribute in set(dropped) & set(item.attrs):
                del item.attrs[attribute]

        file.visititems(strip)
    with Results(tmp_path) as bare, Results(run_folder) as whole:
        assert bare.damage == whole.damage == []
        np.testing.assert_array_equal(bare.channel("contact_force"), whole.channel("contact_force"))
