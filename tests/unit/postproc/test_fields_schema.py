"""Damaged files of snapshots: one sentence for each, in films and for ParaView."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from studies import few

from catenary import InputError
from catenary.postproc.files.hdf5 import Damage
from catenary.postproc.film.film_data import Snapshots
from catenary.postproc.record.snapshots.contents import Course, FieldRecord
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.postproc.record.snapshots.fields_schema import read_fields

pytestmark = pytest.mark.usefixtures("examined_here")
WIRE = "contact_wire"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, make_march: Any) -> Path:
    """Snapshots of a whole line, and of a window that moves, from a run of half a second."""
    folder: Path = tmp_path_factory.mktemp("made")
    march = make_march(n_steps=500, separations=(0.0,))
    start = float(march.position(0.0)[0])
    window = FieldRecord(window=(40.0, 30.0), course=Course(start, start, march.speed))
    for name, record in (("fields", None), ("window", window)):
        path = folder / f"{name}.xdmf"
        march.drive(FieldRecorder(march.comm, path, march.recorded, every=50, record=record))
    return folder


def value(path: str, at: Any, number: float) -> Callable[[h5py.File], None]:
    return lambda file: file[path].__setitem__(at, number)


def parts(text: str) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__setitem__("parts", text)


def twice(file: h5py.File) -> None:
    names = json.loads(file.attrs["parts"])
    file.attrs["parts"] = json.dumps([names[0], *names])


def replaced(path: str, make: Callable[[np.ndarray], Any]) -> Callable[[h5py.File], None]:
    def apply(file: h5py.File) -> None:
        values = file[path][...]
        del file[path]
        file[path] = make(values)

    return apply


def disorder(file: h5py.File) -> None:
    file[f"{WIRE}/cell_first"][5], file[f"{WIRE}/cell_count"][5] = 7, 400


def long_times(file: h5py.File) -> None:
    times = file["times"][...]
    del file["times"]
    table = file.create_dataset("times", (10**9,), "f8", maxshape=(None,), chunks=(1024,))
    table[: times.size] = times


def grown(file: h5py.File) -> None:
    del file[f"{WIRE}/uplift"]
    file.create_group(f"{WIRE}/uplift")


DAMAGE: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "first below 0": (value(f"{WIRE}/first", 3, -5), "contact_wire/first holds -5"),
    "first beyond": (value(f"{WIRE}/first", 3, 10**6), "do not show points out of its 481"),
    "count beyond": (value(f"{WIRE}/count", 3, 10**9), "do not show points out of its 481"),
    "one point of a wire": (value(f"{WIRE}/count", 3, 1), "do not show points out of its 481"),
    "half an arm": (value("steady_arms/count", 3, 1), "steady_arms/first and steady_arms/count do"),
    "node beyond": (value(f"{WIRE}/nodes", 3, 10**6), "contact_wire/nodes holds 1e+06"),
    "node below 0": (value(f"{WIRE}/nodes", 3, -1), "contact_wire/nodes holds -1"),
    "node far below 0": (value("droppers/nodes", 3, -2), "droppers/nodes holds -2"),
    "cell beyond": (value(f"{WIRE}/cells", 5, 10**6), "contact_wire/cells join points that a"),
    "cells beyond": (value(f"{WIRE}/cell_count", 5, 10**6), "cell_count shows other cells than"),
    "cells in disorder": (disorder, "cell_first does not ascend by cell_count"),
    "point NaN": (value(f"{WIRE}/points", (5, 0), np.nan), "contact_wire/points holds nan"),
    "a block twice": (twice, 'its attribute "parts" is not a list of names, each of them once'),
    "deep parts": (parts("[" * 2000 + "]" * 2000), 'its attribute "parts" is not a list'),
    "numbers for parts": (parts("[1, 2]"), 'its attribute "parts" is not a list'),
    "the root for a part": (parts('["/"]'), 'its attribute "parts" is not a list'),
    "a part that is not there": (parts('["x"]'), "x/points is missing or cannot be read"),
    "no parts": (lambda file: file.attrs.__delitem__("parts"), '"parts" is missing'),
    "another format": (lambda file: file.attrs.__setitem__("format", "x"), '"format" is not'),
    "no nodes": (lambda file: file.attrs.__setitem__("n_nodes", 0), '"n_nodes" is not a whole'),
    "long times": (long_times, "times does not stand in one piece in the file"),
    "times as text": (replaced("times", lambda old: np.bytes_("now")), "times holds |S3"),
    "times back": (value("times", 4, 0.0), "times does not ascend"),
    "times before 0": (value("times", 0, -1.0), "times reaches from -1 to"),
    "a pantograph of -4": (value("pantograph_sizes", 0, -4), "pantograph_sizes holds -4"),
    "a pantograph of 9": (value("pantograph_sizes", 0, 9), "pantograph_places has the shape"),
    "no field": (grown, "contact_wire/uplift is missing or cannot be read"),
    "short field": (
        replaced(f"{WIRE}/uplift", lambda old: old[:-1]),
        "contact_wire/uplift has the shape (5290,) in place of (5291,)",
    ),
    "other order of bytes": (
        replaced(f"{WIRE}/uplift", lambda old: old.astype(">f4")),
        "contact_wire/uplift holds >f4 in place of float32",
    ),
}


@pytest.mark.parametrize(
    "how",
    few(
        DAMAGE,
        "first below 0",
        "one point of a wire",
        "node beyond",
        "cells in disorder",
        "point NaN",
        "a block twice",
        "no parts",
        "times back",
        "no field",
    ),
)
def test_damage_is_told_in_a_sentence(how: str, made: Path, tmp_path: Path) -> None:
    damage, words = DAMAGE[how]
    path = Path(shutil.copy(made / "fields.h5", tmp_path))
    with h5py.File(path, "r+", libver=("v108", "v108")) as file:
        n_nodes = int(file.attrs["n_nodes"])
        damage(file)
    with pytest.raises(InputError) as refused:
        Snapshots(tmp_path, n_nodes)
    assert f"{path} is damaged: " in str(refused.value) and words in str(refused.value)


@pytest.mark.parametrize("name", ["fields", "window"])
def test_what_a_run_writes_is_sound(name: str, made: Path) -> None:
    with h5py.File(made / f"{name}.h5") as file:
        found = read_fields(file)
        assert list(found.blocks) == json.loads(file.attrs["parts"])
    np.testing.assert_allclose(found.times, 0.05 * np.arange(11))
    moves = np.ptp(found.blocks[WIRE].first) > 0
    assert moves == (name == "window")


def test_cells_of_a_window_are_those_of_its_points(made: Path, tmp_path: Path) -> None:
    """A cell is that of the largest window; in a smaller one it may join what is not shown."""
    path = Path(shutil.copy(made / "window.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        file[f"{WIRE}/cell_count"][-1] += 1
        with pytest.raises(Damage, match="contact_wire/cell"):
            read_fields(file)
