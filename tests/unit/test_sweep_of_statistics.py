"""Sweeps that keep statistics alone: the same table, and nothing else, whatever marches it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI
from scenes import read_draft

import catenary
from catenary import InputError
from catenary.cases.scene.load import Draft
from catenary.cases.studies import sweeps
from catenary.cases.studies.records import FOLDER
from catenary.cases.studies.sweep.histories import KeptHistories, merge_histories, piece_file
from catenary.cases.studies.sweep.jobs import AS_USUAL, HISTORIES, Ended, Part
from catenary.cases.studies.sweep.output import force_histograms
from catenary.cases.studies.sweep.together import pieces_of_work
from catenary.cases.studies.sweep.variants import Variant, parse_vary, product

pytestmark = pytest.mark.usefixtures("quick_reports")

VARY: dict[str, list[Any]] = {
    "train.speed_km_h": [230, 240, 250],
    "line.contact_wire.tension_N": [20000, 21000],
}


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    """With half of the elements: lanes and runs agree in any mesh."""
    return catenary.load("en50318_2002", short=True).replace(mesh={"elements_per_gap": 4})


@pytest.fixture(scope="module")
def table(scene: catenary.Scene) -> pd.DataFrame:
    return catenary.sweep(scene, VARY, only_statistics=True)


def same(one: pd.DataFrame, other: pd.DataFrame) -> None:
    """Round-off of lanes leaves 1e-10 N of a force."""
    pd.testing.assert_frame_equal(
        one.drop(columns="wall_s"), other.drop(columns="wall_s"), rtol=0.0, atol=1e-8
    )


def test_pieces_of_work_have_one_line_and_stay_when_more_variants_come() -> None:
    def variants(n: int, n_lines: int) -> list[Variant]:
        keys = [(f"train.speed_km_h={200 + i}", f"line.n_spans={i % n_lines}") for i in range(n)]
        return [Variant(str(i), assignments) for i, assignments in enumerate(keys)]

    # 4 lines have 10 variants each: two full pieces of 4, and 2 variants that share a piece.
    few, more = (pieces_of_work(variants(n, 4), 4) for n in (40, 80))
    n_lines = [len({one.assignments[1] for one in piece}) for piece in few]
    assert n_lines == [1] * 8 + [2, 2]
    assert all(piece in more for piece in few[:8])
    assert sorted(int(one.name) for piece in few for one in piece) == list(range(40))
    # Of lines with a variant each, pieces are in the order of the variants.
    few, more = (pieces_of_work(variants(n, 100), 4) for n in (40, 80))
    assert few == more[:10]


@pytest.mark.parametrize("only_statistics", [True, False])
def test_a_value_out_of_bounds_is_told_as_python_gave_it(
    only_statistics: bool, scene: catenary.Scene
) -> None:
    with pytest.raises(InputError, match=r"^train.speed_km_h is 5000 in vary; it must be at most"):
        catenary.sweep(scene, {"train.speed_km_h": [5000]}, only_statistics=only_statistics)


@pytest.mark.study
def test_the_table_is_that_of_whole_runs(scene: catenary.Scene, table: pd.DataFrame) -> None:
    same(table, catenary.sweep(scene, VARY))


def test_nothing_but_tables_is_left_and_the_same_call_goes_on(
    scene: catenary.Scene, table: pd.DataFrame, tmp_path: Path
) -> None:
    first = catenary.sweep(scene, VARY, tmp_path, only_statistics=True)
    same(first, table)
    # They were zero; those that march side by side share the time of their piece of work.
    assert (first.wall_s > 0.0).all() and first.wall_s.nunique() == 2
    assert not list(tmp_path.rglob("run.h5")) and (tmp_path / "sweep.csv").is_file()
    records = sorted((tmp_path / FOLDER).iterdir())
    assert len(records) == 2  # pieces of four variants
    # One that a kill has cut is marched again, the other is not.
    text = records[0].read_text()
    records[0].write_text(text[: len(text) // 2])
    kept = json.loads(records[1].read_text())
    kept_time = records[1].stat().st_mtime_ns
    same(catenary.sweep(scene, VARY, tmp_path, only_statistics=True), table)
    again, before = (json.loads(one)["rows"] for one in (records[0].read_text(), text))
    assert [row[:-1] for row in again] == [row[:-1] for row in before]  # wall times differ
    assert json.loads(records[1].read_text()) == kept
    assert records[1].stat().st_mtime_ns == kept_time


def test_the_table_of_another_scene_or_other_samples_stays(
    scene: catenary.Scene, tmp_path: Path
) -> None:
    """Names of variants are the same, their figures would be others."""
    key, out = "train.speed_km_h", tmp_path / "out"

    def swept(of: catenary.Scene, seed: int, **more: Any) -> pd.DataFrame:
        normal = {"type": "normal", "mean": 250.0, "standard_deviation": 5.0}
        sample = {"n": 2, "seed": seed, "method": "random", "keys": {key: normal}}
        return catenary.sweep(of, sample=sample, out=out, only_statistics=True, **more)

    first = swept(scene, 1)
    with pytest.raises(InputError, match="is the table of a sweep with another sample_000001; "):
        swept(scene, 2)
    stiffer = scene.replace({"contact.stiffness_N_per_m": 60000.0})
    says = "of a sweep with contact.stiffness_N_per_m = 50000.0, here it is 60000.0; name another"
    with pytest.raises(InputError, match=says):
        swept(stiffer, 1)
    # What is recorded, and a value that all variants set, change no figure.
    same(swept(scene.replace({"output.field_every_s": 0.0, key: 240.0}), 1), first)
    assert (swept(stiffer, 1, force=True).std_N != first.std_N).all()


@pytest.mark.study
@pytest.mark.process
def test_pieces_of_work_in_processes_give_the_same(
    scene: catenary.Scene, table: pd.DataFrame
) -> None:
    same(catenary.sweep(scene, VARY, only_statistics=True, jobs=2), table)


def test_a_variant_that_is_refused_has_its_row(scene: catenary.Scene) -> None:
    """A speed beyond that of the waves is refused, and the other is marched."""
    vary = {"train.speed_km_h": [250, 600]}
    found = catenary.sweep(scene, vary, only_statistics=True)
    assert found.outcome[0] == "done" and "wave" in found.outcome[1]
    with pytest.raises(InputError, match="wave"):
        catenary.sweep(scene, {"train.speed_km_h": [600, 620]}, only_statistics=True)


SPEEDS = [240, 600, 250, 230, 235]  # the second is refused; pieces have four variants


@pytest.fixture(scope="module")
def whole_runs(scene: catenary.Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    catenary.sweep(scene, {"train.speed_km_h": SPEEDS}, folder)
    return folder


def histories(scene: catenary.Scene, out: Path, **more: Any) -> dict[str, np.ndarray]:
    """All tables of the histories of an ensemble."""
    vary = {"train.speed_km_h": SPEEDS}
    catenary.sweep(scene, vary, out, only_statistics=True, histories=tuple(HISTORIES), **more)
    with h5py.File(out / "histories.h5") as file:
        return {name: table[...] for name, table in file.items()}


def test_histories_are_those_of_whole_runs(
    scene: catenary.Scene, whole_runs: Path, tmp_path: Path
) -> None:
    found = histories(scene, tmp_path)
    assert found["train.speed_km_h"].tolist() == SPEEDS
    for row, name in enumerate(found["variant"].astype(str)):
        n = np.isfinite(found["time"][row]).sum()
        if name == "speed_km_h_600":
            assert not n and np.isnan(found["contact_force"][row]).all()
            continue
        with h5py.File(whole_runs / name / "run.h5") as run:
            assert np.array_equal(found["time"][row, :n], run["time"][...])
            for own, path in {
                **{name: f"channels/{name}" for name in HISTORIES},
                "filtered_force": "filtered/contact_force",
                "position": "channels/contact_position",
            }.items():
                # Single precision: 24 bits of forces below 300 N and heights below 8 m.
                bound = 300.0 * 2.0**-24 if "force" in own else 8.0 * 2.0**-24
                difference = found[own][row, :n] - run[path][...]
                assert np.abs(difference).max() <= bound
                assert np.isnan(found[own][row, n:]).all()


@pytest.mark.study
def test_histories_of_several_lines_are_in_the_order_of_the_variants(
    scene: catenary.Scene, table: pd.DataFrame, tmp_path: Path
) -> None:
    """Variants of a line are marched together, here every other one."""
    catenary.sweep(scene, VARY, tmp_path, only_statistics=True, histories=["filtered_force"])
    with h5py.File(tmp_path / "histories.h5") as file:
        assert file["variant"].asstr()[...].tolist() == table["variant"].tolist()
        position, force = file["position"][..., 0], file["filtered_force"][..., 0]
    first, last = scene["evaluation.from_m"], scene["evaluation.to_m"]
    for row, deviation in enumerate(table["std_N"]):
        own = force[row, (position[row] >= first) & (position[row] <= last)]
        # Single precision leaves 1e-5 N of a deviation, which of no two variants here is so near.
        assert own.std() == pytest.approx(deviation, abs=1e-4)


def test_the_same_call_completes_histories(
    scene: catenary.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as stopped:
        stopped.setattr(KeptHistories, "join", lambda *_: None)
        with pytest.raises(FileNotFoundError):
            histories(scene, tmp_path)
    one, other = sorted((tmp_path / FOLDER).glob("*.h5"))
    one.unlink()
    kept = other.with_suffix(".json").stat().st_mtime_ns
    whole, joined = histories(scene, tmp_path), tmp_path / "histories.h5"
    assert other.with_suffix(".json").stat().st_mtime_ns == kept
    assert not list((tmp_path / FOLDER).glob("*.h5"))
    made = joined.stat().st_mtime_ns
    assert [*histories(scene, tmp_path)] == [*whole] and joined.stat().st_mtime_ns == made
    again = histories(scene, tmp_path, force=True)
    assert joined.stat().st_mtime_ns != made
    for name, table in whole.items():
        np.testing.assert_array_equal(again[name], table)


@pytest.mark.process
def test_parts_of_killed_processes_are_removed(scene: catenary.Scene, tmp_path: Path) -> None:
    """A killed sweep left hidden parts of histories for ever, beside those of processes at work."""
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    kept = tmp_path / FOLDER
    kept.mkdir()
    gone = [tmp_path / f".histories.h5.{dead.pid}.part"]
    gone += [kept / f".{64 * 'a'}.{kind}.{dead.pid}.part" for kind in ("h5", "json")]
    stay = [kept / f".{64 * 'a'}.h5.{os.getpid()}.part", tmp_path / f".notes.{dead.pid}.part"]
    for path in (*gone, *stay):
        path.touch()
    histories(scene, tmp_path)
    assert not any(path.exists() for path in gone) and all(path.exists() for path in stay)


def test_histories_of_parts_are_merged(scene: catenary.Scene, tmp_path: Path) -> None:
    """Two machines make a part each; merged they are the histories of the whole sweep."""
    kept, words = tuple(HISTORIES), ("train.speed_km_h=200,240,250,260,270",)
    draft = read_draft("en50318_2002", ["mesh.elements_per_gap=4"], shortened=True)
    variants = product([parse_vary(word) for word in words], {})
    whole = {
        name: table[...]
        for name, table in _tables_of(draft, variants, tmp_path / "whole", None, kept).items()
    }
    folders = []
    for number in (1, 2):
        out = tmp_path / str(number)
        part = Part(number, 2)
        _tables_of(draft, variants, out, part, kept)
        folders.append(out / part.folder)
    merged = sweeps.merge(folders[::-1])
    written = sweeps.write_merged(tmp_path / "all", merged)
    assert tmp_path / "all" / "histories.h5" in written.files and not written.lacks
    with h5py.File(tmp_path / "all" / "histories.h5") as file:
        assert set(file) == set(whole)
        order = [list(file["variant"].asstr()).index(one.name) for one in variants]
        for name, table in whole.items():
            found = file[name][...]
            rows = found[order] if name not in ("step", "pantograph") else found
            if name != "variant":
                assert rows.dtype == table.dtype
                # Scenes stand in lanes of other groups, which round-off tells apart.
                np.testing.assert_allclose(rows, table, rtol=0.0, atol=1e-4)
    (folders[0] / "histories.h5").unlink()
    written = sweeps.write_merged(tmp_path / "less", sweeps.merge(folders))
    assert written.lacks == f"histories are left out: {folders[0]} has none of {variants[0].name}"
    assert not (tmp_path / "less" / "histories.h5").exists()


def _tables_of(
    draft: Draft,
    variants: list[Variant],
    out: Path,
    part: Part | None,
    kept: tuple[str, ...],
) -> dict[str, np.ndarray]:
    """Histories of a sweep, or of a part of it."""
    sweep = sweeps.plan_sweep(draft, variants, out, only_statistics=True, histories=kept)
    if part is None:
        sweep.run(MPI.COMM_SELF, AS_USUAL, "a test", None)
        folder = out
    else:
        sweep.run_part(part, MPI.COMM_SELF, AS_USUAL)
        folder = out / part.folder
    with h5py.File(folder / "histories.h5") as file:
        return {name: table[...] for name, table in file.items()}


def test_histories_of_a_lost_process_are_waited_for(tmp_path: Path) -> None:
    KeptHistories(tmp_path, ["contact_force"], "sweep").join([], {tmp_path / "lost.h5": []})
    assert not list(tmp_path.iterdir())


def test_histories_of_a_pantograph_whose_name_has_a_slash_are_merged(tmp_path: Path) -> None:
    """HDF5 takes what stands before a slash for a group."""
    variant = Variant("one", (), {"pantographs.a/b.static_force_N": "60"})
    kept = KeptHistories(tmp_path / "one", ["contact_force"], "sweep")
    piece = kept.file_of(variant.name)
    with piece_file(piece, ["contact_force"]) as put:
        tables = "time", "channels/contact_position", "channels/contact_force"
        put(0, {name: np.zeros((3,) if name == "time" else (3, 1)) for name in tables})
    kept.join([variant], {piece: [variant]})
    files, lacks = merge_histories(tmp_path / "all.h5", {"one": tmp_path / "one"})
    assert (files, lacks) == ([tmp_path / "all.h5"], "")
    with h5py.File(tmp_path / "all.h5") as file:
        assert file["pantographs.a_b.static_force_N"][...].tolist() == [60.0]


@pytest.mark.process
def test_histories_on_a_full_disk_end_with_a_sentence(tmp_path: Path) -> None:
    """And not with a crash: HDF5 would write again at the end of the program."""
    script = (
        "import resource, sys\nimport numpy as np\nfrom pathlib import Path\n"
        "from catenary.cases.studies.sweep.histories import piece_file\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))\n"
        "names = 'time', 'channels/contact_position', 'channels/contact_force'\n"
        "with piece_file(Path(sys.argv[1]), ['contact_force']) as put:\n"
        "    for number in range(9):\n"
        "        put(number, {name: np.zeros(200) for name in names})\n"
    )
    words = [sys.executable, "-c", script, str(tmp_path / "piece.h5")]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 1, done
    last = done.stderr.strip().splitlines()[-1]
    assert "RunBroken: writing" in last and "piece.h5 failed (File too large)" in last
    assert not list(tmp_path.iterdir())


def test_histories_that_there_are_not_are_refused(scene: catenary.Scene, tmp_path: Path) -> None:
    vary = {"train.speed_km_h": [240, 250]}
    for out, more, words in (
        (tmp_path, {"only_statistics": True, "histories": ["force"]}, "force is no history"),
        (tmp_path, {"histories": ["contact_force"]}, "run.h5"),
        (None, {"only_statistics": True, "histories": ["contact_force"]}, "folder"),
    ):
        with pytest.raises(InputError, match=words):
            catenary.sweep(scene, vary, out, **more)
    assert not list(tmp_path.iterdir())


def test_histograms_are_those_of_the_filtered_forces(
    scene: catenary.Scene, whole_runs: Path
) -> None:
    names = ("speed_km_h_240", "speed_km_h_250")
    texts = [(whole_runs / name / "summary.json").read_text() for name in names]
    ended = [
        Ended(Variant(name, ()), "done", json.loads(text))
        for name, text in zip(names, texts, strict=True)
    ]
    found = force_histograms([*ended, Ended(Variant("speed_km_h_600", ()), "refused")])
    assert found is not None and list(found.index) == [(name, "pantograph") for name in names]
    edges = [*found.columns, found.columns[-1] + (found.columns[1] - found.columns[0])]
    for (name, _), percent in found.iterrows():
        with h5py.File(whole_runs / name / "run.h5") as run:
            x, force = run["channels/contact_position"][:, 0], run["filtered/contact_force"][:, 0]
            low, high = run["line/evaluation_range"][...]
        within = force[(x >= low) & (x <= high)]
        counts, _ = np.histogram(within, edges)
        # Single precision in the file may move a step across the edge of a bin.
        assert np.abs(percent - 100.0 * counts / within.size).max() <= 200.0 / within.size
        assert percent.sum() == pytest.approx(100.0)
