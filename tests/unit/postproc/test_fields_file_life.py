"""Files of snapshots after each flush, after a kill, on a full disk."""

from __future__ import annotations

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
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.postproc.record.snapshots import fields_file
from catenary.postproc.record.snapshots.contents import MASTS, SIZES
from catenary.postproc.record.snapshots.fields_schema import read_fields, xdmf_of


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
