"""Everyday questions in Python, with a folder: the files of the program, and refusals."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from verb_runner import invoke

import catenary

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
OPTIMISED = {"variables": [{"key": "line.contact_wire.tension_N", "change": [0.0, 4000.0]}]}
Asked = Callable[..., pd.DataFrame]
QUESTIONS: dict[str, tuple[Asked, tuple[float, float], dict[str, Any], list[str], set[str]]] = {
    "speed": (
        catenary.highest_speeds,
        (300, 310),
        {"within": 5, "criteria": ["wave speed"]},
        ["--from", "300", "--to", "310", "--within", "5", "--criterion", "wave speed"],
        {"speed.csv", "speeds.csv", "speed.json", "speed.png"},
    ),
    "separation": (
        catenary.separations,
        (50, 90),
        {"step": 40},
        ["--from", "50", "--to", "90", "--step", "40"],
        {"separation.csv", "separation.json", "separation.png"},
    ),
}


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return catenary.load(CASE, short=True)


def without_times(path: Path) -> bytes:
    """Content of a file but for the wall times of its runs, which differ."""
    content = path.read_bytes()
    if path.suffix == ".csv":
        lines = list(csv.DictReader(content.decode().splitlines()))
        return repr([{**line, "wall_s": None} for line in lines]).encode()
    return re.sub(rb'"wall_s": [^,\s]+', b'"wall_s"', content)


@pytest.mark.parametrize("verb", QUESTIONS)
def test_a_folder_has_the_files_of_the_program(
    verb: str, scene: catenary.Scene, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ask, span, options, words, files = QUESTIONS[verb]
    out, of_verb = tmp_path / "python", tmp_path / "verb"
    table = ask(scene, *span, out, **options, progress=True)
    printed = capsys.readouterr()
    assert not printed.out and "about 0 s left" in printed.err
    assert {path.name for path in out.iterdir()} == files
    done = invoke(verb, CASE, "--short", *words, "-o", str(of_verb))
    assert done.exit_code == 0, done.output
    for name in files:
        assert without_times(out / name) == without_times(of_verb / name), name
    read = pd.read_csv(out / f"{verb}.csv")
    assert read.columns.tolist() == table.columns.tolist() and len(read) == len(table)
    with pytest.raises(catenary.InputError, match=r"is there already.* out, or give force=True"):
        ask(scene, *span, out, **options)
    assert not capsys.readouterr().err


def test_the_files_of_an_earlier_answer_are_replaced_by_force(
    scene: catenary.Scene, tmp_path: Path
) -> None:
    ask, span, options, _, files = QUESTIONS["speed"]
    for name in files:
        (tmp_path / name).write_text("earlier")
    table = ask(scene, *span, tmp_path, **options, force=True)
    assert not any((tmp_path / name).read_bytes() == b"earlier" for name in files)
    assert len(pd.read_csv(tmp_path / "speed.csv")) == len(table)


def test_a_search_that_was_stopped_goes_on_in_its_folder(
    scene: catenary.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was marched is kept until the files are there, and not marched again."""
    ask, span, options, *_ = QUESTIONS["separation"]
    from catenary.cases.studies.ensemble import Marches
    from catenary.cases.studies.questions import separation

    def full(*of: Any) -> None:
        raise catenary.RunBroken("the disk is full")

    marched: list[int] = []
    own = Marches.of

    def counted(self: Marches, scenes: Any) -> Any:
        marched.append(len(scenes))
        return own(self, scenes)

    monkeypatch.setattr(Marches, "of", counted)
    with monkeypatch.context() as broken, pytest.raises(catenary.RunBroken):
        broken.setattr(separation, "files_of", full)
        ask(scene, *span, tmp_path, **options)
    assert sum(marched) == 3  # one alone and two pairs
    table = ask(scene, *span, tmp_path, **options)
    assert sum(marched) == 3 and (table.outcome == "done").all()
    assert not (tmp_path / "rows_so_far").exists()


def test_one_name_stands_for_a_list_of_one(scene: catenary.Scene) -> None:
    """Not for a list of its letters, of which each is a part of some name."""
    table = catenary.highest_speeds(scene, 300, 310, within=10, criteria="wave speed")
    assert table.criterion.tolist()[1:] == ["train speed against 0.7 of the wave speed"]
    key = "pantographs.reference.static_force_N"
    assert catenary.sensitivity(scene, key).parameter.tolist() == [key]


@pytest.mark.parametrize("jobs", [-1, 1.5, "2", True])
@pytest.mark.parametrize(
    "ask",
    [
        *(asked for asked, *_ in QUESTIONS.values()),
        lambda scene, jobs: catenary.sweep(scene, {"train.speed_km_h": [200]}, jobs=jobs),
        lambda scene, jobs: catenary.optimise(scene, OPTIMISED, jobs=jobs),
    ],
)
def test_jobs_is_a_number_of_processes(ask: Asked, jobs: Any, scene: catenary.Scene) -> None:
    with pytest.raises(catenary.InputError, match="jobs is .*; it is a number of processes"):
        ask(scene, jobs=jobs)


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("ask", [asked for asked, *_ in QUESTIONS.values()])
def test_a_step_is_finite_and_above_zero(ask: Asked, step: float, scene: catenary.Scene) -> None:
    with pytest.raises(catenary.InputError, match=rf"step {step:g} is not possible"):
        ask(scene, step=step)


@pytest.mark.parametrize("verb", QUESTIONS)
def test_a_file_is_no_folder(verb: str, scene: catenary.Scene, tmp_path: Path) -> None:
    ask, span, options, *_ = QUESTIONS[verb]
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(catenary.InputError, match="is a file; name a folder for the results"):
        ask(scene, *span, file, **options)
    assert file.read_text() == "mine"
