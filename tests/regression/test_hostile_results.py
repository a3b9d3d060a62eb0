"""Folders of results from strangers: they are data, and act on no file but their own."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import h5py
import pytest
from damaging import unseal
from h5py import h5d, h5p, h5s, h5t
from program import Done, catenary, short_run

PRECIOUS = b"precious" * 20000


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    words = [*short_run(folder / "out", "output.flush_every_steps=100")]
    assert catenary(*words, "--", "-march_ts_max_steps", "1050", cwd=folder).code == 1
    return folder / "out"


@pytest.fixture
def out(interrupted: Path, tmp_path: Path) -> Path:
    (tmp_path / "victim").write_bytes(PRECIOUS)
    return Path(shutil.copytree(interrupted, tmp_path / "out"))


def refused(done: Done, words: str) -> None:
    assert done.code == 2 and "Traceback" not in done.stderr and done.left == [], done
    assert words in done.sentences[-1], done


def test_a_state_in_a_file_of_the_user_is_not_written(out: Path) -> None:
    victim = out.parent / "victim"
    with h5py.File(out / "run.h5", "r+", libver=("v108", "v108")) as file:
        for slot in ("0", "1"):
            values = file[f"checkpoint/{slot}/velocity"][()]
            del file[f"checkpoint/{slot}/velocity"]
            how = h5p.create(h5p.DATASET_CREATE)
            how.set_external(bytes(victim), 0, values.nbytes)
            kind, space = h5t.py_create(values.dtype), h5s.create_simple(values.shape)
            h5d.create(file.id, f"checkpoint/{slot}/velocity".encode(), kind, space, how)
        unseal(file)
    before = (out / "run.h5").read_bytes()
    for verb in ("restart", "report"):
        done = catenary(verb, str(out), cwd=out.parent)
        refused(done, "checkpoint/0/velocity keeps its numbers in another file")
    assert victim.read_bytes() == PRECIOUS and (out / "run.h5").read_bytes() == before


def test_snapshots_in_another_file_are_refused_before_anything_is_written(out: Path) -> None:
    with h5py.File(out / "fields.h5", "r+") as file:
        file.move("contact_wire/uplift", "elsewhere")
        file["contact_wire/uplift"] = h5py.SoftLink("/elsewhere")
    before = (out / "run.h5").read_bytes()
    for words in (["restart", str(out), "--until-m", "280"], ["paraview", str(out)]):
        done = catenary(*words, cwd=out.parent)
        refused(done, "fields.h5 is refused: contact_wire/uplift is a soft link")
    assert (out / "run.h5").read_bytes() == before


@pytest.mark.parametrize(
    "verb",
    [
        "restart",
        "report",
        pytest.param("compare", marks=pytest.mark.study),
        pytest.param("animate", marks=pytest.mark.study),
        "paraview",
    ],
)
def test_a_result_file_that_is_a_link_is_not_followed(verb: str, out: Path) -> None:
    kept = out.parent / "kept.h5"
    (out / "run.h5").rename(kept)
    (out / "run.h5").symlink_to(kept)
    before = kept.read_bytes()
    words = [verb, str(out), *([str(out)] if verb == "compare" else [])]
    refused(catenary(*words, cwd=out.parent), "run.h5 is a symbolic link")
    assert kept.read_bytes() == before


def test_a_pipe_in_place_of_the_lock_is_not_waited_for(out: Path) -> None:
    os.mkfifo(out / ".catenary.lock")
    refused(catenary("restart", str(out), cwd=out.parent), ".catenary.lock is a link, a pipe")


def test_nothing_is_written_through_links_of_a_folder_for_paraview(out: Path) -> None:
    elsewhere = out.parent / "elsewhere"
    elsewhere.mkdir()
    (out / "paraview").symlink_to(elsewhere)
    refused(catenary("paraview", str(out), "--no-state", cwd=out.parent), "paraview is a link")
    assert list(elsewhere.iterdir()) == []
    (out / "paraview").unlink()
    (out / "paraview").mkdir()
    names = ("scenery.h5", "track.xdmf", "view.py")
    for name in names:
        (out / "paraview" / name).symlink_to(out.parent / "victim")
    assert catenary("paraview", str(out), "--no-state", cwd=out.parent).code == 0
    assert not any((out / "paraview" / name).is_symlink() for name in names)
    assert (out.parent / "victim").read_bytes() == PRECIOUS


def test_words_of_a_file_do_not_steer_the_terminal(out: Path) -> None:
    with h5py.File(out / "run.h5", "r+") as file:
        unseal(file)
        file.attrs["outcome"] = "broke\x1b[31m\x1b]0;title\x07 \u202egnp"
    (out / "fields.h5").unlink()  # without snapshots a report works out no waves
    for words in (["report", str(out)], ["compare", str(out), str(out)]):
        done = catenary(*words, cwd=out.parent)
        assert done.code == 0, done
        said = done.stdout + done.stderr
        assert not any(letter in said for letter in "\x1b\x07\u202e"), said
    assert "broke\\u001b[31m\\u001b]0;title\\u0007 \\u202egnp" in done.stdout
