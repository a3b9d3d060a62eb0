"""``catenary speed``: stretches of speeds against known verdicts, and against runs by hand."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mpi4py import MPI
from scenes import line_of, load_scene, read_draft
from verb_runner import invoke

import catenary
from catenary import InputError
from catenary.cases.scene.turned import BACKWARD, FORWARD, turned
from catenary.cases.studies.asked import Speeds
from catenary.cases.studies.questions.highest_speed import (
    ALL,
    KEY,
    SpeedStudy,
    as_text,
    draw,
    find_speeds,
    table_of_criteria,
)
from catenary.cases.studies.sweep.jobs import AS_USUAL, Ended
from catenary.cases.studies.sweep.together import Marching
from catenary.cases.studies.sweep.variants import Variant, text_of

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
# Of EN 50318:2002: 20 kN on 1.35 kg/m.
WAVE_SPEED = 3.6 * np.sqrt(20e3 / 1.35)
SPLICE = {"kind": "splice", "at_m": 430.0, "mass_kg": 1.0}
ONE_SIDED = f"line.fittings=[{text_of(SPLICE)}]"


def searched(
    monkeypatch: pytest.MonkeyPatch,
    speeds: Speeds,
    holds: dict[str, Callable[[float], bool]],
    refused_beyond: float = np.inf,
    wanted: Sequence[str] = (),
    backward: float | None = None,
) -> tuple[SpeedStudy, list[float]]:
    """A search among verdicts that are functions of the speed, and the speeds that it marched.

    The line is its own mirror image; with ``backward`` it is not, and trains that run backward see
    verdicts of so much higher speeds.
    """
    marched: list[float] = []

    def of(self: Marching, variants: Sequence[Variant]) -> list[Ended]:
        ended = []
        for variant in variants:
            speed = float(variant.varied[KEY])
            marched.append(speed)
            if variant.direction == BACKWARD:
                assert backward is not None
                speed += backward
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
    draft = read_draft(CASE, () if backward is None else (ONE_SIDED,))
    marching = Marching(draft, draft.scene(), None, MPI.COMM_SELF, AS_USUAL)
    found = find_speeds(marching, speeds, wanted)
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


def test_close_speeds_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one criterion, as finely as speeds are bisected at all."""
    holds = {"ends": lambda v: v < 200.0123}
    found, marched = searched(monkeypatch, Speeds(200, 200.1, 0.1, 0.001), holds)
    assert len(marched) == len(set(marched))
    text = "The one criterion judged here holds from 200.0000 to 200.0117 km/h; at 200.0125 km/h"
    assert text in as_text(found)


def test_all_criteria_hold_where_each_does(monkeypatch: pytest.MonkeyPatch) -> None:
    holds = {"first": lambda v: v < 300.0, "second": lambda v: 210.0 <= v <= 330.0}
    found, _ = searched(monkeypatch, Speeds(200, 360, 10, 1), holds)
    whole = found.holds[0]
    assert whole.criterion == ALL and whole.stopped_by == ("first",)
    assert whole.stretches[0].slowest == 210 and 299 <= whole.stretches[0].fastest < 300
    assert "stopped in both directions by: first." in as_text(found)
    assert "its own mirror image" in as_text(found)
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
    assert "to 360 km/h could not be made and counted as failed; the first: is too fast" in as_text(
        found
    )


def test_the_direction_that_fails_first_ends_a_stretch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Backward all verdicts are those of 25 km/h faster."""
    holds = {
        "ends": lambda v: v <= 287.3,
        "begins": lambda v: v >= 216.1,
        "peak": lambda v: not 300.0 < v < 306.0,
    }
    found, marched = searched(monkeypatch, Speeds(200, 360, 5, 0.5), holds, backward=25.0)
    ends, begins, peak = found.holds[1:]
    assert 261.8 <= ends.stretches[0].fastest <= 262.3 and ends.direction == BACKWARD
    assert 261.8 <= (ends.highest[BACKWARD] or 0) <= 262.3
    assert 286.8 <= (ends.highest[FORWARD] or 0) <= 287.3
    assert ends.fails_by is not None and ends.fails_by[0] > 287.3
    # Backward it holds from the beginning on, so that the direction of the scene decides.
    assert 216.1 <= begins.stretches[0].slowest <= 216.6 and begins.direction == ""
    assert [(round(s.slowest), round(s.fastest)) for s in peak.stretches] == [
        (200, 275), (281, 300), (306, 360),
    ]  # fmt: skip
    assert "km/h stopped in the backward direction by: ends." in as_text(found)
    row = table_of_criteria(found).records()[1]
    assert row["direction"] == BACKWARD
    assert row["highest_backward_km_h"] < row["highest_forward_km_h"]
    # Each speed twice, once in each direction.
    assert len(marched) == 2 * len(set(marched)) == len(found.ended)


def test_a_line_without_mirror_image_is_judged_one_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Marching, "of", lambda self, variants: [Ended(v, "done") for v in variants])
    key = "irregularities.contact_wire_height.standard_deviation_mm"
    draft = read_draft(CASE, [f"{key}=5"])
    marching = Marching(draft, draft.scene(), None, MPI.COMM_SELF, AS_USUAL)
    found = find_speeds(marching, Speeds(), ())
    assert found.directions == (FORWARD,)
    assert f"Trains run forward alone: {key} " in as_text(found)
    with pytest.raises(InputError, match=f"{key}.* has no mirror image"):
        find_speeds(marching, Speeds(), (), BACKWARD)
    chosen = find_speeds(marching, Speeds(), (), FORWARD)
    assert chosen.one_way == "Trains run forward alone, as chosen."
    with pytest.raises(InputError, match='direction "up" is none of forward, backward'):
        find_speeds(marching, Speeds(), (), "up")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--from", "300", "--to", "200"], "is no range of speeds"),
        (["--to", "2000"], "is no range of speeds"),
        (["--step", "1", "--within", "2"], "at most --step"),
        (["--within", "1e-5"], "at least 0.001 km/h"),
        (["--step", "0.01", "--within", "0.01"], "at most 2000"),
        (["--from", "nan"], "is no range of speeds"),
    ],
)
def test_what_is_no_range_is_refused(words: list[str], told: str) -> None:
    done = invoke("speed", CASE, *words)
    assert done.exit_code == 2 and told in done.output


def test_limits_of_a_panel_are_told_apart() -> None:
    """Two of the deviation by name and dashes, which a print without colours shows."""
    draft = read_draft(CASE, ("train.end_m=400", "evaluation.from_m=300", "evaluation.to_m=390"))
    marching = Marching(draft, draft.scene(), None, MPI.COMM_SELF, AS_USUAL)
    figure = draw(find_speeds(marching, Speeds(250, 260, 10, 10), ()))
    assert figure is not None
    deviation, *others = (
        {line.get_label(): line.get_linestyle() for line in axes.lines} for axes in figure.axes
    )
    assert deviation["limit, 0.3 of the mean"] != deviation["limit, 0.3 of the allowed mean"]
    assert all("limit" in labels for labels in others)


@pytest.mark.study
def test_the_command_agrees_with_runs_by_hand(tmp_path: Path) -> None:
    """The speed limit is 0.7 of the wave speed; other verdicts are those of runs."""
    words = ["speed", CASE, "--short", "--from", "300", "--to", "310", "--within", "2.5"]
    words += ["--set", ONE_SIDED]
    done = invoke(*words, "-o", str(tmp_path))
    assert done.exit_code == 0, done.output
    rows = {
        row["criterion"]: row
        for row in csv.DictReader((tmp_path / "speed.csv").read_text().splitlines())
    }
    limit = rows["train speed against 0.7 of the wave speed"]
    assert float(limit["highest_km_h"]) <= 0.7 * WAVE_SPEED < float(limit["fails_at_km_h"])
    assert float(limit["limit"]) == pytest.approx(0.7 * WAVE_SPEED)
    runs = json.loads((tmp_path / "speed.json").read_text())["runs"]
    speeds = [row[KEY] for row in runs if row["direction"] == FORWARD]
    scene = load_scene(CASE, shortened=True)
    length = line_of(scene).support_positions[-1]
    # The mirror image as a user writes it: the splice and the evaluated stretch at L - x.
    start = length - scene.evaluation.to_m
    mirrored = {
        "line.fittings": [{**SPLICE, "at_m": length - SPLICE["at_m"]}],
        "evaluation.from_m": start,
        "evaluation.to_m": length - scene.evaluation.from_m,
        "train.start_m": start - scene.evaluation.from_m + scene.train.start_m,
    }
    held = set(speeds)
    for way, changes in ((FORWARD, {"line.fittings": [SPLICE]}), (BACKWARD, mirrored)):
        own = [row for row in runs if row["direction"] == way]
        assert [row[KEY] for row in own] == speeds
        by_hand = catenary.sweep(catenary.load(CASE, short=True).replace(changes), {KEY: speeds})
        for row, (_, other) in zip(own, by_hand.iterrows(), strict=True):
            assert row["failed"] == other.failed
            # Lanes leave round-off alone.
            assert row["std_N"] == pytest.approx(other.std_N, abs=1e-8)
        held -= {row[KEY] for row in own if row["failed"]}
    assert float(rows[ALL]["holds_from_km_h"]) == min(held)
    assert float(rows[ALL]["highest_km_h"]) == max(held)
    assert (tmp_path / "speed.png").is_file() and not (tmp_path / "rows_so_far").exists()
    again = invoke(*words, "-o", str(tmp_path))
    assert again.exit_code == 2 and "is there already" in again.output


@pytest.mark.study
@pytest.mark.parametrize("case", [CASE, "ac_simple", "re330_stitched", "ambrosio2012"])
def test_speeds_of_shipped_cases_are_those_of_sweeps(case: str) -> None:
    """Each criterion at every 10 km/h from 200 to 320 km/h, from whole runs in both directions."""
    scene = catenary.load(case, short=True).replace({"line.fittings": [SPLICE]})
    table = catenary.highest_speeds(scene, 200, 320, within=10)
    speeds = [float(v) for v in range(200, 321, 10)]
    draft = read_draft(case, [ONE_SIDED], shortened=True)
    tables = turned(draft.scene()).model_dump(exclude_none=True, exclude_defaults=True)
    backward = catenary.load({**tables, "effects": draft.raw.get("effects", {})})
    runs = {
        way: catenary.sweep(own, {KEY: speeds}).set_index(KEY)
        for way, own in ((FORWARD, scene), (BACKWARD, backward))
    }

    def is_held(way: str, speed: float, name: str) -> bool:
        run: Any = runs[way].loc[[speed]].iloc[0]
        return run.outcome == "done" and not (run.failed if name == ALL else name in run.failed)

    def stretch(is_held: list[bool]) -> tuple[float, float] | None:
        """First stretch of neighbouring speeds going up."""
        if not any(is_held):
            return None
        begin = is_held.index(True)
        length = (is_held[begin:] + [False]).index(False)
        return speeds[begin], speeds[begin + length - 1]

    for row in table.to_dict("records"):
        name = row["criterion"]
        held = {way: [is_held(way, speed, name) for speed in speeds] for way in runs}
        both = [all(own) for own in zip(*held.values(), strict=True)]
        found = (
            None if np.isnan(row["highest_km_h"]) else (row["holds_from_km_h"], row["highest_km_h"])
        )
        assert found == stretch(both), name
        for way, own in held.items():
            first = stretch(own)
            highest = row[f"highest_{way}_km_h"]
            assert np.isnan(highest) if first is None else highest == first[1], (name, way)
        if not pd.isna(row["fails_at_km_h"]):
            place = speeds.index(row["fails_at_km_h"])
            failed = [way for way, own in held.items() if not own[place]]
            assert row["direction"] == (failed[0] if len(failed) == 1 else "both"), name
