"""How a result file comes, takes the place of another, and what happens when it is taken away."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import h5py
import pytest

from catenary import RunBroken
from catenary.base.files import part_of
from catenary.postproc.files.disk import broken_write
from catenary.postproc.files.disk_errors import reason, remedy
from catenary.postproc.files.own_files import (
    OWN_FILES,
    PICTURES,
    REPORT_FILES,
    remove_parts,
    remove_stale,
)
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.solver.time_loop.views.channels import CHANNELS, TrainLayout


def recorder(march: Any, path: Path, **options: Any) -> Recorder:
    return Recorder(march.comm, path, march.header(), flush_every=20, **options)


def show(watcher: Any, march: Any, first: int, last: int) -> None:
    for step in range(first, last + 1):
        watcher.observe(march.view(step))


def test_an_earlier_file_stays_until_the_first_step_is_written(
    tmp_path: Path, make_march: Any
) -> None:
    march, path = make_march(n_steps=60), tmp_path / "run.h5"
    path.write_text("the earlier run")
    watcher = recorder(march, path)
    watcher.start(march.stage())
    assert path.read_text() == "the earlier run" and not watcher.begun
    watcher.observe(march.view(0))
    assert watcher.begun
    assert path.read_bytes().startswith(b"\x89HDF")
    show(watcher, march, 1, 60)
    watcher.finish("done")
    watcher.close()
    assert [one.name for one in tmp_path.iterdir()] == ["run.h5"]


@pytest.mark.parametrize("how", ["stopped", "broken"])
def test_a_run_without_a_step_leaves_the_earlier_file(
    how: str, tmp_path: Path, make_march: Any
) -> None:
    march, path = make_march(n_steps=60), tmp_path / "run.h5"
    path.write_text("the earlier run")
    if how == "stopped":
        watcher = recorder(march, path)
        watcher.start(march.stage())
        watcher.finish("the first step failed")
        watcher.close()
    else:

        def fail() -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        watcher = recorder(march, path)
        watcher.start(march.stage())
        watcher._open_file.append = lambda blocks, line, state: fail()  # type: ignore[method-assign]
        with pytest.raises(RunBroken, match="nothing was written, and results of an earlier run"):
            watcher.observe(march.view(0))
    assert not watcher.begun
    assert path.read_text() == "the earlier run"
    assert [one.name for one in tmp_path.iterdir()] == ["run.h5"]


@pytest.mark.parametrize("target", ["a file", "nothing", "itself"])
def test_a_link_is_replaced_and_not_followed(target: str, tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=40), tmp_path / "out" / "run.h5"
    path.parent.mkdir()
    mine = tmp_path / "mine.h5"
    if target == "a file":
        mine.write_text("mine")
    path.symlink_to(path if target == "itself" else mine)
    watcher = recorder(march, path)
    march.drive(watcher)
    watcher.close()
    assert not path.is_symlink()
    with Results(path) as results:
        assert results.complete
    assert mine.read_text() == "mine" if target == "a file" else not mine.exists()


TAKEN = {
    "replaced": "was replaced by another file while the run went on",
    "removed": "run.h5 was removed while the run went on",
    "folder removed": "the folder .*out was removed while the run went on",
    "cut": "another program has cut .*run.h5 to 1000 bytes while the run went on",
    "folder moved": "`catenary restart .*elsewhere` continues the run",
}


@pytest.mark.parametrize("how", TAKEN)
def test_a_file_that_is_taken_away_ends_the_run(how: str, tmp_path: Path, make_march: Any) -> None:
    march, path = make_march(n_steps=200), tmp_path / "out" / "run.h5"
    watcher = recorder(march, path)
    watcher.start(march.stage())
    show(watcher, march, 0, 50)
    if how == "replaced":
        (tmp_path / "mine").write_text("mine")
        os.replace(tmp_path / "mine", path)
    elif how == "cut":
        os.truncate(path, 1000)
    elif how == "folder moved":
        path.parent.rename(tmp_path / "elsewhere")
    else:
        path.unlink()
        if how == "folder removed":
            path.parent.rmdir()
    with pytest.raises(RunBroken, match=TAKEN[how]) as caught:
        show(watcher, march, 51, 200)
    watcher.finish(str(caught.value))
    watcher.close()
    assert "ended at t = 0.059 s" in str(caught.value)
    if how == "replaced":  # not a byte longer
        assert path.read_text() == "mine"
    elif how == "cut":  # HDF5 crashed here at the end, and nothing was said before
        assert path.stat().st_size == 1000
    elif how == "folder moved":
        with Results(tmp_path / "elsewhere") as results:
            assert results.outcome == str(caught.value)
            assert results.n_steps == 59 == results.checkpoint["step"]
    else:
        assert list(tmp_path.glob("out/*")) == []


def test_snapshots_that_are_cut_end_the_run(tmp_path: Path, make_march: Any) -> None:
    march = make_march(n_steps=40)
    path = tmp_path / "fields.xdmf"
    watcher = FieldRecorder(march.comm, path, march.recorded, every=10, flush_every=10)
    watcher.start(march.stage())
    show(watcher, march, 0, 10)
    os.truncate(tmp_path / "fields.h5", 0)
    with pytest.raises(RunBroken, match="another program has cut .*fields.h5 to 0 bytes"):
        show(watcher, march, 11, 40)


def test_snapshots_wait_for_the_result_file(tmp_path: Path, make_march: Any) -> None:
    march = make_march(n_steps=40)
    for name in ("fields.h5", "fields.xdmf"):
        (tmp_path / name).write_text("earlier")
    watcher = FieldRecorder(
        march.comm,
        tmp_path / "fields.xdmf",
        march.recorded,
        every=10,
        flush_every=10,
        wait=True,
    )
    watcher.start(march.stage())
    show(watcher, march, 0, 10)
    assert (tmp_path / "fields.h5").read_text() == "earlier"
    assert (tmp_path / "fields.xdmf").read_text() == "earlier"
    watcher.publish()
    show(watcher, march, 11, 40)
    watcher.finish("done")
    assert (tmp_path / "fields.xdmf").read_text().count("<Time ") == 5 * 5  # blocks
    with h5py.File(tmp_path / "fields.h5") as file:
        assert file["contact_wire/uplift"].size == 5 * len(march.mesh.wires["contact_wire"])
    assert sorted(one.name for one in tmp_path.iterdir()) == ["fields.h5", "fields.xdmf"]


def test_what_is_stale_goes_and_what_is_a_users_stays(tmp_path: Path) -> None:
    mine = ["notes.txt", "run.h5.bak", "contact_force.pdf", ".hidden.part", ".notes.txt.17.part"]
    parts = [part_of(tmp_path / name, 17).name for name in ("run.h5", "fields.h5", "report.html")]
    for name in (*OWN_FILES, *mine, *parts):
        (tmp_path / name).write_text("x")
    old = tmp_path / parts[2]
    os.utime(old, (0, 0))
    remove_stale(tmp_path)
    remove_parts(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"run.h5", *mine}


@pytest.mark.usefixtures("quick_report")
def test_a_reports_files_are_all_declared(tmp_path: Path, make_march: Any, record_run: Any) -> None:
    from catenary.postproc.report.report import write_report

    path = record_run(tmp_path / "run.h5", make_march(), energy_every=20)
    written = {one.name for one in write_report(path, tmp_path).files}
    assert written <= set(REPORT_FILES)
    # All else is declared because other runs have it.
    missing = {
        f"channel_{name}" for name, one in CHANNELS.items() if not one.when(TrainLayout((1,)))
    }
    missing |= {"strip_forces", "wire_forces", "lateral_place", "plan_view", "worst_support"}
    for section in ("spectrum", "waves", "worst", "line", "pantographs"):
        missing |= set(PICTURES[section])
    drawn = {name for name in REPORT_FILES if name.endswith(".png")}
    assert drawn - written <= {f"{name}.png" for name in missing}


@pytest.mark.usefixtures("quick_report")
def test_an_earlier_reports_files_go_and_a_users_stay(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    from catenary.postproc.report.report import write_report

    path = record_run(tmp_path / "run.h5", make_march(n_steps=300))
    mine = {"run.h5", "input.toml", "variant.json", "notes.pdf", "worst_supports.csv"}
    for name in (*mine - {"run.h5"}, *REPORT_FILES):
        (tmp_path / name).write_text("x")
    written = {one.name for one in write_report(path, tmp_path, vector=True).files}
    assert {"uplift.svg", "report.html"} <= written
    assert {one.name for one in tmp_path.iterdir()} == mine | written


def test_a_report_that_cannot_be_written_is_a_sentence(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    from catenary.postproc.report.report import write_report, write_summary

    path = record_run(tmp_path / "run.h5", make_march(n_steps=300))
    (tmp_path / "summary.json").mkdir()
    for write in (write_report, write_summary):
        with pytest.raises(RunBroken, match="summary.json failed .Is a directory"):
            write(path, tmp_path)
        with pytest.raises(RunBroken, match="failed .No such file or directory"):
            write(path, tmp_path / "gone")
    assert not (tmp_path / "gone").exists()


def test_room_is_asked_for_only_where_it_is_short() -> None:
    for code in (errno.ENOSPC, errno.EDQUOT):
        assert "free some space" in remedy(OSError(code, ""))
    others = (errno.EACCES, errno.EROFS, errno.ELOOP, errno.ENAMETOOLONG, errno.ENOENT)
    others += (errno.EFBIG, errno.EAGAIN, errno.EISDIR, errno.EIO, errno.EPIPE)
    for code in others:
        told = str(broken_write(Path("run.h5"), 0.5, OSError(code, "")))
        assert os.strerror(code) in told and "free some space" not in told
    hidden = RuntimeError("Can't write (errno = 28, error message = 'No space left on device')")
    assert reason(hidden) == "No space left on device"
    assert "free some space" in remedy(hidden)


def test_the_reason_of_a_failure_is_found_in_the_words_of_a_program() -> None:
    said = OSError("[vost#1:0/gif @ 0x55] Error submitting a packet: No space left on device")
    assert reason(said) == "No space left on device" and remedy(said).startswith("free some space")
    assert reason(OSError("ffmpeg ended")) == "ffmpeg ended"
    assert "ulimit -n" in remedy(OSError(errno.EMFILE, "Too many open files"))
