"""Dimensions and further channels of a result file, and the tables that document them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.postproc.files.facts import FACTS
from catenary.postproc.files.run_schema import (
    COMPLETE,
    RunAttributes,
    constant_tables,
    fact_tables,
    growing_tables,
)
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures import force_pictures
from catenary.postproc.report.report import write_report
from catenary.solver.time_loop.views.channels import CHANNELS, ENERGIES, RUN, TrainLayout

# --- dimensions of a result file have names and units, as readers of netCDF-4 want them -----------


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


# --- the strips' shares of the contact force ------------------------------------------------------


@pytest.fixture
def with_strips(make_march: Any) -> Any:
    """Two pantographs: one strip, and two that carry 60 and 40 %."""

    class Striped(make_march):  # type: ignore[misc]
        def stage(self, first_step: int = 0) -> Any:
            return replace(super().stage(first_step), train=TrainLayout((1, 2)))

        def more(self, step: int) -> Any:
            leading, trailing = self.force(step * self.dt)
            return {"strip_force": np.array([leading, 0.6 * trailing, 0.4 * trailing])}

    return Striped(n_steps=600)


def test_each_strip_has_a_column(tmp_path: Path, with_strips: Any, record_run: Any) -> None:
    record_run(tmp_path / "run.h5", with_strips)
    with Results(tmp_path) as results:
        assert results.n_strips() == [1, 2]
        assert results.strip_columns() == [range(0, 1), range(1, 3)]
        one, two = np.split(results.channel("strip_force"), [1], axis=1)
        force = results.channel("contact_force")
        np.testing.assert_array_equal(one, force[:, :1])
        np.testing.assert_allclose(two, force[:, 1:] * [0.6, 0.4], rtol=1e-15)
        figure = force_pictures.strip_forces(results)
        assert len(figure.axes) == 1
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["channels/strip_force"].attrs["unit"] == b"N"


@pytest.mark.usefixtures("quick_report")
def test_the_report_shows_them(tmp_path: Path, with_strips: Any, record_run: Any) -> None:
    record_run(tmp_path / "run.h5", with_strips)
    write_report(tmp_path, tmp_path)
    assert (tmp_path / "strip_forces.png").is_file()
    assert "Shares of the collector strips" in (tmp_path / "report.html").read_text()


def test_runs_of_single_strips_have_no_such_channel(run_folder: Path) -> None:
    with h5py.File(run_folder / "run.h5", locking=False) as file:
        assert "strip_force" not in file["channels"]
    with Results(run_folder) as results:
        assert results.n_strips() == [1, 1]
        assert not results.several_strips and not results.has("strip_force")


# --- the tables of docs/architecture.md that are written down in the code too are the same --------


DOCUMENT = Path(__file__).parents[3] / "docs" / "architecture.md"


def tables_of_the_page() -> dict[str, list[str]]:
    """Lines of each table, by the name in the comments around it."""
    facts = [
        f"| `{name}` | {fact.unit} | {fact.per if fact.per != RUN else ''} | {fact.meaning} |"
        for name, fact in FACTS.items()
    ]
    channels = [
        f"| `{channel.name}` | {channel.unit} | {channel.per} | {channel.meaning} |"
        for channel in (*CHANNELS.values(), *ENERGIES.values())
        if channel.values or channel.energy
    ]
    return {
        "facts": ["| fact | unit | of each | |", "|---|---|---|---|", *facts],
        "channels": ["| channel | unit | per | |", "|---|---|---|---|", *channels],
    }


@pytest.mark.parametrize("name", tables_of_the_page())
def test_a_table_is_the_one_in_the_code(name: str) -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    shown = text.split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0]
    assert shown.split("\n")[2:-2] == tables_of_the_page()[name]
