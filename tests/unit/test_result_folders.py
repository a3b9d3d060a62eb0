"""The folder of a run's results: judged before anything is computed, locked, or out of reach."""

from __future__ import annotations

import dataclasses
import json
import logging
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from program import ENTRY
from verb_runner import invoke

from catenary import InputError
from catenary import open as open_run
from catenary.base import files
from catenary.cases.result_folder import folder_lock, output_folder
from catenary.cases.result_folder.folder_lock import (
    JOBS_ENDED,
    LOCK_FILE,
    FolderLock,
    Owner,
    myself,
    read_owner,
)
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
    run_folder,
)
from catenary.postproc.files.disk import write_all

# --- the folder of a run's results, judged before anything is computed ----------------------------


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


# --- the lock of a result folder ------------------------------------------------------------------


HOLD = """
import sys
from pathlib import Path
from catenary.cases.result_folder.folder_lock import FolderLock
lock = FolderLock(Path(sys.argv[1]), "catenary run other")
print("held", flush=True)
sys.stdin.read()
"""


def left_by(folder: Path, **changed: object) -> Path:
    """A lock file of a process that has some facts different from this one's."""
    folder.mkdir(exist_ok=True)
    path = folder / LOCK_FILE
    path.write_text(dataclasses.replace(myself("catenary run case"), **changed).text())
    return path


LOST_NODE = {"host": "node7", "machine": "m", "boot": "b", "space": "s", "job": "41.0"}


@pytest.mark.parametrize(
    ("variables", "taken"),
    [
        ({}, False),
        ({"SLURM_JOB_ID": "42"}, False),
        ({"SLURM_JOB_ID": "41"}, False),
        ({"SLURM_JOB_ID": "42", JOBS_ENDED: " 40 410"}, False),
        ({"SLURM_JOB_ID": "42", JOBS_ENDED: " 40 41"}, True),
        ({"SLURM_JOB_ID": "41", "SLURM_RESTART_COUNT": "1"}, True),
    ],
)
def test_jobs_take_over_what_ended_jobs_left_on_other_nodes(
    variables: dict[str, str], taken: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("SLURM_JOB_ID", "SLURM_RESTART_COUNT", JOBS_ENDED):
        monkeypatch.delenv(name, raising=False)
    lock = left_by(tmp_path / "out", **LOST_NODE)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    if taken:
        held = FolderLock(lock.parent, "catenary restart")
        owner = read_owner(lock.read_text())
        assert owner is not None and owner.pid == os.getpid()
        assert owner.job == f"{variables['SLURM_JOB_ID']}.{variables.get('SLURM_RESTART_COUNT', 0)}"
        held.release()
    else:
        with pytest.raises(InputError, match="in use by process"):
            FolderLock(lock.parent, "catenary restart")


@pytest.mark.parametrize("job", ["41", "41.x", "41.0.0", "41.0\n", "."])
def test_a_lock_with_no_number_of_a_job_names_no_process(job: str) -> None:
    assert read_owner(dataclasses.replace(myself("catenary run"), job=job).text()) is None


@pytest.mark.parametrize("kind", ["pipe", "link", "folder"])
def test_what_is_no_lock_is_neither_read_nor_followed(kind: str, tmp_path: Path) -> None:
    """Whoever opens a pipe and reads waits until somebody writes."""
    lock, other = tmp_path / "out" / LOCK_FILE, tmp_path / "other"
    lock.parent.mkdir()
    other.write_text("mine")
    {
        "pipe": lambda: os.mkfifo(lock),
        "link": lambda: lock.symlink_to(other),
        "folder": lock.mkdir,
    }[kind]()
    with pytest.raises(InputError, match=r"\.catenary\.lock is a link, a pipe or a folder"):
        FolderLock(lock.parent, "catenary restart")
    assert other.read_text() == "mine" and names(lock.parent) == [LOCK_FILE]


def test_a_link_in_place_of_the_file_that_becomes_the_lock_is_not_followed(tmp_path: Path) -> None:
    me, other = myself("catenary restart"), tmp_path / "other"
    other.write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / f"{LOCK_FILE}.{me.host}.{me.pid}").symlink_to(other)
    FolderLock(tmp_path / "out", "catenary restart").release()
    assert other.read_text() == "mine"


def test_a_lock_of_deep_brackets_names_no_process() -> None:
    assert read_owner("[" * 60000) is None


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_lock_names_its_process_and_goes_with_it(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    lock = FolderLock(folder, "catenary run case")
    assert names(folder) == [LOCK_FILE]
    owner = read_owner((folder / LOCK_FILE).read_text())
    assert owner is not None and owner.pid == os.getpid() and owner.alive
    with pytest.raises(InputError, match=rf"in use by process {os.getpid()} on "):
        FolderLock(folder, "catenary restart")
    lock.release()
    # The folders were made for it, and nothing was written.
    assert names(tmp_path) == []


def test_folders_with_something_in_them_stay(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path / "a" / "b", "catenary run case")
    (tmp_path / "a" / "run.h5").write_text("x")
    lock.release()
    assert names(tmp_path) == ["a"] and names(tmp_path / "a") == ["run.h5"]


@pytest.mark.process
def test_a_living_process_is_respected_and_a_killed_one_is_not(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        told = rf"in use by process {holder.pid} on .*`catenary run other`, since 2.*sign of life"
        with pytest.raises(InputError, match=told):
            FolderLock(tmp_path, "catenary run case")
        holder.kill()
    assert names(tmp_path) == [LOCK_FILE]
    lock = FolderLock(tmp_path, "catenary run case")
    owner = read_owner((tmp_path / LOCK_FILE).read_text())
    assert owner is not None and owner.pid == os.getpid()
    lock.release()
    assert names(tmp_path) == []


GONE = {
    "its process is gone": {"pid": 2**22 - 3, "started": "1"},
    "its number is another process's now": {"started": "1"},
    "the machine was started anew": {"boot": "an earlier one"},
    "a container of this machine that has ended": {"space": "pid:[1]"},
}
UNKNOWN = {
    "another machine": {"host": "node17", "machine": "other", "boot": "other"},
    "another machine of the same name": {"machine": "other", "boot": "other"},
    "a machine without numbers": {"machine": "", "boot": "", "space": ""},
}


@pytest.mark.parametrize("who", GONE)
def test_a_lock_of_a_dead_process_is_taken_over(who: str, tmp_path: Path) -> None:
    if "boot" in GONE[who] and not myself("catenary run case").machine:
        pytest.skip("a machine without a number in /etc/machine-id may be another one of its name")
    left_by(tmp_path, **GONE[who])
    lock = FolderLock(tmp_path, "catenary run case")
    assert names(tmp_path) == [LOCK_FILE]
    lock.release()
    assert names(tmp_path) == []


@pytest.mark.parametrize("who", UNKNOWN)
def test_a_lock_of_another_machine_is_refused(who: str, tmp_path: Path) -> None:
    path = left_by(tmp_path, **UNKNOWN[who])
    before = path.read_text()
    with pytest.raises(InputError, match="wait for its end, or choose another folder") as fresh:
        FolderLock(tmp_path, "catenary run case")
    assert "remove" not in str(fresh.value)
    os.utime(path, (path.stat().st_mtime - 10_800,) * 2)
    with pytest.raises(InputError, match=r"sign of life is 3\.0 h old") as silent:
        FolderLock(tmp_path, "catenary run case")
    assert f"if that process has ended, remove {path}" in str(silent.value)
    assert path.read_text() == before and names(tmp_path) == [LOCK_FILE]


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "no lock", json.dumps({"pid": 1}), "huge pid", "\x1b[31m"],
)
def test_a_file_that_is_no_lock_is_refused(text: str, tmp_path: Path) -> None:
    path = left_by(tmp_path, pid=10**30) if text == "huge pid" else tmp_path / LOCK_FILE
    if text != "huge pid":
        path.write_text(text)
    with pytest.raises(InputError, match="names no process"):
        FolderLock(tmp_path, "catenary run case")
    assert names(tmp_path) == [LOCK_FILE]


def test_control_characters_of_a_lock_reach_nobody(tmp_path: Path) -> None:
    left_by(tmp_path, command="\x1b]0;mine\x07")
    with pytest.raises(InputError, match="names no process") as caught:
        FolderLock(tmp_path, "catenary run case")
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("links", [True, False], ids=["links", "no links"])
@pytest.mark.parametrize("dead", [True, False], ids=["dead lock", "no lock"])
def test_of_many_that_want_a_folder_one_gets_it(
    links: bool, dead: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not links:  # as on a file system without hard links

        def refuse(*args: object, **kwargs: object) -> None:
            raise PermissionError(1, "Operation not permitted")

        monkeypatch.setattr(os, "link", refuse)
    if dead:
        left_by(tmp_path, started="1")
    got: list[FolderLock] = []
    pid = os.getpid()
    begin = threading.Barrier(8)
    # Threads stand for processes: each has a number of its own in the names of its files.
    myself_of = {}

    def me(command: str) -> Owner:
        return dataclasses.replace(myself(command), host=myself_of[threading.get_ident()])

    monkeypatch.setattr(folder_lock, "myself", me)

    def want(number: int) -> None:
        myself_of[threading.get_ident()] = f"host{number}"
        begin.wait()
        try:
            got.append(FolderLock(tmp_path, "catenary run case"))
        except InputError:
            pass

    threads = [threading.Thread(target=want, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert pid == os.getpid()
    assert len(got) == 1
    assert names(tmp_path) == [LOCK_FILE]
    got[0].release()
    assert names(tmp_path) == []


def test_a_lock_lives_in_a_folder_that_is_moved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder_lock, "HEARTBEAT", 0.01)
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    lock = FolderLock(here, "catenary run case")
    here.rename(there)
    os.utime(there / LOCK_FILE, (0, 0))
    for _ in range(6000):
        if (there / LOCK_FILE).stat().st_mtime > 0:
            break
        threading.Event().wait(0.01)
    assert (there / LOCK_FILE).stat().st_mtime > 0
    lock.release()
    assert names(there) == []


def test_a_process_is_known_by_when_it_started() -> None:
    me = myself("x")
    assert me.alive and me.started and me.boot
    assert not dataclasses.replace(me, started="1").alive
    assert read_owner(me.text()) == me
    assert folder_lock.read_owner(me.text().replace("pid", "pit")) is None


@pytest.mark.process
def test_a_process_that_has_ended_is_gone_before_its_parent_takes_note(tmp_path: Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", HOLD, tmp_path / "out"], stdout=subprocess.PIPE)
    assert child.stdout is not None and child.stdout.readline() == b"held\n"
    owner = read_owner((tmp_path / "out" / LOCK_FILE).read_text())
    assert owner is not None and owner.pid == child.pid and owner.alive
    child.kill()
    # It stays in the table of processes until it is waited for.
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    assert not owner.alive
    FolderLock(tmp_path / "out", "catenary run case").release()
    child.wait()
    child.stdout.close()


# --- paths that cannot be looked up ---------------------------------------------------------------


TOO_LONG = "x" * 300
VERBS = {
    "report": ["report", TOO_LONG],
    "restart": ["restart", TOO_LONG],
    "compare": ["compare", TOO_LONG, "other"],
    "worst": ["worst", TOO_LONG],
    "waves": ["waves", TOO_LONG],
    "merge": ["merge", TOO_LONG, "other", "-o", "out"],
    "uncertainty": ["uncertainty", TOO_LONG],
    "static": ["static", "ac_simple", "-o", f"{TOO_LONG}.csv"],
    "submit": ["submit", TOO_LONG, "-o", "out", "--print"],
    "new": ["new", TOO_LONG],
}


@pytest.mark.parametrize("verb", VERBS)
def test_a_name_that_is_too_long_is_told(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke(*VERBS[verb])
    told = result.stderr.strip()
    assert result.exit_code == 2 and told.startswith("catenary: ") and "\n" not in told, told
    wanted = ("File name too long", "there is no case or file", "it must be a path")
    assert any(words in told for words in wanted), told
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_another_user_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Said by the system to all but root."""

    stat = os.stat

    def refuses(path: Any, **how: Any) -> os.stat_result:
        if "theirs" in Path(path).parts:
            raise PermissionError(13, "Permission denied", str(path))
        return stat(path, **how)

    told = r"/theirs cannot be looked up \(Permission denied\): ask the owner"
    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", refuses)
        for asks in (files.is_file, files.is_folder, files.is_there, open_run):
            with pytest.raises(InputError, match=told):
                asks(tmp_path / "theirs")
        # Not by the parser of the option, whose errors nobody catches.
        assert run_folder(tmp_path / "theirs" / "run.h5") == tmp_path / "theirs" / "run.h5"


def test_links_in_a_circle_name_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("a")
    assert not files.is_there(tmp_path / "a") and not files.is_file(Path("a\0b"))
    assert files.is_folder(tmp_path) and not files.is_there(tmp_path / "a" / "b")


def test_folders_of_any_depth_are_made(tmp_path: Path) -> None:
    (tmp_path / "stays").touch()
    deep = tmp_path / "/".join("a" * 1500)
    (made,) = write_all(deep, {"b": "c"})
    assert made.read_text() == "c"
    made.unlink()
    os.removedirs(deep)  # pytest removes folders by a recursion


def test_a_new_case_at_a_link_in_a_circle_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a").symlink_to("a")
    result = invoke("new", "a")
    assert result.exit_code == 2 and result.stderr.startswith("catenary: a cannot be made"), result


# --- A run of a user who has no home and may not write where the program is installed -------------


NOBODY = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")


@pytest.mark.parametrize("home", ["/nonexistent", "/root"])  # sudo may keep the home of its caller
@pytest.mark.study
@pytest.mark.process
@pytest.mark.skipif(
    os.geteuid() != 0 or not shutil.which("setpriv"), reason="another user takes root and setpriv"
)
def test_a_user_without_home_and_without_write_access(home: str) -> None:
    if subprocess.run([*NOBODY, "test", "-r", __file__], check=False).returncode:
        pytest.skip("another user cannot read this checkout")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o777)
        run_as_nobody(Path(folder), home)


def run_as_nobody(folder: Path, home: str) -> None:
    words = ["run", "en50318_2002", "--short", "--quiet", "-o", str(folder / "run")]
    done = subprocess.run(
        [*NOBODY, sys.executable, "-c", ENTRY, *words],
        env={"HOME": home, "TMPDIR": str(folder)},
        cwd="/",
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert (folder / "run" / "summary.json").is_file()
