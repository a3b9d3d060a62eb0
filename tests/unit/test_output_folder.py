"""The folder of a run's results, judged before anything is computed."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from catenary import InputError
from catenary.cases.result_folder import output_folder
from catenary.cases.result_folder.folder_lock import FolderLock
from catenary.cases.result_folder.output_folder import (
    MOST_BYTES,
    MOST_SECONDS,
    MOST_STEPS,
    RunSize,
    check_room_of_runs,
    check_room_to_continue,
    check_size,
    prepare,
    refuse_earlier,
    refuse_impossible,
)

SMALL = RunSize(1e6, 10.0, 2000)


@pytest.fixture
def plenty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_folder, "free_bytes", lambda folder: 1e15)


IMPOSSIBLE = {
    "too long": ("a" * 300, "File name too long.: choose a shorter name"),
    "too long in all": ("/".join(["b" * 200] * 25), "File name too long"),
    "in a loop": ("loop/out", "Too many levels of symbolic links.: links in its path"),
    "a loop": ("loop", "Too many levels of symbolic links"),
    "a dangling link": ("dangling", "dangling is a link that leads nowhere.: choose another"),
    "below a file": ("file/out", "file is no folder.: choose another"),
    "a file": ("file", "is a file; name a folder"),
    "below a file, deep": ("file/a/b/c", "file is no folder"),
}


@pytest.mark.parametrize("what", IMPOSSIBLE)
def test_a_folder_that_cannot_be_is_refused_in_true_words(what: str, tmp_path: Path) -> None:
    name, words = IMPOSSIBLE[what]
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "file").write_text("mine")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(InputError, match=words) as caught:
        refuse_impossible(tmp_path / name)
        FolderLock(tmp_path / name, "catenary run case")
    assert "space" not in str(caught.value)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(("flag", "words"), [(0, "Permission denied"), (1, "Read-only file sys")])
def test_a_read_only_disk_is_no_matter_of_permissions(
    flag: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *args: False)
    monkeypatch.setattr(os, "statvfs", lambda path: SimpleNamespace(f_flag=flag))
    with pytest.raises(InputError, match=words):
        refuse_impossible(tmp_path / "out")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no /proc")
def test_a_folder_where_the_system_makes_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be made or written to"):
        FolderLock(Path("/proc/x/y"), "catenary run case")


def test_the_longest_name_of_all_files_is_tried(tmp_path: Path) -> None:
    # A path that takes run.h5, and not the longest name while that file is made.
    deep, limit = tmp_path, os.pathconf(tmp_path, "PC_PATH_MAX")
    while len(str(deep)) < limit - 300:
        deep /= "c" * 200
    deep.mkdir(parents=True)
    deep /= "d" * (limit - len(str(deep)) - len("/run.h5") - 5)
    deep.mkdir()
    (deep / "run.h5").touch()
    (deep / "run.h5").unlink()
    with pytest.raises(InputError, match="File name too long"):
        prepare(deep, force=False)
    assert list(deep.iterdir()) == []


THERE = {
    "a result": (b"\x89HDF\r\n\x1a\n...", "holds the results of an earlier run.*replace them"),
    "another file": (b"mine", "is there already, and is no result file.*replace it"),
    "an empty file": (b"", "is there already, and is no result file"),
}


@pytest.mark.parametrize("what", THERE)
def test_what_is_there_is_called_what_it_is(what: str, tmp_path: Path) -> None:
    content, words = THERE[what]
    (tmp_path / "run.h5").write_bytes(content)
    with pytest.raises(InputError, match=words):
        refuse_earlier(tmp_path, force=False)
    refuse_earlier(tmp_path, force=True)


def test_links_and_folders_in_place_of_the_result(tmp_path: Path) -> None:
    (tmp_path / "run.h5").symlink_to("nowhere")
    with pytest.raises(InputError, match="is a link that leads nowhere"):
        refuse_earlier(tmp_path, force=False)
    refuse_earlier(tmp_path, force=True)
    (tmp_path / "run.h5").unlink()
    (tmp_path / "run.h5").mkdir()
    with pytest.raises(InputError, match=r"run\.h5 is a folder"):
        refuse_earlier(tmp_path, force=True)


def test_a_pipe_in_place_of_the_result_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "run.h5")
    with pytest.raises(InputError, match="is there already, and is no result file"):
        refuse_earlier(tmp_path, force=False)


LARGE = {
    "bytes": (RunSize(230e9, 60.0, 1000), "1000 steps take about 60 s and 230.0 GB in "),
    "steps": (RunSize(1e9, 600.0, 8_000_000), "8000000 steps take about 10 min and 1.0 GB in "),
    "hours": (RunSize(1e9, 30 * 3600.0, 1000), "1000 steps take about 30.0 h and 1.0 GB in "),
}


@pytest.mark.parametrize("what", LARGE)
def test_a_very_large_run_asks_for_force(
    what: str, tmp_path: Path, plenty: None, caplog: pytest.LogCaptureFixture
) -> None:
    size, words = LARGE[what]
    with pytest.raises(InputError, match="give force=True to run it all the same") as caught:
        check_size(tmp_path, size, force=False)
    assert words in str(caught.value) and "1000000.0 GB are free" in str(caught.value)
    with caplog.at_level(logging.INFO, logger="catenary.run"):
        check_size(tmp_path, size, force=True)
    assert words in caplog.text


def test_the_bounds_themselves_are_allowed(
    tmp_path: Path, plenty: None, caplog: pytest.LogCaptureFixture
) -> None:
    check_size(tmp_path, RunSize(MOST_BYTES, MOST_SECONDS, MOST_STEPS), force=False)
    caplog.clear()
    check_size(tmp_path, SMALL, force=False)
    assert caplog.text == ""


def test_needed_and_free_bytes_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_folder, "free_bytes", lambda folder: 0.5e6)
    with pytest.raises(InputError, match=r"about 10 s and 1\.0 MB in .* 0\.5 MB are free"):
        check_size(tmp_path, SMALL, force=False)
    check_size(tmp_path, SMALL, force=True)
    # A file that the run is to replace is room; one that a user keeps under a second name is not.
    (tmp_path / "run.h5").write_bytes(bytes(1_000_000))
    check_size(tmp_path, SMALL, force=False)
    (tmp_path / "kept.h5").hardlink_to(tmp_path / "run.h5")
    with pytest.raises(InputError, match="there is no room"):
        check_size(tmp_path, SMALL, force=False)


def test_the_files_of_a_run_that_is_continued_are_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes on in them, whatever other names they have."""
    monkeypatch.setattr(output_folder, "free_bytes", lambda folder: 0.5e6)
    with pytest.raises(InputError, match=r"0\.5 MB are free; free some space, or give force=True"):
        check_room_to_continue(tmp_path, SMALL, force=False)
    check_room_to_continue(tmp_path, SMALL, force=True)
    (tmp_path / "run.h5").write_bytes(bytes(1_000_000))
    (tmp_path / "kept.h5").hardlink_to(tmp_path / "run.h5")
    check_room_to_continue(tmp_path, SMALL, force=False)


def test_several_runs_need_room_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_folder, "free_bytes", lambda folder: 0.5e6)
    out, folders = tmp_path / "to be made", [tmp_path / "one", tmp_path / "other"]
    with pytest.raises(InputError, match=r"about 10 s and 1\.0 MB in .*to be made, where 0\.5 MB"):
        check_room_of_runs(out, folders, SMALL, force=False)
    check_room_of_runs(out, folders, SMALL, force=True)
    folders[0].mkdir()
    (folders[0] / "run.h5").write_bytes(bytes(1_000_000))
    check_room_of_runs(out, folders, SMALL, force=False)
