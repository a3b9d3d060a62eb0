"""Sweeps that keep statistics alone: the same table, and nothing else, whatever marches it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import catenary
from catenary.base.errors import InputError
from catenary.cases.studies.records import FOLDER

VARY: dict[str, list[Any]] = {
    "train.speed_km_h": [230, 240, 250],
    "line.contact_wire.tension_N": [20000, 21000],
}


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return catenary.load("en50318_2002", short=True)


@pytest.fixture(scope="module")
def table(scene: catenary.Scene) -> pd.DataFrame:
    return catenary.sweep(scene, VARY, only_statistics=True)


def same(one: pd.DataFrame, other: pd.DataFrame) -> None:
    """Round-off of lanes leaves 1e-10 N of a force."""
    pd.testing.assert_frame_equal(
        one.drop(columns="wall_s"), other.drop(columns="wall_s"), rtol=0.0, atol=1e-8
    )


def test_the_table_is_that_of_whole_runs(scene: catenary.Scene, table: pd.DataFrame) -> None:
    same(table, catenary.sweep(scene, VARY))


def test_nothing_but_tables_is_left_and_the_same_call_goes_on(
    scene: catenary.Scene, table: pd.DataFrame, tmp_path: Path
) -> None:
    first = catenary.sweep(scene, VARY, tmp_path, only_statistics=True)
    same(first, table)
    assert not list(tmp_path.rglob("run.h5")) and (tmp_path / "sweep.csv").is_file()
    records = sorted((tmp_path / FOLDER).iterdir())
    assert len(records) == 2  # pieces of four variants
    # One that a kill has cut is marched again, the other is not.
    text = records[0].read_text()
    records[0].write_text(text[: len(text) // 2])
    kept = json.loads(records[1].read_text())
    kept_time = records[1].stat().st_mtime_ns
    same(catenary.sweep(scene, VARY, tmp_path, only_statistics=True), table)
    assert json.loads(records[0].read_text()) == json.loads(text)
    assert json.loads(records[1].read_text()) == kept
    assert records[1].stat().st_mtime_ns == kept_time


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
