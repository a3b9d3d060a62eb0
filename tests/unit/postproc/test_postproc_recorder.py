"""The result file: round trip, resumed, killed and on a full disk."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary import InputError, RunBroken
from catenary.postproc.files import result_file
from catenary.postproc.files.disk import NoRoom
from catenary.postproc.files.header import Header
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.report.summary import real_time_factor
from catenary.solver.time_loop.views import channels

CONFTEST = Path(__file__).with_name("conftest.py")


def assert_true_to_march(results: Results, march: Any) -> None:
    """All channels hold what the march showed, at every recorded step."""
    steps = np.rint(results.time / march.dt).astype(int)
    np.testing.assert_array_equal(steps, np.arange(steps.size))
    for step in (0, 1, steps.size // 2, steps.size - 1):
        view = march.view(step)
        for name in filter(results.has, channels.CHANNELS):
            np.testing.assert_array_equal(results.channel(name)[step], getattr(view, name), name)


def test_round_trip_of_a_finished_run(run_folder: Path, march: Any) -> None:
    with Results(run_folder) as results:
        assert results.complete and results.n_steps == march.n_steps
        assert results.attributes["n_ranks"] == 1
        assert results.attributes["phase_wall_s"]["march"] == 5.1
        assert results.attributes["effects_off"][0][0] == "lateral"
        assert results.simulated == pytest.approx(8.0)
        assert_true_to_march(results, march)
        np.testing.assert_array_equal(results.line("node_points"), march.mesh.points)
        np.testing.assert_array_equal(results.line("dropper_span"), np.repeat(np.arange(16), 9))
        energies = results.energies()
        np.testing.assert_allclose(energies["time"], 0.1 * np.arange(81))
        np.testing.assert_array_equal(energies["kinetic"], 2.0 + np.sin(energies["time"]))
        state = results.checkpoint
        assert state["step"] == march.n_steps and state["kind"] == "made up"
        np.testing.assert_array_equal(state["state"], np.full(50, 8000.0))


def test_channels_carry_unit_and_meaning(run_folder: Path) -> None:
    with h5py.File(run_folder / "run.h5") as file:
        assert file.attrs["format"] == b"catenary-run-3"
        assert file.attrs["outcome"] == b"done"
        assert file["line_channels/dropper_force"].attrs["unit"] == b"N"
        assert b"tension" in file["line_channels/dropper_force"].attrs["meaning"]
        assert file["time"].attrs["unit"] == b"s"
        assert file["channels/contact_force"].shape == (8001, 2)


@pytest.mark.parametrize(
    "flush_every", [pytest.param(1, marks=pytest.mark.study), 7, 100, 101, 5000]
)
def test_every_flush_length_records_every_step(
    tmp_path: Path, make_march: Any, record_run: Any, flush_every: int
) -> None:
    march = make_march(n_steps=100)
    path = record_run(tmp_path / "run.h5", march, flush_every=flush_every)
    with Results(path) as results:
        assert results.n_steps == 100
        assert results.checkpoint["step"] == 100
        assert_true_to_march(results, march)


def test_an_interrupted_run_is_continued_in_its_file(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=300), tmp_path / "run.h5"
    first = Recorder(march.comm, path, march.header(), flush_every=40, energy_every=10)
    march.drive(first, outcome="interrupted", last=170)
    first.close()
    with Results(path) as results:
        assert results.outcome == "interrupted" and not results.complete
        assert results.checkpoint["step"] == 170
    second = Recorder(
        march.comm, path, march.header(), flush_every=40, energy_every=10, resume=True
    )
    march.drive(second, first_step=159)  # as from an older state: what follows it is replaced
    second.close({"march_wall_s": 1.5})
    with Results(path) as results:
        assert results.complete and results.n_steps == 300
        assert results.attributes["n_steps"] == 300
        assert results.simulated == pytest.approx(0.3)
        assert real_time_factor(results) == pytest.approx(0.141 / 1.5)  # of the last part
        assert_true_to_march(results, march)
        np.testing.assert_allclose(results.energies()["time"], 0.01 * np.arange(31))


def test_a_broken_run_keeps_its_last_good_state(tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=300), tmp_path / "run.h5"
    watcher = Recorder(march.comm, path, march.header(), flush_every=50)
    march.drive(watcher, outcome="no convergence at t = 0.120 s", last=119)
    watcher.close({})
    with Results(path) as results:
        assert results.outcome == "no convergence at t = 0.120 s"
        assert results.n_steps == 119
        assert results.checkpoint["step"] == 99


def test_a_line_without_arms_or_droppers_is_recorded(tmp_path: Path, make_march: Any) -> None:
    march = make_march(n_steps=30)
    march.arm_x = march.dropper_x = np.zeros(0)
    full = march.header()
    bare = {p: a[:0] if "dropper" in p or "arm_" in p else a for p, a in full.datasets.items()}
    header = Header(full.attributes, bare, full.facts)
    watcher = Recorder(march.comm, tmp_path / "run.h5", header, flush_every=8)
    march.drive(watcher)
    watcher.close()
    with Results(tmp_path) as results:
        assert results.channel("arm_uplift").shape == (31, 0)


def test_a_column_with_two_owners_is_refused(tmp_path: Path, make_march: Any) -> None:
    march = make_march()
    march.own = lambda count: np.zeros(count, dtype=int)
    with pytest.raises(ValueError, match="each must have one owner"):
        Recorder(march.comm, tmp_path / "run.h5", march.header()).start(march.stage())


def test_the_folder_of_the_result_file_is_made(tmp_path: Path, make_march: Any) -> None:
    march = make_march()
    watcher = Recorder(march.comm, tmp_path / "some" / "where" / "run.h5", march.header())
    watcher.start(march.stage())
    watcher.observe(march.view(0))
    watcher.finish("done")
    watcher.close()
    assert [path.name for path in (tmp_path / "some" / "where").iterdir()] == ["run.h5"]


def test_a_folder_that_cannot_be_made_breaks_the_run_with_a_sentence(
    tmp_path: Path, make_march: Any
) -> None:
    march = make_march()
    (tmp_path / "file").write_text("mine")
    watcher = Recorder(march.comm, tmp_path / "file" / "nowhere" / "run.h5", march.header())
    with pytest.raises(RunBroken, match="Not a directory"):
        watcher.start(march.stage())


MARCHING = f"""
import runpy, sys
from pathlib import Path
names = runpy.run_path({str(CONFTEST)!r})
march = names["March"](n_steps=10**6)
watcher = names["Recorder"](march.comm, Path(sys.argv[1]), march.header(), flush_every=20)
watcher.start(march.stage())
for step in range(10**6):
    watcher.observe(march.view(step))
    if step == 200:
        print("marching", flush=True)
"""


@pytest.mark.process
def test_a_killed_run_is_readable_up_to_its_last_flush(tmp_path: Path, make_march: Any) -> None:
    path = tmp_path / "run.h5"
    with subprocess.Popen(
        [sys.executable, "-c", MARCHING, str(path)], stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "marching\n"
        os.kill(program.pid, signal.SIGKILL)
    assert program.returncode == -signal.SIGKILL
    with Results(path) as results:
        assert results.outcome == "running" and not results.complete
        assert results.n_steps >= 199 and (results.n_steps + 1) % 20 == 0
        assert_true_to_march(results, make_march())
        state = results.checkpoint
        assert 179 <= state["step"] <= results.n_steps
        assert (state["state"] == state["step"]).all()


def test_rows_that_a_kill_left_unwritten_are_not_read(tmp_path: Path, make_march: Any) -> None:
    # HDF5 may have told that the tables got longer before it wrote what is in them.
    march, path = make_march(n_steps=300), tmp_path / "run.h5"
    known = {"flush_every": 40, "energy_every": 10}
    first = Recorder(march.comm, path, march.header(), **known)
    march.drive(first, outcome="interrupted", last=170)
    first.close()
    with h5py.File(path, "r+") as file:
        tables = [file["time"], *file["channels"].values(), *file["energy"].values()]
        tables += file["line_channels"].values()
        for table in tables:
            table.resize(table.shape[0] + 40, axis=0)
    with Results(path) as results:
        assert results.n_steps == 170
        assert_true_to_march(results, march)
        np.testing.assert_allclose(results.energies()["time"], 0.01 * np.arange(18))
    second = Recorder(march.comm, path, march.header(), resume=True, **known)
    march.drive(second, first_step=171)
    second.close()
    with Results(path) as results:
        assert results.n_steps == 300
        assert_true_to_march(results, march)
        np.testing.assert_allclose(results.energies()["time"], 0.01 * np.arange(31))


FULL_DISK = MARCHING.replace(
    "watcher.start",
    """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
watcher.start""",
)


@pytest.mark.process
@pytest.mark.parametrize(
    "room",
    [
        pytest.param(700_000, marks=pytest.mark.study),
        1_000_000,
        pytest.param(1_234_567, marks=pytest.mark.study),
    ],
)
@pytest.mark.parametrize("claim", ["system", "zeros"])
def test_a_full_disk_ends_the_run_with_a_sentence_and_keeps_the_record(
    tmp_path: Path, make_march: Any, room: int, claim: str
) -> None:
    path = tmp_path / "run.h5"
    script = FULL_DISK
    if claim == "zeros":  # as where the system cannot claim space
        script = "import os; del os.posix_fallocate\n" + script
    program = subprocess.run(
        [sys.executable, "-c", script, str(path), str(room)], capture_output=True, text=True
    )
    last = program.stderr.strip().splitlines()[-1]
    assert program.returncode == 1
    assert last.startswith(f"catenary.base.errors.RunBroken: writing {path} failed at t = ")
    assert "(File too large): raise the limit on the size of a file" in last
    with Results(path) as results:
        # Everything up to the step at which the run broke is there, and the file says why.
        assert results.outcome in last
        assert f"t = {results.time[-1]:.3f} s" in last
        assert results.n_steps >= 99
        assert_true_to_march(results, make_march())
        assert results.checkpoint["step"] == results.n_steps


def test_a_write_that_hdf5_itself_fails_to_do_breaks_the_run(
    tmp_path: Path, make_march: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    march, path = make_march(n_steps=100), tmp_path / "run.h5"
    watcher = Recorder(march.comm, path, march.header(), flush_every=10)
    watcher.start(march.stage())
    for step in range(15):
        watcher.observe(march.view(step))

    def fail(*_: object) -> None:
        raise RuntimeError("Unable to flush (file\n, errno = 27, error message = 'File too large')")

    monkeypatch.setattr(result_file.ResultFile, "_store", fail)
    with pytest.raises(RunBroken, match=r"t = 0.019 s \(File too large\)"):
        for step in range(15, 30):
            watcher.observe(march.view(step))
    watcher.finish("the disk is full")
    with Results(path) as results:
        assert results.n_steps == 19 and results.outcome == "running"
        assert results.checkpoint["step"] == 9
        assert_true_to_march(results, march)


def test_after_a_failed_write_finish_and_close_do_no_more_harm(
    tmp_path: Path, make_march: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    march = make_march(n_steps=100)
    watcher = Recorder(march.comm, tmp_path / "run.h5", march.header(), flush_every=10)
    watcher.start(march.stage())
    for step in range(15):
        watcher.observe(march.view(step))

    def full(*_: object) -> None:
        raise NoRoom(28, "No space left on device")

    monkeypatch.setattr(result_file, "reserve", full)
    with pytest.raises(RunBroken, match="No space left on device"):
        for step in range(15, 30):
            watcher.observe(march.view(step))
    watcher.finish("the disk is full")
    watcher.close({"march_wall_s": 1.0})
    with Results(tmp_path) as results:
        assert results.outcome.startswith("writing ")
        assert results.n_steps == 19


def test_only_result_files_are_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        Results(tmp_path)
    (tmp_path / "run.h5").write_text("no HDF5")
    with pytest.raises(InputError, match="cannot be read as HDF5"):
        Results(tmp_path)
    other = tmp_path / "other.h5"
    h5py.File(other, "w").close()
    with pytest.raises(InputError, match="is no result file"):
        Results(other)


def test_channels_of_unequal_length_are_cut_to_the_shortest(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    path = record_run(tmp_path / "run.h5", make_march(n_steps=50))
    with h5py.File(path, "r+") as file:
        file["channels/wire_height"].resize(31, axis=0)
    with Results(path) as results:
        assert results.n_steps == 30
        assert results.channel("contact_force").shape == (31, 2)
