"""Runs, sweeps and results in Python, beside what the program writes of the same scenes."""

from __future__ import annotations

import copy
import gc
import json
import logging
import math
import os
import pickle
import signal
import tempfile
import threading
import time
import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from acting_scenes import SCENES
from program import SHORT_SCENE, catenary_started
from program import catenary as program
from scenes import with_words

import catenary
from catenary.cases.scene.input.case_files import parse_assignment
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.usefixtures("examined_here")

WALL = {"march_wall_s", "march_cpu_s", "records_wall_s", "phase_wall_s"}
WALL |= {"real_time_factor", "real_time_factor_with_records"}


def without_times(summary: dict[str, Any]) -> dict[str, Any]:
    """What two runs of a scene have in common."""
    return {key: value for key, value in summary.items() if key not in WALL}


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return with_words("en50318_2002", SHORT_SCENE)


@pytest.fixture(scope="module")
def in_memory(scene: catenary.Scene) -> catenary.Run:
    return catenary.run(scene)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same scene, run by the program."""
    out = tmp_path_factory.mktemp("program")
    words = ["run", "en50318_2002", "-o", str(out / "run"), "--set", *SHORT_SCENE]
    assert program(*words, cwd=out).code == 0
    return out / "run"


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of temporary files, which a test is to leave empty."""
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    yield place
    assert not list(place.iterdir())


def test_a_run_in_memory_has_the_figures_of_the_program(
    in_memory: catenary.Run, folder: Path
) -> None:
    """The same kernels on the same numbers: equal to the last bit."""
    written = json.loads((folder / "summary.json").read_text())
    assert without_times(in_memory.summary) == without_times(written)
    assert in_memory.passed is written["passed"]
    for table, rows in (("statistics", "pantographs"), ("verdict", "acceptance")):
        own = getattr(in_memory, table).reset_index()
        for name in written[rows][0]:
            expected = [row[name] for row in written[rows]]
            found = [None if pd.isna(value) else value for value in own[name]]
            assert found == expected, name


def test_an_opened_run_has_the_figures_of_its_summary(folder: Path) -> None:
    written = json.loads((folder / "summary.json").read_text())
    with catenary.open(folder) as run:
        assert run.summary == written
        assert run.folder == folder and run.outcome == "done"
    with catenary.open(folder / "run.h5") as run:
        assert run.folder == folder and str(folder) in repr(run)


def test_every_channel_is_that_of_the_file(in_memory: catenary.Run, folder: Path) -> None:
    with Results(folder) as results:
        names = set(in_memory.channels)
        energies = results.energies()
        assert {"contact_force", "arm_uplift", "dropper_force", "kinetic"} <= names
        for name in names:
            found = in_memory.channel(name)
            expected = energies[name] if name in energies else results.channel(name)
            assert np.array_equal(found, expected, equal_nan=True), name
            assert found.attrs["units"] and found.attrs["long_name"]
            assert found.coords["time"].attrs["units"] == "s"
        uplift, force = in_memory.channel("arm_uplift"), in_memory.channel("dropper_force")
        assert np.array_equal(uplift.steady_arm, results.line("arm_x"))
        assert np.array_equal(force.dropper, results.line("dropper_x"))
        assert np.array_equal(in_memory.force.position, results.channel("contact_position"))
        assert in_memory.channel("kinetic").dims == ("time",)
    with pytest.raises(catenary.InputError, match='no record "spam"; it has contact_position, '):
        in_memory.channel("spam")
    for wrong in (np.zeros(2), pd.DataFrame({"contact_force": [1]}), None):
        with pytest.raises(catenary.InputError, match="the run has no record"):
            in_memory.channel(wrong)  # type: ignore[arg-type]
        with pytest.raises(catenary.InputError, match="the run has no picture"):
            in_memory.plot(wrong)  # type: ignore[arg-type]


def test_thinned_records_have_times_of_their_own(scene: catenary.Scene) -> None:
    """Every tenth of the steps of 1 ms; beyond a window around the train nothing is recorded."""
    thinned = {"line_channels_every_s": 0.01, "line_channels_window_m": [60.0, 60.0]}
    run = catenary.run(scene.replace({"train.end_m": 245.0}, output=thinned))
    uplift, force = run.channel("arm_uplift"), run.force
    assert np.array_equal(uplift.time, force.time[::10])
    there = np.abs(uplift.steady_arm - force.position[::10, 0]) <= 55.0
    assert not uplift.where(there).isnull().where(there, False).any()
    assert bool(uplift.isnull().any()) and not run.uplift.largest.isnull().any()


def test_what_a_program_does_with_its_arrays_changes_no_run(scene: catenary.Scene) -> None:
    run = catenary.run(scene.replace({"train.end_m": 245.0}))
    tables = {"uplift": run.uplift, "droppers": run.droppers}
    tables |= {"force": run.force.to_dataset(), "filtered": run.filtered_force.to_dataset()}
    before = {name: table.copy(deep=True) for name, table in tables.items()}
    for table in tables.values():
        for name, array in table.variables.items():
            if name not in table.indexes and array.dtype.kind != "U":  # copies share an index
                array.values[...] = 0
    run.summary["pantographs"][0]["mean_N"] = run.summary["passed"] = None
    run.phase_wall.clear()
    assert run.uplift.identical(before["uplift"]) and run.droppers.identical(before["droppers"])
    assert run.force.to_dataset().identical(before["force"])
    assert run.filtered_force.to_dataset().identical(before["filtered"])
    assert run.statistics.mean_N.iloc[0] > 0 and run.passed is not None and run.phase_wall


def test_every_array_of_a_run_says_what_it_is(in_memory: catenary.Run) -> None:
    for table in (in_memory.uplift, in_memory.droppers):
        for name, array in table.data_vars.items():
            assert array.attrs["long_name"], name
            assert ("units" in array.attrs) == (array.dtype.kind == "f"), name
    assert in_memory.filtered_force.long_name == "contact force below 20 Hz"


def test_a_closed_run_says_so(in_memory: catenary.Run, folder: Path) -> None:
    run = catenary.open(folder)
    run.close()
    run.close()
    reads = (lambda: run.force, lambda: run.uplift, lambda: run.droppers, run.plot.force)
    for read in (*reads, lambda: run.channels, lambda: run.statistics):
        with pytest.raises(catenary.InputError, match="this run is closed"):
            read()
    assert run.outcome == "done" and run.scene["train.end_m"] == 260.0 and str(folder) in repr(run)


def test_a_run_that_no_name_holds_is_closed_at_once(folder: Path) -> None:
    """Its file can then be continued, and programs that make hundreds of runs do not grow."""
    gc.collect()
    gc.disable()  # which would come at some time or other
    try:
        run = catenary.open(folder)
        assert run.outcome == "done" and run.statistics.size and run.force.size and run.plot.names
        held = weakref.ref(run)
        del run
        assert held() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("kept", ["in memory", "in a folder"])
def test_processes_give_runs_to_each_other(
    kept: str, in_memory: catenary.Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As pools of ``multiprocessing`` and ``concurrent.futures`` do, and ``copy.deepcopy``."""
    monkeypatch.chdir(folder.parent)
    run = in_memory if kept == "in memory" else catenary.open(folder.name)
    given = pickle.dumps(run)
    monkeypatch.chdir("/")
    own = pickle.loads(given)
    assert np.array_equal(own.force, run.force) and own.droppers.identical(run.droppers)
    assert own.outcome == "done" and own.summary == run.summary
    assert (own.folder is None) == (kept == "in memory")
    run = copy.deepcopy(own)
    own.close()
    assert run.uplift.identical(in_memory.uplift) and run.plot.force().axes


def test_droppers_and_arms_are_those_of_the_summary(in_memory: catenary.Run) -> None:
    own, told = in_memory.droppers, in_memory.summary["droppers"]
    inside = own.where(own.evaluated, drop=True)
    assert float(inside.largest.max()) == told["max_force_N"]
    assert float(inside.smallest.min()) == told["min_force_N"]
    assert int(own.slackened[own.evaluated].sum()) == told["n_slackened"] > 0
    # Extremes are kept of every step, and every step is recorded.
    assert np.array_equal(own.force.max("time"), own.largest)
    assert np.array_equal(own.force[0], own.force_at_rest)
    assert set(own.span.values.tolist()) == set(range(1, 11))
    arms = in_memory.uplift
    assert np.array_equal(arms.uplift.max("time"), arms.largest)
    assert 1e3 * float(arms.largest[arms.evaluated].max()) == pytest.approx(
        in_memory.summary["supports"]["max_uplift_mm"], rel=1e-15
    )


def test_slack_droppers_have_no_negative_zero(in_memory: catenary.Run) -> None:
    force = in_memory.channel("dropper_force").values
    nothing = force[force == 0.0]
    assert nothing.size > 0 and not np.signbit(nothing).any()


def test_several_pantographs_strips_and_wires_have_names() -> None:
    table = SCENES["overlap"]
    words = [*table["set"]]
    run = catenary.run(with_words(table["case"], words))
    names = run.statistics.index.tolist()
    assert names == run.force.pantograph.values.tolist()
    of_wires = run.channel("contact_wire_force")
    total = of_wires.groupby("pantograph").sum()
    # Shares of a force of 1e2 N sum up to it within the round-off of a sum.
    for name in names:
        apart = np.abs(total.sel(pantograph=name) - run.force.sel(pantograph=name)).max()
        assert float(apart) < 1e-12 * float(run.force.max())


def test_wires_are_judged_as_they_hang(scene: catenary.Scene) -> None:
    """A contact wire that has lost half of its section, at nine tenths of its tension."""
    worn = {"type": "worn_wire", "wire": "contact_wire", "lost_share": 0.5}
    worn |= {"from_m": scene["evaluation.from_m"], "to_m": scene["evaluation.to_m"]}
    hanging = scene.replace(
        {
            "line.contact_wire.axial_stiffness_N": 18e6,
            "evaluation.rules": ["line"],
            "evaluation.limits.contact_wire_strain_um_per_m": 400.0,
            "evaluation.limits.contact_wire_tension_N": 19e3,
            "defects": [worn, {"type": "wrong_tension", "wire": "contact_wire", "factor": 0.9}],
        }
    )
    with catenary.run(hanging) as run:
        found = run.verdict.set_index("rule").value
        force = float((run.statistics.mean_N + 3 * run.statistics.std_N).max())
    tension = 0.9 * scene["line.contact_wire.tension_N"]
    assert found["contact_wire_tension"] == pytest.approx(tension, rel=1e-12)
    # EI of a half round is R^4 (pi / 8 - 8 / 9 pi) E; its top is 1 - 4 / 3 pi of R above its axis.
    bending = scene["line.contact_wire.bending_stiffness_N_m2"]
    half = bending * (math.pi / 8 - 8 / (9 * math.pi)) / (math.pi / 4)
    moving = 0.5 * scene["line.contact_wire.mass_kg_per_m"] * (scene["train.speed_km_h"] / 3.6) ** 2
    curvature = force / (2 * math.sqrt(half * (tension - moving)))
    top = (1 - 4 / (3 * math.pi)) * 2 * math.sqrt(bending / 18e6)
    assert found["contact_wire_strain"] == pytest.approx(1e6 * curvature * top, rel=1e-9)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("dc_twin", marks=pytest.mark.study),
        pytest.param("overlap", marks=pytest.mark.study),
        "tensioned_section",
    ],
)
def test_columns_at_one_place_are_told_apart_by_their_wires(name: str) -> None:
    """Two contact wires side by side have arms, droppers and ends at the same places."""
    table = SCENES[name]
    run = catenary.run(with_words(table["case"], table["set"]))
    labels = {
        "arm_uplift": ("steady_arm", "wire"),
        "dropper_force": ("dropper", "hangs_from", "carries"),
        "wire_end_tension": ("wire_end", "wire", "outwards"),
    }
    for channel in labels.keys() & {*run.channels}:
        array = run.channel(channel)
        own = [tuple(row) for row in zip(*(array[c].values for c in labels[channel]), strict=True)]
        assert len({*own}) == len(own), (channel, own)
    arms, hung = run.uplift, catenary.static(run.scene).steady_arms
    assert hung.wire.tolist() == arms.sortby("steady_arm").wire.values.tolist()
    assert arms.wire.values.tolist() == [
        row["wire"] for row in run.summary["supports"]["per_support"]
    ]
    assert np.array_equal(run.droppers.carries, run.channel("dropper_force").carries)
    if name == "tensioned_section":
        tension = run.channel("wire_end_tension").isel(time=0)
        for wire in ("contact_wire", "messenger_wire"):
            # Friction of the tensioner takes 3 %, the warmth at the mid-point less than 1 % more;
            # the tensions of the wires are 22 and 16 kN.
            nominal = run.scene[f"line.{wire}.tension_N"]
            own = tension.where(tension.wire == wire, drop=True)
            assert np.abs(own / nominal - 1.0).max() < 0.05, wire


def test_a_run_knows_its_scene(in_memory: catenary.Run, scene: catenary.Scene) -> None:
    assert in_memory.scene["train.end_m"] == scene["train.end_m"] == 260.0
    faster = in_memory.scene.replace(train={"speed_km_h": 255})
    assert faster["train.speed_km_h"] == 255.0
    with pytest.raises(catenary.InputError, match="in the scene of the run|in replace"):
        in_memory.scene.replace({"evaluation.to_m": 1e5})


def test_a_folder_is_written_as_the_program_writes_it(
    scene: catenary.Scene, folder: Path, tmp_path: Path
) -> None:
    """Pictures are not painted by the program of tests."""
    run = catenary.run(scene, tmp_path / "out")
    assert run.folder == tmp_path / "out"
    found = {path.name for path in (tmp_path / "out").iterdir() if path.suffix != ".png"}
    assert found == {path.name for path in folder.iterdir() if path.suffix != ".png"}
    assert (tmp_path / "out" / "contact_force.png").stat().st_size > 1000
    with pytest.raises(catenary.InputError, match="holds the results of an earlier run"):
        catenary.run(scene, tmp_path / "out")
    again = catenary.run(scene, str(tmp_path / "out"), force=True)
    assert np.array_equal(again.force, run.force)


def test_memory_holds_all_and_the_disk_nothing(scene: catenary.Scene, temporary: Path) -> None:
    run = catenary.run(scene.replace({"train.end_m": 245.0}))
    assert not list(temporary.iterdir())
    assert run.plot.force().axes and run.folder is None and "in memory" in repr(run)


def test_every_picture_that_is_named_can_be_drawn() -> None:
    """Also of a line whose arms have forces and whose wires do not move sideways."""
    scene = catenary.load("ambrosio2012", short=True)
    run = catenary.run(scene.replace({"train.end_m": scene["evaluation.to_m"] + 1.0}))
    assert run.plot.names
    for name in run.plot.names:
        assert run.plot(name).axes, name


def test_a_refused_scene_leaves_nothing(scene: catenary.Scene, temporary: Path) -> None:
    loose = {"line.dropper.pre_sag_mid_mm": 900.0, "case.accept_unusual": True}
    with pytest.raises(catenary.InputError, match="slack"):
        catenary.run(scene.replace(loose))


BREAKS = {
    "numerics.scheme": "fixed_point",
    "numerics.max_iterations": 2,
    "numerics.eps_d_m": 1e-12,
}


def test_a_run_that_breaks_says_so_and_has_what_it_recorded(
    scene: catenary.Scene, temporary: Path
) -> None:
    with pytest.raises(catenary.RunBroken, match="iterations") as broken:
        catenary.run(scene.replace(BREAKS))
    run = broken.value.run
    assert run.outcome == str(broken.value) and run.passed is None
    again = pickle.loads(pickle.dumps(broken.value))  # as a pool gives it to its program
    assert str(again) == str(broken.value) and np.array_equal(again.run.force, run.force)
    assert not list(temporary.iterdir())


def test_what_broke_is_continued_as_soon_as_no_run_reads_it(
    scene: catenary.Scene, tmp_path: Path
) -> None:
    """In a notebook the error stays, and holds its run."""
    with pytest.raises(catenary.RunBroken, match="iterations") as broken:
        catenary.run(scene.replace(BREAKS), tmp_path / "run", report=False)
    with pytest.raises(catenary.RunBroken, match="iterations"):  # and breaks at the same place
        catenary.restart(tmp_path / "run", report=False)
    run = broken.value.run
    assert run.force.sizes["time"] == 1
    with pytest.raises(catenary.InputError, match=r"is open in this program: close\(\) the run"):
        catenary.restart(tmp_path / "run", report=False)
    with pytest.raises(catenary.InputError, match="no picture of statistics. No statistics of"):
        run.plot.statistics()
    run.close()
    with pytest.raises(catenary.RunBroken, match="iterations"):  # its file stands for the folder
        catenary.restart(tmp_path / "run/run.h5", report=False)


@pytest.mark.parametrize("swept", [False, True])
def test_a_signal_ends_a_run_as_it_ends_python(
    swept: bool, scene: catenary.Scene, temporary: Path
) -> None:
    """Ctrl-C, sent once the march has begun, which takes it for its own until it ends."""
    from catenary.solver.time_loop.march import March

    begun, own = threading.Event(), March.run
    wait = threading.Thread(
        target=lambda: (begun.wait(60), time.sleep(0.05), os.kill(os.getpid(), signal.SIGINT))
    )

    def run(*args: Any, **kwargs: Any) -> Any:
        begun.set()
        return own(*args, **kwargs)

    before = signal.getsignal(signal.SIGINT)
    long = scene.replace({"line.n_spans": 400, "train.end_m": 20000.0})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(March, "run", run)
        wait.start()
        with pytest.raises(KeyboardInterrupt):
            if swept:
                catenary.sweep(long, {"contact.stiffness_N_per_m": [2e4, 5e4]})
            else:
                catenary.run(long)
    wait.join()
    assert signal.getsignal(signal.SIGINT) is before


def test_a_run_may_stand_in_a_thread(scene: catenary.Scene) -> None:
    """Only the first thread of a process may handle signals; another one leaves them alone."""
    found: list[catenary.Run] = []
    short = scene.replace({"train.end_m": 245.0})
    thread = threading.Thread(target=lambda: found.append(catenary.run(short)))
    thread.start()
    thread.join()
    assert found and found[0].outcome == "done"


def test_options_of_a_scene_are_those_of_its_run_alone(scene: catenary.Scene) -> None:
    from catenary.base.petsc import PETSc
    from catenary.cases.process.petsc_options import options_of

    PETSc.Options().setValue("ts_view_of_mine", "1")
    with options_of({"ts_view_of_mine": 2, "log_of_mine": True}) as words:
        assert words == ["-ts_view_of_mine", "2", "-log_of_mine"]
        inside = PETSc.Options().getAll()
        assert inside["ts_view_of_mine"] == "2" and "log_of_mine" in inside
    after = PETSc.Options().getAll()
    assert after["ts_view_of_mine"] == "1" and "log_of_mine" not in after
    PETSc.Options().delValue("ts_view_of_mine")


def test_progress_is_shown_where_it_is_asked_for(
    scene: catenary.Scene, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from catenary.postproc.record import progress

    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)
    monkeypatch.setattr(progress, "_LOOK_AT_LINES", 0.0)
    logger = logging.getLogger("catenary.progress")
    before = (logger.level, logger.propagate, list(logger.handlers))
    heard = logging.StreamHandler()  # of a program that hears all that is logged
    monkeypatch.setattr(logging.getLogger("catenary"), "handlers", [heard])
    monkeypatch.setattr(logging.getLogger("catenary"), "level", logging.INFO)
    catenary.run(scene)
    told = capfd.readouterr()
    assert told.out == "" and "march: " not in told.err
    catenary.run(scene, progress=True)
    told = capfd.readouterr()
    assert told.out == "" and "march: " in told.err and "left" in told.err
    assert (logger.level, logger.propagate, logger.handlers) == before


# --- sweeps -------------------------------------------------------------------------------------

VARIED = {"train.speed_km_h": [200, 250], "contact.stiffness_N_per_m": [2e4, 5e4]}


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sweep as the program makes it."""
    out = tmp_path_factory.mktemp("swept")
    vary = [
        word for key, own in VARIED.items()
        for word in ("--vary", f"{key}={','.join(map(str, own))}")
    ]  # fmt: skip
    done = program(
        "sweep", "en50318_2002", "-o", "here", *vary, "--set", *SHORT_SCENE, cwd=out
    )  # fmt: skip
    assert done.code == 0, done.stderr
    return out / "here"


@pytest.mark.study
def test_a_sweep_is_the_table_of_the_program(scene: catenary.Scene, swept: Path) -> None:
    table = catenary.sweep(scene, VARIED)
    expected = pd.DataFrame(json.loads((swept / "sweep.json").read_text())["rows"])
    drop = ["wall_s"]
    pd.testing.assert_frame_equal(
        table.drop(columns=drop), expected.drop(columns=drop), check_exact=True
    )


def test_a_sweep_into_a_folder_goes_on_where_the_program_was(
    scene: catenary.Scene, swept: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.stat().st_mtime_ns for path in swept.glob("*/run.h5")}
    catenary.sweep(scene, VARIED, swept, progress=True)
    assert capfd.readouterr().err.count("done already") == len(before) == 4
    assert {path: path.stat().st_mtime_ns for path in before} == before
    with pytest.raises(catenary.InputError, match="a sweep with other variants"):
        catenary.sweep(scene, {"train.speed_km_h": [200, 210]}, swept)


def test_a_variant_that_does_not_fit_is_told_in_its_row(scene: catenary.Scene) -> None:
    table = catenary.sweep(scene, {"train.end_m": [250.0, 590.0, 1e4]})
    assert table.outcome[0] == "done" and "train.end_m" in table.outcome[2]
    assert np.isnan(table.std_N[2]) and table["train.end_m"].tolist() == [250.0, 590.0, 1e4]


@pytest.mark.parametrize(
    ("vary", "says"),
    [
        ({}, "nothing to vary"),
        ({"train.speed_km_h": []}, "nothing to vary"),
        ({"train.speed_km_h": 200}, "train.speed_km_h in vary is 200; it must be a list of values"),
        ({"train.speed_km_h": "200"}, 'vary is "200"; it must be a list of values'),
        (["train.speed_km_h"], "it must be a table of lists"),
        ({3: [1, 2]}, "3 in vary is unknown"),
        ({"train.sped_km_h": [200]}, "train.sped_km_h in vary is unknown; did you mean"),
        ({"train.speed_km_h": [200, 200]}, "vary train.speed_km_h names 200 twice"),
        ({"petsc.ksp_type": ["cg"]}, "vary petsc.ksp_type is not possible"),
        ({"train.speed_km_h": [None]}, "must be a number"),
        ({"train.speed_km_h": [-1.0, -2.0]}, "must be at least 1"),
    ],
)
def test_what_cannot_be_varied_is_refused(
    vary: Any, says: str, scene: catenary.Scene, temporary: Path
) -> None:
    with pytest.raises(catenary.InputError, match=says):
        catenary.sweep(scene, vary)


def test_values_of_all_kinds_reach_their_scenes() -> None:
    from catenary.cases.studies.sweep.variants import text_of

    for value in (
        1,
        2.5,
        1e-7,
        True,
        "plain",
        "1",
        "true",
        "a, b",
        "",
        [1, "x", [2.0]],
        {"a": "1"},
    ):
        key, found = parse_assignment(f"key={text_of(value)}")
        assert (key, found) == ("key", value) and type(found) is type(value)


# --- pictures -----------------------------------------------------------------------------------


def test_threads_read_one_run_side_by_side(in_memory: catenary.Run) -> None:
    names = ("arm_uplift", "dropper_force", "contact_force", "head_height") * 4

    def sums(_: int) -> list[float]:
        return [float(in_memory.channel(name).sum()) for name in names]

    expected = sums(0)
    with ThreadPoolExecutor(8) as pool:
        assert all(found == expected for found in pool.map(sums, range(40)))


def test_pictures_are_those_of_the_report(in_memory: catenary.Run) -> None:
    plot = in_memory.plot
    made = {
        "contact_force": plot.force(),
        "histogram": plot.histogram(),
        "uplift": plot.uplift(),
        "droppers": plot.droppers(),
        "static": plot.at_rest(),
    }
    assert set(made) <= set(plot.names)
    # The report of one pantograph has them as a table.
    assert len(plot.statistics().axes[0].patches) == 6 and "statistics" not in plot.names
    labels = {name: [axes.get_ylabel() for axes in own.axes] for name, own in made.items()}
    for name, own in labels.items():
        assert own == [axes.get_ylabel() for axes in plot(name).axes]
    for figure in (*made.values(), plot.statistics()):  # what IPython asks for
        assert figure._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    force = made["contact_force"].axes[0]
    assert force.get_xlabel() == "position along the track [m]"
    assert len({str(own) for own in labels.values()}) == len(made)
    with pytest.raises(catenary.InputError, match='no picture "spam"; it has contact_force, '):
        plot("spam")


def test_a_run_that_goes_on_can_be_opened(tmp_path: Path) -> None:
    words = ["run", "en50318_2002", "-o", "out", "--set", *SHORT_SCENE, "line.n_spans=300"]
    with catenary_started(*words, "train.end_m=15000", cwd=tmp_path) as march:
        march.wait_for(lambda: (tmp_path / "out/run.h5").is_file())
        march.wait_for(lambda: _rows(tmp_path / "out") > 100)
        with catenary.open(tmp_path / "out") as run:
            assert run.outcome == "running" and run.passed is None
            assert run.force.sizes["time"] > 100
        march.send(signal.SIGTERM)
        march.end()


def _rows(folder: Path) -> int:
    from program import n_rows

    return n_rows(folder / "run.h5")
