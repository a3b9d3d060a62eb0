"""Result files that name other files: links, external storage, virtual tables. All are refused, and
the other file stays as it is."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import pytest
from h5py import h5d, h5p, h5s, h5t
from studies import few

from catenary import InputError
from catenary.base.files import new_part
from catenary.postproc.files import disk
from catenary.postproc.files.committed_rows import fault_to_continue
from catenary.postproc.files.hdf5 import open_own
from catenary.postproc.film.film_data import Snapshots
from catenary.postproc.read.results import Results
from catenary.postproc.record.snapshots.fields import FieldRecorder

pytestmark = pytest.mark.process
PRECIOUS = b"precious" * 4000


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    folder: Path = tmp_path_factory.mktemp("made")
    march = make_march(n_steps=400, separations=(0.0,))
    march.drive(FieldRecorder(march.comm, folder / "fields.xdmf", march.recorded, every=50))
    record_run(folder / "run.h5", march)
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    for name in ("run.h5", "fields.h5"):
        shutil.copy(made / name, tmp_path)
    (tmp_path / "victim").write_bytes(PRECIOUS)
    return tmp_path


def external(file: h5py.File, path: str, victim: Path) -> None:
    values = file[path][()]
    del file[path]
    how = h5p.create(h5p.DATASET_CREATE)
    how.set_external(bytes(victim), 0, values.nbytes)
    space = h5s.create_simple(values.shape)
    h5d.create(file.id, path.encode(), h5t.py_create(values.dtype), space, how)


def virtual(file: h5py.File, path: str, victim: Path) -> None:
    shape = file[path].shape
    layout = h5py.VirtualLayout(shape, "f8")
    layout[:] = h5py.VirtualSource(victim, path, shape)
    del file[path]
    file.create_virtual_dataset(path, layout)


def soft(file: h5py.File, path: str, victim: Path) -> None:
    file.move(path, "elsewhere")
    file[path] = h5py.SoftLink("/elsewhere")


def onto_itself(file: h5py.File, path: str, victim: Path) -> None:
    del file[path]
    file[path] = h5py.SoftLink(f"/{path}")


def linked(file: h5py.File, path: str, victim: Path) -> None:
    del file[path]
    file[path] = h5py.ExternalLink(str(victim), path)


def larger_than_the_file(file: h5py.File, path: str, victim: Path) -> None:
    del file[path]
    file.create_dataset(path, shape=(10**9,), dtype="f8")


# Where in either file, and what is told.
WAYS: dict[str, tuple[Callable[[h5py.File, str, Path], None], str]] = {
    "external storage": (external, "keeps its numbers in another file"),
    "a virtual table": (virtual, "is a virtual table"),
    "a soft link": (soft, "is a soft link"),
    "a link onto itself": (onto_itself, "is a soft link"),
    "an external link": (linked, "is a link into another file"),
    "a table larger than the file": (larger_than_the_file, "has 8e+09 bytes and the file"),
}
PLACES = {
    "run.h5": ("line/support_x", "checkpoint/0/state", "facts/speed", "line_channels/time"),
    "fields.h5": ("times", "contact_wire/points"),
}
# What opens each of them, for reading or for changes.
OPENED_BY: dict[str, dict[str, Callable[[Path], Any]]] = {
    "run.h5": {
        "Results": Results,
        "restart": lambda path: fault_to_continue(path, 0.1),
        "changes": lambda path: open_own(path, "r+"),
    },
    "fields.h5": {
        "films": lambda path: Snapshots(path.parent, 10).__exit__(None, None, None),
        "restart": lambda path: disk.opened(path, "r+").__enter__(),
    },
}


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize(
    "way", few(WAYS, "external storage", "an external link", "a table larger than the file")
)
def test_a_file_that_names_another_one_is_refused(way: str, name: str, folder: Path) -> None:
    hide, words = WAYS[way]
    victim, path = folder / "victim", folder / name
    for place in PLACES[name]:
        shutil.copy(path, folder / "kept")
        with h5py.File(path, "r+", libver="latest") as file:
            if way == "a virtual table" and not file[place].ndim:
                continue
            hide(file, place, victim)
        for opener, use in OPENED_BY[name].items():
            with pytest.raises(InputError) as refused:
                use(path)
            assert f"{path} is refused: {place} {words}" in str(refused.value), opener
        assert victim.read_bytes() == PRECIOUS
        shutil.copy(folder / "kept", path)
    for use in OPENED_BY[name].values():
        found = use(path)
        if hasattr(found, "close"):
            found.close()


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize(
    ("kind", "words"), [("link", "is a symbolic link"), ("pipe", "is a pipe"), ("folder", "folder")]
)
def test_only_a_file_itself_is_opened(kind: str, words: str, name: str, folder: Path) -> None:
    path, kept = folder / name, folder / "kept.h5"
    path.rename(kept)
    if kind == "link":
        path.symlink_to(kept)
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    before = kept.read_bytes()
    for mode in ("r", "r+"):
        with pytest.raises(InputError, match=words):
            open_own(path, mode)
    assert kept.read_bytes() == before
    if kind == "link":
        for use in OPENED_BY[name].values():
            with pytest.raises(InputError, match=words):
                use(path)


def test_the_name_of_a_part_is_free_when_it_is_made(tmp_path: Path) -> None:
    victim, path = tmp_path / "victim", tmp_path / "run.h5"
    victim.write_bytes(PRECIOUS)
    part = tmp_path / f".run.h5.{os.getpid()}.part"
    part.symlink_to(victim)
    assert new_part(path) == part and not part.is_symlink()
    part.symlink_to(victim)
    disk.write_whole(path, "whole")
    assert victim.read_bytes() == PRECIOUS and path.read_text() == "whole"
