"""A channel is one row of a table: runs record, check and draw it without another edit.

Three rows are added here for the time of a test: of pantographs, from an array that steps keep up
to date, which a compiled loop copies; of droppers, from a function; and an energy.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from program import SHORT_SCENE
from scenes import load_scene

from catenary.cases.run.runner import run_case
from catenary.postproc.files.run_schema import FORMAT
from catenary.postproc.read.results import Results
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views import step_views
from catenary.solver.time_loop.views.channels import (
    CHANNELS,
    DROPPER,
    ENERGIES,
    PANTOGRAPH,
    RUN,
    Channel,
    Energies,
    Sources,
)

PLACE = Channel(
    "strip_place",
    "m",
    "place of the strip",
    PANTOGRAPH,
    lambda now: now.pantographs.candidates.place,
)


def slack(now: Sources) -> object:
    return lambda: (now.dropper_force <= 0.0).astype(float)


SLACK = Channel("slackness", "-", "1 where a dropper is slack", DROPPER, slack)  # type: ignore[arg-type]


def total(now: Energies) -> float:
    return now.kinetic + now.elastic


TOTAL = Channel("total", "J", "all energy of the line", RUN, energy=total)
SCENE = (*SHORT_SCENE, "train.end_m=155", "evaluation.from_m=140", "evaluation.to_m=150")


def run(out: Path, **options: bool) -> None:
    scene = load_scene("en50318_2002", [*SCENE, "output.field_every_s=0"])
    assert run_case(scene, out, MPI.COMM_SELF, **options).outcome == "done"


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run without further channels."""
    out = tmp_path_factory.mktemp("plain")
    run(out, only_summary=True)
    return out


@pytest.fixture
def blocks(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """For each march whether steps were taken in a compiled loop."""
    found: list[bool] = []
    make = time_loop.compiled_steps

    def watched(*arguments: object) -> object:
        loop = make(*arguments)  # type: ignore[arg-type]
        found.append(loop is not None)
        return loop

    monkeypatch.setattr(time_loop, "compiled_steps", watched)
    return found


def assert_the_rest_is_the_same(out: Path, plain: Path) -> None:
    with Results(out) as results, Results(plain) as before:
        for name in filter(before.has, set(CHANNELS) - {PLACE.name, SLACK.name}):
            np.testing.assert_array_equal(results.channel(name), before.channel(name))


def test_a_channel_of_pantographs_is_recorded_read_drawn_and_checked(
    tmp_path: Path, plain: Path, monkeypatch: pytest.MonkeyPatch, blocks: list[bool]
) -> None:
    monkeypatch.setitem(CHANNELS, PLACE.name, PLACE)
    run(tmp_path)
    assert blocks == [True]
    assert_the_rest_is_the_same(tmp_path, plain)
    with Results(tmp_path) as results:
        # The only strip stands where its pantograph is.
        place = results.channel("strip_place")
        np.testing.assert_array_equal(place, results.channel("contact_position"))
        assert np.ptp(place) == pytest.approx(35.0, abs=0.1)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        assert file.attrs["format"].decode() == FORMAT
        table = file["channels/strip_place"]
        assert (table.attrs["unit"], table.attrs["meaning"]) == (b"m", b"place of the strip")
        table[7] = np.nan
    with Results(tmp_path) as results:
        assert "channels/strip_place is damaged from record 7 on" in results.damage[0]
    assert (tmp_path / "channel_strip_place.png").stat().st_size > 5000
    assert "Place of the strip." in (tmp_path / "report.html").read_text()


@pytest.mark.study
def test_a_channel_of_droppers_may_be_a_function_of_the_step(
    tmp_path: Path, plain: Path, monkeypatch: pytest.MonkeyPatch, blocks: list[bool]
) -> None:
    """Steps are then taken one by one, with the same result."""
    monkeypatch.setitem(CHANNELS, SLACK.name, SLACK)
    run(tmp_path)
    assert blocks == [False]
    assert_the_rest_is_the_same(tmp_path, plain)
    with Results(tmp_path) as results:
        slackness = results.channel("slackness")
        np.testing.assert_array_equal(slackness, results.channel("dropper_force") <= 0.0)
        assert slackness.any() and not slackness.all()
        np.testing.assert_array_equal(results.extremes("slackness")[1], slackness.max(axis=0))
        assert results.line_record.names == ("arm_uplift", "dropper_force", "slackness")
    assert (tmp_path / "channel_slackness.png").stat().st_size > 5000


@pytest.mark.study
def test_an_energy_is_recorded_read_and_drawn(
    tmp_path: Path, plain: Path, monkeypatch: pytest.MonkeyPatch, blocks: list[bool]
) -> None:
    monkeypatch.setitem(ENERGIES, TOTAL.name, TOTAL)
    run(tmp_path)
    assert blocks == [True]
    with Results(tmp_path) as results, Results(plain) as before:
        found = results.energies()
        np.testing.assert_array_equal(found["total"], found["kinetic"] + found["elastic"])
        # A file that was written without it lacks nothing.
        assert "total" not in before.energies() and before.damage == []
    assert (tmp_path / "channel_total.png").stat().st_size > 5000


def layout_of(array: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> step_views.RowLayout:
    """Of a row with one channel more than four numbers that are shown anyway, two of them its."""
    shown = np.arange(4.0)
    channels = (
        Channel("two", "m", "in what is shown", DROPPER, lambda now: now.dropper_force),
        Channel("more", "m", "from elsewhere", DROPPER, lambda now: array),
    )
    monkeypatch.setattr(step_views, "CHANNELS", {channel.name: channel for channel in channels})
    none = SimpleNamespace(outputs=np.zeros(0))
    sources = Sources(none, none, none, shown[:2], shown[2:], {})  # type: ignore[arg-type]
    return step_views.RowLayout(sources, shown)


def test_a_row_ends_with_what_stands_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    array = np.array([7.0, 8.0, 9.0])
    layout = layout_of(array, monkeypatch)
    assert layout.columns == {"two": slice(2, 4), "more": slice(4, 7)}
    assert layout.width == 7 and layout.in_loop
    assert len(layout.copied) == 1 and np.shares_memory(layout.copied[0], array)
    row = np.zeros(7)
    array += 1.0
    layout.fill(row)
    assert row.tolist() == [0.0, 0.0, 0.0, 0.0, 8.0, 9.0, 10.0]


@pytest.mark.parametrize("array", [np.zeros(6)[::2], np.zeros(3, dtype=int)])
def test_a_channel_that_a_loop_cannot_copy_is_refused(
    array: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ValueError, match="values of channel more are no contiguous doubles"):
        layout_of(array, monkeypatch)
