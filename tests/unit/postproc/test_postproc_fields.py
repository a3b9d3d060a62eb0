"""Field snapshots, read back by VTK's reader, and their files after flushes and kills."""

from __future__ import annotations

import dataclasses
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista
from watched_fields import BLOCKS, blocks_at, times_in, watch

from catenary import RunBroken
from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE
from catenary.postproc.record.snapshots import fields_file
from catenary.postproc.record.snapshots.contents import (
    ARMS,
    FIELDS,
    KINDS,
    MASTS,
    SIZES,
    SLOPE,
    BlockTables,
    Course,
    FieldKind,
    FieldRecord,
    blocks_of,
)
from catenary.postproc.record.snapshots.field_values import bending_moment
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.postproc.record.snapshots.fields_schema import read_fields, xdmf_of

# --- field snapshots, read back by VTK's XDMF reader ----------------------------------------------


AT_REST = {own.name for own in dataclasses.fields(BlockTables)}


def test_xdmf_has_the_times_of_the_steps_to_the_last_digit(tmp_path: Path, make_march: Any) -> None:
    """What stands beside the line has the times of the file; any others would be more times."""
    march, path = make_march(n_steps=990, dt=1.1e-3), tmp_path / "fields.xdmf"
    march.drive(watch(march, path, every=7))
    with h5py.File(tmp_path / "fields.h5") as file:
        times = file["times"][...].tolist()
    assert times_in(path) == times * len(BLOCKS)
    assert times == [step * march.dt for step in range(0, 991, 7)]


def test_vtk_reads_points_times_and_values(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path))
    reader = pyvista.get_reader(path)
    np.testing.assert_allclose(reader.time_values, 0.05 * np.arange(21), rtol=1e-12)
    for time in reader.time_values[::5]:
        blocks = blocks_at(path, time)
        assert tuple(blocks) == BLOCKS
        for name in (CONTACT_WIRE, MESSENGER_WIRE, DROPPERS):
            grid, nodes = blocks[name], march.mesh.wires.get(name, march.mesh.droppers.ravel())
            at_rest = march.mesh.points[nodes]
            expected = march.wave(time, at_rest[:, 0])
            np.testing.assert_array_equal(grid.points, at_rest)
            np.testing.assert_allclose(grid.point_data["uplift"], expected, atol=1e-8)
            moved = grid.point_data["displacement"]
            np.testing.assert_array_equal(moved[:, :2], 0.0)
            np.testing.assert_array_equal(moved[:, 2], grid.point_data["uplift"])
            warped = grid.warp_by_vector("displacement", factor=2.0)
            np.testing.assert_allclose(warped.points[:, 2], at_rest[:, 2] + 2 * expected, atol=1e-6)
        cells = blocks[CONTACT_WIRE].cell_connectivity.reshape(-1, 2)
        np.testing.assert_array_equal(cells[:, 1] - cells[:, 0], 1)
        assert blocks[DROPPERS].n_cells == len(march.mesh.droppers)


def test_arms_end_on_the_wire_and_masts_stand_beside_it(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    march.drive(watch(march, path))
    blocks = blocks_at(path, 0.1)
    arms, masts = blocks[ARMS], blocks[MASTS]
    np.testing.assert_array_equal(arms.points[1::2], march.mesh.points[march.mesh.steady_arms])
    np.testing.assert_array_equal(arms.point_data["uplift"][0::2], 0.0)
    np.testing.assert_allclose(
        arms.point_data["uplift"][1::2], march.wave(0.1, march.arm_x), atol=1e-8
    )
    np.testing.assert_allclose(masts.points[0::2, 0], march.line.support_positions)
    assert (masts.points[0::2, 2] > march.mesh.points[:, 2].max()).all()
    assert not masts.point_data.keys(), "what never moves has no field"


def test_arms_reach_the_wire_where_its_stagger_is(make_march: Any) -> None:
    march = make_march(n_steps=10)
    staggered = march.mesh.points.copy()
    staggered[:, 1] = 0.2 * np.cos(np.pi * staggered[:, 0] / 50.0)
    blocks = {block.name: block for block in blocks_of(march.recorded, staggered)}
    ends = blocks[ARMS].points[1::2]
    np.testing.assert_array_equal(ends, staggered[march.mesh.steady_arms])
    np.testing.assert_allclose(np.abs(ends[:, 1]), 0.2)
    assert (blocks[MASTS].points[:, 1] > 1.0).all()


def test_all_fields_have_their_values(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=400), tmp_path / "fields.xdmf"
    march.drive(watch(march, path, record=FieldRecord(FIELDS)))
    view, blocks = march.view(350), blocks_at(path, 0.35)
    for name, nodes in march.mesh.wires.items():
        data, x = blocks[name].point_data, march.mesh.points[nodes, 0]
        rate = march.motion(0.35, x, "w", True)
        np.testing.assert_allclose(data["velocity"][:, 2], rate, atol=1e-6)
        np.testing.assert_array_equal(data["velocity"][:, :2], 0.0)
        np.testing.assert_array_equal(data["tension"], march.tension[nodes])
        stiffness = march.line.wire(name).bending_stiffness
        height = march.mesh.points[nodes, 2] + march.wave(0.35, x)
        slope = march.motion(0.35, x, "theta_y", False)
        each = np.full(x.size - 1, stiffness)
        bent = bending_moment(x, height[None], slope[None], NO_BREAKS, each)
        np.testing.assert_allclose(
            data["bending_moment"], bent[0], rtol=1e-6, atol=1e-4 * stiffness
        )
    droppers = blocks[DROPPERS].cell_data
    np.testing.assert_allclose(droppers["dropper_force"], view.dropper_force, rtol=1e-6)
    np.testing.assert_array_equal(droppers["dropper_state"], np.sign(view.dropper_force))
    assert (droppers["dropper_state"] < 0).any() and (droppers["dropper_state"] > 0).any()


NO_BREAKS = np.zeros(0, dtype=int)


def test_a_field_of_another_unknown_is_one_row(
    tmp_path: Path, make_march: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as a turn of the wire: not what nodes do in height."""
    kind = FieldKind("turn", "rad", "slope of the wire", motions=((SLOPE, False),), of_wires=True)
    monkeypatch.setitem(KINDS, kind.name, kind)
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    march.drive(watch(march, path, record=FieldRecord(("uplift", kind.name))))
    blocks = blocks_at(path, 0.1)
    for name, nodes in march.mesh.wires.items():
        slope = march.motion(0.1, march.mesh.points[nodes, 0], SLOPE, False)
        np.testing.assert_allclose(blocks[name].point_data[kind.name], slope, atol=1e-8)
    assert kind.name not in blocks[DROPPERS].point_data.keys()


def test_moment_of_a_cubic_is_that_of_the_cubic() -> None:
    x, stiffness = np.array([0.0, 0.4, 1.5, 2.0, 4.0]), np.ones(4)
    w, slope = x**3 - 2 * x**2, 3 * x**2 - 4 * x
    found = bending_moment(x, w[None], slope[None], NO_BREAKS, stiffness)[0]
    np.testing.assert_allclose(found, 6 * x - 4, rtol=1e-12)
    # Two pieces of other slopes, which nothing joins.
    lifted = np.where(x > 1.0, 5.0 + x, w), np.where(x > 1.0, 1.0, slope)
    found = bending_moment(x, lifted[0][None], lifted[1][None], np.array([2]), stiffness)[0]
    np.testing.assert_allclose(found, [-4.0, -1.6, 0.0, 0.0, 0.0], atol=1e-12)


def test_fields_that_are_not_chosen_cost_nothing(tmp_path: Path, make_march: Any) -> None:
    asked = []

    def listened(march: Any, step: int) -> Any:
        view = type(march).view(march, step)
        motion, tension = view.node_motion, view.wire_tension
        view.node_motion = lambda *what: (asked.append(what), motion(*what))[1]
        view.wire_tension = lambda: (asked.append("tension"), tension())[1]
        return view

    sizes = {}
    for chosen in (("uplift",), ("uplift", "displacement"), ("velocity",), FIELDS):
        march, path = make_march(n_steps=200), tmp_path / "fields.xdmf"
        march.view = lambda step, march=march: listened(march, step)
        asked.clear()
        march.drive(watch(march, path, record=FieldRecord(chosen)))
        sizes[chosen] = (tmp_path / "fields.h5").stat().st_size, set(asked)
        with h5py.File(tmp_path / "fields.h5") as file:
            assert set(file["masts"]) == AT_REST
            assert set(file["steady_arms"]) - AT_REST == {
                name for name in chosen if name in ("uplift", "displacement", "velocity")
            }
    assert sizes["uplift",][1] == sizes["uplift", "displacement"][1] == {("w", False)}
    assert sizes["velocity",][1] == {("w", True)}
    assert sizes[FIELDS][1] == {("w", False), ("w", True), ("theta_y", False), "tension"}
    n_moving = march.mesh.n_nodes + 2 * march.dropper_x.size + 2 * march.arm_x.size
    more = sizes["uplift", "displacement"][0] - sizes["uplift",][0]
    assert 0 <= more - 12 * 5 * n_moving <= 8 * 1024, "values, and tables of four blocks"


def test_a_window_goes_with_the_train(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    course = Course(float(march.position(0.0).min()), float(march.position(0.0).max()), march.speed)
    record = FieldRecord(FIELDS, window=(30.0, 20.0), course=course)
    march.drive(watch(march, path, record=record))
    whole = tmp_path / "whole.xdmf"
    march.drive(watch(march, whole, record=FieldRecord(FIELDS)))
    for time in (0.0, 0.5, 1.0):
        low, high = march.position(time).min() - 30.0, march.position(time).max() + 20.0
        every, part = blocks_at(whole, time), blocks_at(path, time)
        for name in BLOCKS:
            x = every[name].points[:, 0]
            by_unit = x if name in march.mesh.wires else np.repeat(x[1::2], 2)
            inside = (by_unit >= low) & (by_unit <= high)
            grid = part[name]
            np.testing.assert_array_equal(grid.points, every[name].points[inside])
            for field, values in every[name].point_data.items():
                if field != "bending_moment":
                    np.testing.assert_array_equal(grid.point_data[field], values[inside])
            for field, values in every[name].cell_data.items():
                np.testing.assert_array_equal(grid.cell_data[field], values[inside[1::2]])
            joined = inside.sum() - 1 if name in march.mesh.wires else inside.sum() // 2
            assert grid.n_cells == joined
    sizes = [one.with_suffix(".h5").stat().st_size for one in (path, whole)]
    assert sizes[0] < 0.75 * sizes[1]


def test_a_window_beyond_the_line_shows_its_end(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    record = FieldRecord(window=(1.0, 1.0), course=Course(5e3, 5e3, 50.0))
    march.drive(watch(march, path, record=record))
    blocks = blocks_at(path, 0.1)
    assert [blocks[name].n_cells for name in BLOCKS] == [1] * 5
    assert blocks[CONTACT_WIRE].points[-1, 0] == march.mesh.points[:, 0].max()


def test_parts_and_stretches_are_chosen(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    record = FieldRecord(
        ("uplift", "dropper_force"), parts=(CONTACT_WIRE, DROPPERS), stretch=(100.0, 200.0)
    )
    march.drive(watch(march, path, record=record))
    blocks = blocks_at(path, 0.05)
    assert tuple(blocks) == (CONTACT_WIRE, DROPPERS)
    x = march.mesh.points[march.mesh.wires[CONTACT_WIRE], 0]
    np.testing.assert_array_equal(blocks[CONTACT_WIRE].points[:, 0], x[(x >= 100.0) & (x <= 200.0)])
    there = (march.dropper_x >= 100.0) & (march.dropper_x <= 200.0)
    force = march.view(50).dropper_force[there]
    np.testing.assert_allclose(blocks[DROPPERS].cell_data["dropper_force"], force, rtol=1e-6)


def test_pieces_of_a_wire_stay_apart_in_a_window(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    nodes = march.mesh.wires[CONTACT_WIRE]
    breaks = np.array([40, 41, 55])
    mesh = dataclasses.replace(march.mesh, wires={"cut": nodes}, breaks={"cut": breaks})
    line = march.recorded._replace(mesh=mesh)
    block = blocks_of(line, march.mesh.points)[0]
    low, high = block.points[[35, 60], 0]
    record = FieldRecord(window=(0.0, high - low), course=Course(low, low, 30.0))
    recorder = FieldRecorder(march.comm, path, line, every=50, record=record)
    march.drive(recorder)
    for time in (0.0, 0.4, 0.95):
        grid = blocks_at(path, time)["cut"]
        first = int(np.searchsorted(block.points[:, 0], low + 30.0 * time))
        assert grid.points[0, 0] == block.points[first, 0]
        cells = grid.cell_connectivity.reshape(-1, 2)
        inside = [at - first for at in breaks.tolist() if first < at < first + grid.n_points]
        expected = [k for k in range(grid.n_points - 1) if k + 1 not in inside]
        np.testing.assert_array_equal(cells[:, 0], expected)
        np.testing.assert_array_equal(cells[:, 1] - cells[:, 0], 1)


# --- files of snapshots after each flush, after a kill, on a full disk ----------------------------


def test_snapshots_can_be_shown_after_every_flush(tmp_path: Path, make_march: Any) -> None:
    """Of a run that goes on, or was killed; its own text comes at its end."""
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    path.write_text("of an earlier run")
    watcher = watch(march, path)
    watcher.start(march.stage())
    assert not path.exists(), "it would show other numbers"
    shown = tmp_path / "shown.xdmf"
    for step in range(230):  # the steps 50, 100, 150 and 200 fill the buffer
        watcher.observe(march.view(step))
        if step in (0, 220):
            with h5py.File(tmp_path / "fields.h5", locking=False) as file:
                shown.write_text(xdmf_of(file, read_fields(file), "fields.h5"))
            n = len(march.mesh.wires[CONTACT_WIRE])
            assert blocks_at(shown, 0.0)[CONTACT_WIRE].n_points == n
    assert pyvista.get_reader(shown).time_values == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2])
    watcher.finish("interrupted")
    assert times_in(path) == pytest.approx(np.tile(0.05 * np.arange(5), len(BLOCKS)))


def test_xdmf_names_the_numbers_beside_it(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=100), tmp_path / "run_7.xdmf"
    march.drive(watch(march, path))
    items = list(ElementTree.parse(path).iter("DataItem"))
    assert items and {item.text for item in items} == {"run_7.h5"}
    places = set()
    with h5py.File(tmp_path / "run_7.h5") as file:
        for name in BLOCKS:
            for table in file[name].values():
                begin = table.id.get_offset() or 0
                places |= {*range(begin, begin + table.nbytes + 1)}
    assert {int(item.attrib["Seek"]) for item in items} <= places


def test_a_text_that_cannot_be_written_is_told(
    tmp_path: Path, make_march: Any, caplog: pytest.LogCaptureFixture
) -> None:
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    watcher = watch(march, path)
    watcher.start(march.stage())
    path.mkdir()
    with caplog.at_level("WARNING", "catenary.fields"):
        watcher.finish("done")
    assert f"writing {path} failed" in caplog.text and "catenary paraview" in caplog.text


def odd_places(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["contact_wire/first"][...] = -1


def no_places(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file[SIZES]


def linked_places(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["link"] = h5py.SoftLink("/times")


@pytest.mark.parametrize("damage", [odd_places, no_places, linked_places])
def test_a_file_that_another_program_changed_ends_in_a_warning(
    damage: Any, tmp_path: Path, make_march: Any, caplog: pytest.LogCaptureFixture
) -> None:
    march, path = make_march(n_steps=100), tmp_path / "fields.xdmf"
    watcher = watch(march, path)
    watcher.start(march.stage())
    watcher.observe(march.view(0))
    damage(tmp_path / "fields.h5")
    own = f"/proc/{os.getpid()}/fd"
    with caplog.at_level("WARNING", "catenary.fields"):
        watcher.finish("done")
    assert f"writing {path} failed" in caplog.text and len(caplog.records) == 1
    opened = [os.path.realpath(one) for one in Path(own).iterdir()]
    assert str(tmp_path / "fields.h5") not in opened


@pytest.mark.process
def test_resumed_fields_replace_what_follows(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    march.drive(watch(march, path, resume=True), first_step=500)
    reader = pyvista.get_reader(path)
    np.testing.assert_allclose(reader.time_values, 0.05 * np.arange(21), rtol=1e-12)


@pytest.mark.process
@pytest.mark.parametrize(
    "last",
    [pytest.param(0, marks=pytest.mark.study), 1, pytest.param(401, marks=pytest.mark.study), 405],
)
def test_no_snapshot_before_the_state_is_lost(
    last: int, tmp_path: Path, make_march: Any, caplog: pytest.LogCaptureFixture
) -> None:
    """A run that is stopped in its first step has a state of it; the snapshots stand 400 steps
    apart, a hundredth of which is more than the steps between a snapshot and the state."""
    march, path = make_march(n_steps=1300), tmp_path / "fields.xdmf"
    march.drive(watch(march, path, every=400), outcome="interrupted", last=last)
    with caplog.at_level("WARNING", "catenary.fields"):
        march.drive(watch(march, path, every=400, resume=True), first_step=last)
    assert not caplog.records
    np.testing.assert_allclose(pyvista.get_reader(path).time_values, 0.4 * np.arange(4))


@pytest.mark.process
def test_fields_of_a_line_that_was_found_by_other_round_off_are_continued(
    tmp_path: Path, make_march: Any, caplog: pytest.LogCaptureFixture
) -> None:
    """Another version, or another machine's processor, began the run."""
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    with h5py.File(tmp_path / "fields.h5", "r+") as file:
        file["contact_wire/points"][:, 2] += 1e-9
    with caplog.at_level("WARNING", "catenary.fields"):
        march.drive(watch(march, path, resume=True), first_step=500)
    assert not caplog.records
    assert len(pyvista.get_reader(path).time_values) == 21


@pytest.mark.process
def test_a_snapshot_that_a_kill_left_half_written_is_replaced(
    tmp_path: Path, make_march: Any
) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    with h5py.File(tmp_path / "fields.h5", "r+") as file:
        # In its place, but not yet among the times.
        n = file["contact_wire/count"][0]
        file["contact_wire/uplift"][13 * n : 13 * n + 7] = 99.0
    march.drive(watch(march, path, resume=True), first_step=600)
    reader = pyvista.get_reader(path)
    np.testing.assert_allclose(reader.time_values, 0.05 * np.arange(21), rtol=1e-12)
    reader.set_active_time_value(reader.time_values[13])
    wire = reader.read()[CONTACT_WIRE]
    expected = march.wave(0.65, wire.points[:, 0])
    np.testing.assert_allclose(wire.point_data["uplift"], expected, atol=1e-8)


def other_times(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["times"][3] = -1.0


def other_mesh(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["contact_wire/points"][2, 2] = np.nan


def no_snapshots(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["contact_wire/uplift"]


def broken_tables(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[60:70] = b"x" * 10
    path.write_bytes(data)


@pytest.mark.process
@pytest.mark.parametrize(
    "damage",
    [
        other_times,
        pytest.param(other_mesh, marks=pytest.mark.study),
        pytest.param(no_snapshots, marks=pytest.mark.study),
        broken_tables,
    ],
)
def test_damaged_snapshots_are_begun_anew(
    damage: Any, tmp_path: Path, make_march: Any, caplog: pytest.LogCaptureFixture
) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    damage(tmp_path / "fields.h5")
    with caplog.at_level("WARNING", "catenary.fields"):
        march.drive(watch(march, path, resume=True), first_step=600)
    assert "its snapshots now begin at t = 0.600 s" in caplog.text
    reader = pyvista.get_reader(path)
    np.testing.assert_allclose(reader.time_values, 0.6 + 0.05 * np.arange(9), rtol=1e-12)


def test_no_table_of_the_file_changes_once_the_run_goes_on(tmp_path: Path, make_march: Any) -> None:
    # What a kill could leave half done would be among the bytes outside the snapshots' places.
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    numbers = tmp_path / "fields.h5"
    watcher = watch(march, path)
    watcher.start(march.stage())
    before = bytearray(numbers.read_bytes())
    for step in range(1001):
        watcher.observe(march.view(step))
    watcher.finish("done")
    after = bytearray(numbers.read_bytes())
    assert len(after) == len(before) and after != before
    with h5py.File(numbers) as file:
        moving = [name for name in BLOCKS if name != MASTS]
        kinds = [file[name][kind] for name in moving for kind in ("uplift", "displacement")]
        places = [file["times"], file["pantograph_places"], *kinds]
        assert len(places) == 2 + 2 * 4
        for offset, size in [(place.id.get_offset(), place.nbytes) for place in places]:
            before[offset : offset + size] = after[offset : offset + size] = bytes(size)
    assert after == before


def test_times_tell_how_far_a_run_came(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    with h5py.File(tmp_path / "fields.h5") as file:
        times = file["times"][...]
    np.testing.assert_allclose(times[:13], 0.05 * np.arange(13), rtol=1e-12)
    assert times.size == 21 and np.isnan(times[13:]).all()


@pytest.mark.process
@pytest.mark.parametrize("share", [pytest.param(0.0, marks=pytest.mark.study), 0.6])
def test_a_file_that_a_kill_has_spoilt_is_begun_anew(
    share: float, tmp_path: Path, make_march: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    march.drive(watch(march, path), outcome="interrupted", last=620)
    numbers = tmp_path / "fields.h5"
    numbers.write_bytes(numbers.read_bytes()[: int(share * numbers.stat().st_size)])
    said: list[str] = []
    monkeypatch.setattr(
        fields_file.logger, "warning", lambda text, *words: said.append(text % words)
    )
    march.drive(watch(march, path, resume=True), first_step=500)
    (sentence,) = said
    assert str(numbers) in sentence and "its snapshots now begin at t = 0.500 s" in sentence
    reader = pyvista.get_reader(path)
    np.testing.assert_allclose(reader.time_values, 0.05 * np.arange(10, 21), rtol=1e-12)


def test_a_full_disk_breaks_the_run_and_keeps_the_snapshots(
    tmp_path: Path, make_march: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    march, path = make_march(n_steps=1000), tmp_path / "fields.xdmf"
    watcher = watch(march, path)
    watcher.start(march.stage())
    for step in range(201):
        watcher.observe(march.view(step))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(fields_file, "write_at", full)
    with pytest.raises(RunBroken, match=r"fields.h5 failed at t = 0.400 s \(No space left"):
        for step in range(201, 500):
            watcher.observe(march.view(step))
    watcher.finish("the disk is full")
    assert pyvista.get_reader(path).time_values == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2])
