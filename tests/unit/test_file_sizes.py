"""What a run records by its scene, and the sizes of its files: told before, true within 20 %."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import typer
from mpi4py import MPI
from scenes import Scene, load_scene, mesh_of, with_words

import catenary
from catenary import InputError, RunBroken
from catenary.base.parallel import on_root
from catenary.cases.run.needs import Kept, needs_before_meshing, needs_with_mesh, total_size
from catenary.cases.run.runner import run_case
from catenary.cases.scene.checks.mesh_size import estimate_memory
from catenary.cases.terminal import console
from catenary.postproc.files.header import GZIP
from catenary.postproc.read.results import Results

# 0.45 s on a line of 22 spans.
SHORT = (
    "train.start_m=300",
    "train.raise_time_s=0.05",
    "evaluation.from_m=310",
    "evaluation.to_m=325",
    "train.end_m=331",
    "mesh.elements_per_gap=4",
)
THINNED = (
    "output.line_channels_every_s=0.005",
    "output.line_channels_window_m=[100, 50]",
    "output.line_channels_compression=gzip",
)
SCENES = {
    "short": SHORT,
    "shorter than a flush": (*SHORT, "output.field_every_s=0", "output.energy_every_s=0"),
    "many short flushes": (*SHORT, "output.flush_every_steps=64"),
    "fine steps": (*SHORT, "numerics.dt_s=1e-4", "output.field_every_s=0.01"),
    "thinned": (*SHORT, *THINNED, "numerics.dt_s=2e-4"),
    "spans": (*SHORT, "output.line_channels_spans=[5, 8]", "numerics.dt_s=2e-4"),
    "no line channels": (*SHORT, "output.line_channels=[]", "numerics.dt_s=2e-4"),
}


def scene_of(*overrides: str, case: str = "en50318_2002") -> Scene:
    return load_scene(case, list(overrides))


@pytest.mark.parametrize("name", SCENES)
def test_the_plan_tells_the_sizes_of_the_files(name: str, tmp_path: Path) -> None:
    scene = scene_of(*SCENES[name])
    told = catenary.plan(with_words("en50318_2002", SCENES[name])).figures
    run_case(scene, tmp_path, MPI.COMM_SELF, only_summary=True)
    result = (tmp_path / "run.h5").stat().st_size
    film = sum(path.stat().st_size for path in tmp_path.glob("fields.*"))
    print(f"run.h5 {result} B, told {told.result_B / result:.3f} of it")
    assert told.result_B == pytest.approx(result, rel=0.2)
    if film:
        print(f"film {film} B, told {told.film_B / film:.3f} of it")
    assert told.film_B == pytest.approx(film, rel=0.2)


def test_a_scene_chooses_what_is_recorded_of_the_line(tmp_path: Path) -> None:
    scene = scene_of(*SHORT, *THINNED, "output.line_channels_spans=[5, 8]")
    run_case(scene, tmp_path, MPI.COMM_SELF, only_summary=True)
    with Results(tmp_path) as results:
        record = results.line_record
        assert (record.every, record.window, record.compression) == (5, (100.0, 50.0), GZIP)
        masts, x = results.line("support_x"), results.line("dropper_x")
        columns = results.recorded_columns("dropper_force")
        assert x[columns].min() > masts[4] and x[columns].max() < masts[8]
        assert columns.size == 4 * 9


def test_cadence_in_travel_is_that_in_time_over_the_speed() -> None:
    # 0.5 m at 250 km/h are 7.2 ms.
    told = catenary.plan(with_words("en50318_2002", ["output.line_channels_every_m=0.5"]))
    assert "dropper forces recorded every 7 ms" in str(told)


LONG = ("line.n_spans=200", "evaluation.to_m=10000")


def test_long_lines_are_thinned_by_their_size() -> None:
    """200 spans that the train runs, 2 GB of line channels if all were recorded."""
    thinned = catenary.plan(with_words("ambrosio2012", LONG))
    text = str(thinned)
    assert "every 5 ms within 300 m behind and 200 m ahead of the train" in text
    assert "a snapshot of the line every" in text and text.count("(chosen by size)") == 2
    often = ["output.line_channels_every_s=0", "output.field_every_s=0.05"]
    whole = catenary.plan(with_words("ambrosio2012", [*LONG, *often]))
    assert "dropper forces recorded at every step" in str(whole)
    assert whole.figures["result_B"] > 1.5e9 > 30 * thinned.figures["result_B"]
    assert thinned.figures["film_B"] < 510e6 < whole.figures["film_B"]


def test_short_lines_are_recorded_whole() -> None:
    told = str(catenary.plan("en50318_2002"))
    assert "arm uplift and dropper forces recorded at every step" in told


@pytest.mark.parametrize(
    ("override", "told"),
    [
        ("output.line_channels_spans=[5, 90]", "the line has the spans 1 to 22"),
        ("output.line_channels_spans=[8, 5]", "from a span to a later one"),
        ("output.line_channels_spans=[0, 5]", "at least 1"),
        ("output.line_channels_window_m=[100]", "line_channels_window_m"),
        ("output.line_channels_window_m=[-1, 5]", "at least 0"),
        ('output.line_channels=["force"]', "arm_uplift"),
        ("output.line_channels_compression=zip", "gzip"),
    ],
)
def test_what_cannot_be_recorded_is_refused_with_its_key(override: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        scene_of(override)
    assert told in str(caught.value) and "output" in str(caught.value)


def test_two_cadences_are_refused() -> None:
    with pytest.raises(InputError, match="both are given"):
        scene_of("output.line_channels_every_s=0.01", "output.line_channels_every_m=1")


def test_the_estimate_of_memory_grows_with_the_steps_too() -> None:
    assert estimate_memory(10_000, 8_000_000) > estimate_memory(10_000) + 2e8


def test_too_little_memory_ends_in_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    def greedy() -> None:
        np.empty(1 << 60, dtype=np.uint8)

    with pytest.raises(typer.Exit) as ended:
        console.guarded(greedy)()
    assert ended.value.exit_code == console.BROKEN
    assert "not enough memory" in capsys.readouterr().err
    with pytest.raises(RunBroken, match="not enough memory"):
        on_root(MPI.COMM_SELF, greedy)


@pytest.mark.parametrize("case", ["ac_simple", "ambrosio2012", "en50318_2002"])
@pytest.mark.parametrize("more", [(), ("mesh.elements_per_gap=3", "mesh.support_refinement=2")])
def test_what_a_run_needs_is_known_before_it_is_meshed(case: str, more: tuple[str, ...]) -> None:
    scene = scene_of(*more, case=case)
    before = needs_before_meshing(scene)
    meshed = needs_with_mesh(scene, mesh_of(scene))
    assert before is not None
    assert before.n_steps == meshed.n_steps > 1000
    assert (before.memory, before.march, before.files) == (
        meshed.memory,
        meshed.march,
        meshed.files,
    )
    assert before.recording.extent.n_cells == meshed.recording.extent.n_cells
    assert np.allclose(before.recording.extent.dropper_x, meshed.recording.extent.dropper_x)
    assert np.allclose(before.recording.extent.arm_x, meshed.recording.extent.arm_x)


def test_the_size_of_a_large_run_is_told_before_the_mesh_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mesh of a thousand spans takes seconds."""

    def no_mesh(scene: Scene) -> None:
        raise AssertionError("meshed")

    monkeypatch.setattr("catenary.cases.run.runner.mesh_of", no_mesh)
    with pytest.raises(InputError, match="the run is very large"):
        run_case(scene_of("numerics.dt_s=1e-6"), tmp_path, MPI.COMM_SELF)
    assert list(tmp_path.iterdir()) == []


def test_several_runs_take_what_stays_of_them_and_the_largest_of_the_rest() -> None:
    scene = scene_of(*SHORT)
    one = needs_before_meshing(scene)
    assert one is not None
    kept, reported, passing = (
        Kept(scene, True, False),
        Kept(scene, True, True),
        Kept(scene, False, False),
    )
    total = total_size([kept, reported, passing, passing])
    files = one.files
    assert total.n_bytes == 3 * files.result + 4 * files.film + files.report
    assert total.n_steps == 4 * one.n_steps
    assert total.seconds == pytest.approx(4 * one.march)
