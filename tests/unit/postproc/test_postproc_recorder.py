"""The result file: round trip, resumed, killed, on a full disk, read while it is written."""

from __future__ import annotations

import errno
import fcntl
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from damaging import spoil_chunk

from catenary import InputError, RunBroken
from catenary.postproc.files import disk, result_file
from catenary.postproc.files.disk import NoRoom
from catenary.postproc.files.disk_errors import remedy
from catenary.postproc.files.hdf5 import FORMAT_BOUNDS, Damage, rows_before, shorten
from catenary.postproc.files.header import GZIP, Header, LineRecord
from catenary.postproc.files.run_schema import COMPLETE, RUNNING
from catenary.postproc.read.result_tables import opened
from catenary.postproc.read.results import Results
from catenary.postproc.record.progress import Progress
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.postproc.report.summary import real_time_factor
from catenary.solver.time_loop.ts_stepper import ObserverList
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import Observer

# --- the result file ------------------------------------------------------------------------------


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


FULL_DISK = f"""
import resource, runpy, sys
from pathlib import Path
names = runpy.run_path({str(CONFTEST)!r})
march = names["March"](n_steps=10**6)
watcher = names["Recorder"](march.comm, Path(sys.argv[1]), march.header(), flush_every=20)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
watcher.start(march.stage())
for step in range(10**6):
    watcher.observe(march.view(step))
"""


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


# --- rows that observers are shown many at once, against the same steps one by one ----------------


def drive_by_blocks(march: Any, *observers: Observer, first: int, most: int) -> list[int]:
    """As ``drive``, with as many steps at once as the observers need no states between.

    Returns the steps of each block.
    """
    stage, step, blocks, observer_list = (
        march.stage(first),
        first,
        [],
        ObserverList(observers, None),
    )
    observer_list.start(stage)
    observer_list.show(lambda: march.view(first))
    while step < march.n_steps:
        until = min(march.n_steps, step + most, observer_list.next_state(step))
        views = [march.view(number) for number in range(step + 1, until + 1)]
        rows = np.array([view.row for view in views])
        times = np.array([view.time for view in views])
        due = observer_list.next_motion(step)
        shown = [views[-1]]
        while due < until:
            shown.insert(-1, views[due - step - 1])
            due = observer_list.next_motion(due)
        observer_list.show_block(step, times, rows, shown)
        rows[:] = times[:] = np.nan  # they are overwritten
        blocks.append(len(views))
        step = until
    observer_list.finish("done")
    return blocks


def contents(path: Path) -> dict[str, bytes]:
    """Every dataset of a file, as bytes with its type and shape."""
    found: dict[str, bytes] = {}

    def take(name: str, place: Any) -> None:
        if isinstance(place, h5py.Dataset):
            found[name] = repr((place.dtype, place.shape, place.chunks)).encode()
            values = np.asarray(place[...])
            found[name] += repr(values).encode() if values.dtype == object else values.tobytes()

    with h5py.File(path) as file:
        file.visititems(take)
    return found


@pytest.mark.parametrize(
    ("flush_every", "energy_every", "record"),
    [
        (64, None, None),
        (50, 7, None),
        pytest.param(1, 3, None, marks=pytest.mark.study),
        (1000, 10, LineRecord(every=3)),
        (60, 25, LineRecord(every=4, window=(60.0, 40.0), compression=GZIP)),
        (77, None, LineRecord(stretch=(100.0, 300.0), names=("arm_uplift",))),
    ],
)
@pytest.mark.parametrize("first", [pytest.param(0, marks=pytest.mark.study), 31])
def test_a_file_written_by_blocks_is_the_same(
    tmp_path: Path,
    make_march: Any,
    flush_every: int,
    energy_every: int | None,
    record: LineRecord | None,
    first: int,
) -> None:
    march = make_march(n_steps=150)
    found = {}
    for way in ("steps", "blocks"):
        files, path = (tmp_path / way / name for name in ("fields.xdmf", "run.h5"))
        if first:
            # An earlier part, which is continued.
            begun = Recorder(
                march.comm, path, march.header(), flush_every=flush_every, record=record,
                energy_every=energy_every,
            )  # fmt: skip
            march.drive(begun, outcome="interrupted", last=first)
            begun.close()
        recorder = Recorder(
            march.comm, path, march.header(), flush_every=flush_every, record=record,
            energy_every=energy_every, resume=bool(first),
        )  # fmt: skip
        fields = FieldRecorder(march.comm, files, march.recorded, every=20, flush_every=flush_every)
        observers = fields, Progress(march.comm), recorder
        if way == "steps":
            march.drive(*observers, first_step=first)
        else:
            blocks = drive_by_blocks(march, *observers, first=first, most=40)
            assert max(blocks) == min(40, flush_every)
        recorder.close({"march_wall_s": 1.0})
        found[way] = contents(path), contents(files.with_suffix(".h5"))
    for one, other in zip(found["steps"], found["blocks"], strict=True):
        assert one.keys() == other.keys()
        assert [name for name in one if one[name] != other[name]] == []


def test_flushes_fall_on_the_same_steps(tmp_path: Path, make_march: Any) -> None:
    """What a killed run leaves does not depend on how its rows came."""
    march = make_march(n_steps=200)
    complete = []

    class Watched(Recorder):
        def _flush(self, view: Any) -> None:
            super()._flush(view)
            complete.append((None if view is None else view.step, self._last_time))

    for way in ("steps", "blocks"):
        recorder = Watched(march.comm, tmp_path / f"{way}.h5", march.header(), flush_every=64)
        if way == "steps":
            march.drive(recorder)
        else:
            drive_by_blocks(march, recorder, first=0, most=1000)
        recorder.close()
    half = len(complete) // 2
    assert complete[:half] == complete[half:]
    assert [step for step, _ in complete[:half]] == [0, 63, 127, 191, 200]


# --- A result file is read while its run goes on writing it ---------------------------------------


ROWS = 200
# What the run does after the file has been opened: so many chunks that HDF5 divides their index.
GOES_ON = """
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], "r+", libver=("v108", "v108"), locking=False) as file:
    file["time"].resize((20_000,))
    file["time"][:] = np.arange(20_000.0)
    file["complete_rows"][...] = 20_000
"""


def written(path: Path) -> Path:
    with h5py.File(path, "w", libver=FORMAT_BOUNDS) as file:
        file.attrs["outcome"] = RUNNING
        file.create_dataset("time", data=np.arange(float(ROWS)), maxshape=(None,), chunks=(8,))
        file[COMPLETE] = [ROWS, 0, 0]
    return path


def go_on(path: Path) -> None:
    subprocess.run([sys.executable, "-c", GOES_ON, str(path)], check=True, timeout=240)


@pytest.mark.process
def test_what_was_there_at_opening_is_read_after_the_run_has_gone_on(tmp_path: Path) -> None:
    path = written(tmp_path / "run.h5")
    with h5py.File(path, "r", locking=False) as file:
        go_on(path)
        with pytest.raises(OSError, match="overflow"):  # what this is for
            file["time"][:ROWS]
    path = written(tmp_path / "again.h5")
    file, complete = opened(path)
    go_on(path)
    with file:
        np.testing.assert_array_equal(file["time"][:ROWS], np.arange(float(ROWS)))
    assert complete is not None and complete[0][0] == ROWS


def test_a_file_that_is_damaged_for_good_is_opened_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        file[COMPLETE][...] = -1
    pauses: list[float] = []
    monkeypatch.setattr("time.sleep", pauses.append)
    file, complete = opened(path)
    assert complete is None and len(pauses) == 19
    file.close()


# --- writing on a file system without locks -------------------------------------------------------


# As LD_PRELOAD: a kernel without flock.
NO_FLOCK = "#include <errno.h>\nint flock(int fd, int op) { errno = ENOLCK; return -1; }\n"
WRITE = """
import sys
from pathlib import Path
from catenary.postproc.files.disk import opened
with opened(Path(sys.argv[1]), "w") as file:
    file["x"] = 3.0
with opened(Path(sys.argv[1]), "r+") as file:
    file["x"][...] = 2.0 * file["x"][()]
"""


@pytest.mark.process
def test_a_file_system_without_locks_is_written_to(tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("a C compiler makes the stand-in of such a file system")
    source, library = tmp_path / "no_flock.c", tmp_path / "no_flock.so"
    source.write_text(NO_FLOCK)
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source], check=True, timeout=240)
    subprocess.run(
        [sys.executable, "-c", WRITE, tmp_path / "written.h5"],
        env={"LD_PRELOAD": str(library), "PATH": ""},
        check=True, timeout=240,
    )  # fmt: skip
    with h5py.File(tmp_path / "written.h5") as file:
        assert file["x"][()] == 6.0


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_the_lock_alone_is_given_up(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In HDF5's words, which have the system's number in their text."""
    real = h5py.File

    def without_locks(path: Path, mode: str, locking: bool = True, **how: Any) -> h5py.File:
        if locking:
            raise OSError(f"Unable to create file (unable to lock file, errno = {number})")
        return real(path, mode, locking=locking, **how)

    monkeypatch.setattr(disk.h5py, "File", without_locks)
    disk.open_to_write(tmp_path / "a.h5", "w", libver=disk.FORMAT_BOUNDS).close()
    assert (tmp_path / "a.h5").exists()


def test_a_file_that_another_process_locks_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    h5py.File(path, "w").close()
    with open(path, "rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(OSError, match="lock"):
            disk.open_to_write(path, "r+")


def test_the_cure_is_named() -> None:
    """For who forces HDF5 to lock."""
    assert "HDF5_USE_FILE_LOCKING=FALSE" in remedy(OSError(errno.ENOLCK, "No locks available"))


# --- growing tables cut where a run goes on, with a chunk at their end that is damaged ------------


N, COLUMNS, CHUNK = 1050, 9, (100, 5)
PACKED: dict[str, Any] = {"compression": "gzip", "shuffle": True}


def made(path: Path, **filters: Any) -> np.ndarray:
    """A file with a table of ``N`` rows and its clock; returns the table."""
    values = np.random.default_rng(5).normal(size=(N, COLUMNS))
    known: dict[str, Any] = {"fletcher32": True, "fillvalue": np.nan, **filters}
    with h5py.File(path, "w", libver=FORMAT_BOUNDS) as file:
        file.create_dataset("table", data=values, chunks=CHUNK, maxshape=(None, COLUMNS), **known)
        file.create_dataset("time", data=np.arange(N), chunks=(100,), maxshape=(None,), **known)
    return values


@pytest.mark.parametrize("filters", [{}, PACKED])
@pytest.mark.parametrize("rows", [1049, 1050, 2000])
def test_a_damaged_end_is_lost_and_nothing_else(
    filters: dict[str, Any], rows: int, tmp_path: Path
) -> None:
    path = tmp_path / "file.h5"
    values = made(path, **filters)
    spoil_chunk(path, "table", (1000, 5))
    kept = min(rows, N)
    with h5py.File(path, "r+", libver=FORMAT_BOUNDS) as file:
        assert shorten(file, "table", rows) == kept - 1000
        file["table"].resize(1200, axis=0)
        file["table"][kept:] = 7.0
    expected = np.vstack([values[:kept], np.full((1200 - kept, COLUMNS), 7.0)])
    expected[1000:kept, 5:] = np.nan
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["table"][...], expected)


@pytest.mark.parametrize("rows", [0, 500, 1000])
def test_a_damaged_chunk_behind_the_cut_goes_with_it(rows: int, tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    values = made(path)
    spoil_chunk(path, "table", (1000, 0))
    with h5py.File(path, "r+", libver=FORMAT_BOUNDS) as file:
        assert shorten(file, "table", rows) == 0
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["table"][...], values[:rows])


def test_times_are_counted_and_not_guessed(tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    made(path)
    spoil_chunk(path, "time", (1000,))
    with h5py.File(path) as file:
        assert rows_before(file["time"], 1000, 998.5) == 999
        assert rows_before(file["time"], 1000, 5000.0) == 1000
        with pytest.raises(Damage, match="time is damaged"):
            rows_before(file["time"], N, 998.5)
