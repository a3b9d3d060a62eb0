"""``catenary speed``: stretches of speeds against known verdicts, and against runs by hand."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from typer.testing import CliRunner

import catenary
from catenary.base.errors import InputError
from catenary.cases.cli.main import app
from catenary.cases.scene.load import read_draft
from catenary.cases.studies.questions.highest_speed import (
    ALL,
    KEY,
    Speeds,
    SpeedStudy,
    as_text,
    find_speeds,
    table_of_criteria,
)
from catenary.cases.studies.sweep.jobs import AS_USUAL, Ended
from catenary.cases.studies.sweep.together import Marching
from catenary.cases.studies.sweep.variants import Variant

CASE = "en50318_2002"
# Of EN 50318:2002: 20 kN on 1.35 kg/m.
WAVE_SPEED = 3.6 * np.sqrt(20e3 / 1.35)


def searched(
    monkeypatch: pytest.MonkeyPatch,
    speeds: Speeds,
    holds: dict[str, Callable[[float], bool]],
    refused_beyond: float = np.inf,
    wanted: Sequence[str] = (),
) -> tuple[SpeedStudy, list[float]]:
    """A search among verdicts that are functions of the speed, and the speeds that it marched."""
    marched: list[float] = []

    def of(self: Marching, variants: Sequence[Variant]) -> list[Ended]:
        ended = []
        for variant in variants:
            speed = float(variant.varied[KEY])
            marched.append(speed)
            rows = [
                {
                    "criterion": name,
                    "value": speed,
                    "limit": 1.0,
                    "unit": "N",
                    "passed": is_held(speed),
                }
                for name, is_held in holds.items()
            ]
            rows.append(
                {"criterion": "unknown", "value": None, "limit": 1.0, "unit": "N", "passed": None}
            )
            done = speed <= refused_beyond
            summary = {"acceptance": rows} if done else {}
            ended.append(Ended(variant, "done" if done else "is too fast", summary))
        return ended

    monkeypatch.setattr(Marching, "of", of)
    marching = Marching(read_draft(CASE), None, MPI.COMM_SELF, AS_USUAL)
    found = find_speeds(marching, CASE, speeds, wanted)
    return found, marched


def test_ends_of_stretches_are_bisected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Criteria with a known end, with a known beginning, with a peak between, with none at all."""
    holds = {
        "ends": lambda v: v <= 287.3,
        "begins": lambda v: v >= 216.1,
        "peak": lambda v: not 243.7 < v < 258.2,
        "never": lambda v: False,
        "always": lambda v: True,
    }
    found, marched = searched(monkeypatch, Speeds(200, 360, 10, 0.5), holds)
    by_name = {one.criterion: one for one in found.holds}
    (ends,) = by_name["ends"].stretches
    assert ends.fails_at is not None
    assert ends.slowest == 200 and ends.fastest <= 287.3 < ends.fails_at <= ends.fastest + 0.5
    (begins,) = by_name["begins"].stretches
    assert 216.1 <= begins.slowest <= 216.6 and begins.fastest == 360 and begins.fails_at is None
    below, above = by_name["peak"].stretches
    assert 243.2 <= below.fastest <= 243.7 and 258.2 <= above.slowest <= 258.7
    assert not by_name["never"].stretches and not by_name[ALL].stretches
    assert by_name["always"].stretches[0][:2] == (200, 360)
    assert found.not_judged == ("unknown",)
    # Bisection halves 10 km/h five times for each of the four ends, and no speed is marched twice.
    assert len(marched) == len(set(marched)) == 17 + 4 * 5


def test_all_criteria_hold_where_each_does(monkeypatch: pytest.MonkeyPatch) -> None:
    holds = {"first": lambda v: v < 300.0, "second": lambda v: 210.0 <= v <= 330.0}
    found, _ = searched(monkeypatch, Speeds(200, 360, 10, 1), holds)
    whole = found.holds[0]
    assert whole.criterion == ALL and whole.stopped_by == ("first",)
    assert whole.stretches[0].slowest == 210 and 299 <= whole.stretches[0].fastest < 300
    assert "fails: first." in as_text(found)
    row = table_of_criteria(found).records()[1]
    assert row["criterion"] == "first" and row["value"] == row["fails_at_km_h"] == 300
    (other,) = searched(monkeypatch, Speeds(), holds, wanted=["SEC"])[0].holds[1:]
    assert other.criterion == "second"
    with pytest.raises(InputError, match='"third" is part of no criterion; there are first; sec'):
        searched(monkeypatch, Speeds(), holds, wanted=["third"])


def test_a_speed_that_cannot_be_run_ends_a_stretch(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = searched(monkeypatch, Speeds(200, 360, 20, 1), {"one": lambda v: True}, 311.0)
    whole = found.holds[0]
    assert 310 <= whole.stretches[0].fastest <= 311 < (whole.stretches[0].fails_at or 0)
    assert whole.stopped_by == ("is too fast",) and whole.fails_by is None
    assert "to 360 km/h could not be run and count as failed; the first: is too fast" in as_text(
        found
    )


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--from", "300", "--to", "200"], "is no range of speeds"),
        (["--to", "2000"], "is no range of speeds"),
        (["--step", "1", "--within", "2"], "at most --step"),
        (["--step", "0.01", "--within", "0.01"], "at most 2000"),
        (["--from", "nan"], "is no range of speeds"),
    ],
)
def test_what_is_no_range_is_refused(words: list[str], told: str) -> None:
    done = CliRunner().invoke(app, ["speed", CASE, *words])
    assert done.exit_code == 2 and told in done.output


def test_the_command_agrees_with_runs_by_hand(tmp_path: Path) -> None:
    """The speed limit is 0.7 of the wave speed; other verdicts are those of runs."""
    words = ["speed", CASE, "--short", "--from", "300", "--to", "310", "--within", "2.5"]
    done = CliRunner().invoke(app, [*words, "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    rows = {
        row["criterion"]: row
        for row in csv.DictReader((tmp_path / "speed.csv").read_text().splitlines())
    }
    limit = rows["train speed against 0.7 of the wave speed"]
    assert float(limit["highest_km_h"]) <= 0.7 * WAVE_SPEED < float(limit["fails_at_km_h"])
    assert float(limit["limit"]) == pytest.approx(0.7 * WAVE_SPEED)
    runs = json.loads((tmp_path / "speed.json").read_text())["runs"]
    by_hand = catenary.sweep(catenary.load(CASE, short=True), {KEY: [r[KEY] for r in runs]})
    for row, (_, other) in zip(runs, by_hand.iterrows(), strict=True):
        assert row["failed"] == other.failed
        # Lanes leave round-off alone.
        assert row["std_N"] == pytest.approx(other.std_N, abs=1e-8)
    held = [row[KEY] for row in runs if not row["failed"]]
    assert float(rows[ALL]["holds_from_km_h"]) == held[0]
    assert float(rows[ALL]["highest_km_h"]) == held[-1]
    assert (tmp_path / "speed.png").is_file() and not (tmp_path / "rows_so_far").exists()
    again = CliRunner().invoke(app, [*words, "-o", str(tmp_path)])
    assert again.exit_code == 2 and "is there already" in again.output


@pytest.mark.study
@pytest.mark.parametrize("case", [CASE, "ac_simple", "re330_stitched", "ambrosio2012"])
def test_speeds_of_shipped_cases_are_those_of_sweeps(case: str) -> None:
    """Each criterion at every 10 km/h from 200 to 320 km/h, from whole runs."""
    scene = catenary.load(case, short=True)
    table = catenary.highest_speeds(scene, 200, 320, within=10)
    speeds = [float(v) for v in range(200, 321, 10)]
    by_hand = catenary.sweep(scene, {KEY: speeds})

    def stretch(is_held: list[bool]) -> tuple[float, float] | None:
        """First stretch of neighbouring speeds going up."""
        if not any(is_held):
            return None
        begin = is_held.index(True)
        length = (is_held[begin:] + [False]).index(False)
        return speeds[begin], speeds[begin + length - 1]

    for row in table.to_dict("records"):
        runs: list[Any] = [by_hand[by_hand[KEY] == speed].iloc[0] for speed in speeds]
        name = row["criterion"]
        held = [
            run.outcome == "done" and not (run.failed if name == ALL else name in run.failed)
            for run in runs
        ]
        found = (
            None if np.isnan(row["highest_km_h"]) else (row["holds_from_km_h"], row["highest_km_h"])
        )
        assert found == stretch(held), name
