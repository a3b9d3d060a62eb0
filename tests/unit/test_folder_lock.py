"""The lock of a result folder: who is refused, whose lock is taken over, what is left."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from catenary import InputError
from catenary.cases.result_folder import folder_lock
from catenary.cases.result_folder.folder_lock import (
    JOBS_ENDED,
    LOCK_FILE,
    FolderLock,
    Owner,
    myself,
    read_owner,
)

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
