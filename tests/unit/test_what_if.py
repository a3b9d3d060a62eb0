"""``catenary what-if``: differences against two runs by hand, and times that droppers are slack."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from verb_runner import invoke

import catenary
from catenary.cases.studies.questions.what_if import AS_IT_IS, CHANGED, _pairs
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
CHANGE = "train.speed_km_h=320"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """At 320 km/h the deviation and the speed fail, which pass as it is."""
    out = tmp_path_factory.mktemp("what_if")
    done = invoke("what-if", CASE, "--short", "--set", CHANGE, "-o", str(out))
    assert done.exit_code == 0, done.output
    (out / "said.txt").write_text(done.output)
    return out


def rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_differences_are_those_of_runs_by_hand(folder: Path) -> None:
    scene = catenary.load(CASE, short=True)
    before, after = catenary.run(scene), catenary.run(scene.replace(train={"speed_km_h": 320}))
    table = {row["statistic"]: row for row in rows(folder / "statistics.csv")}
    for label, name in (
        ("mean contact force [N]", "mean_N"),
        ("standard deviation, 0-20 Hz [N]", "std_N"),
        ("minimum force [N]", "min_N"),
        ("contact point, vertical range [mm]", "contact_height_range_mm"),
    ):
        a, b = before.statistics[name].iloc[0], after.statistics[name].iloc[0]
        # The same runs: nothing but the digits of a file lies between.
        assert float(table[label][AS_IT_IS]) == pytest.approx(a, rel=1e-12)
        assert float(table[label]["difference"]) == pytest.approx(b - a, abs=1e-9)
    uplift = [run.summary["supports"]["per_support"] for run in (before, after)]
    found = rows(folder / "supports.csv")
    assert len(found) == len(uplift[0])
    for row, a, b in zip(found, *uplift, strict=True):
        assert float(row["x_m"]) == a["x_m"] == b["x_m"]
        assert float(row["uplift_mm_difference"]) == pytest.approx(
            b["max_uplift_mm"] - a["max_uplift_mm"], abs=1e-9
        )


def test_verdicts_that_turn_are_told(folder: Path) -> None:
    turned = {
        row["criterion"]
        for row in rows(folder / "verdicts.csv")
        if (row["verdict_as_it_is"], row["verdict_changed"]) == ("passed", "failed")
    }
    assert turned == {
        "standard deviation, 0.3 of the mean", "train speed against 0.7 of the wave speed",
    }  # fmt: skip
    said = (folder / "said.txt").read_text()
    for name in turned:
        assert f"{name}: passed as it is, failed with the change" in said
    page = (folder / "what_if.html").read_text()
    assert "Uplift by support" in page and page.count("data:image/png") == 2


def test_what_one_run_alone_has_is_told(tmp_path: Path) -> None:
    """Figures and verdicts of a second pantograph, which hops behind the first one."""
    pair = 'train.pantographs=[{name="reference"},{name="reference",behind_m=60}]'
    said = invoke("what-if", CASE, "--short", "--set", pair, "-o", str(tmp_path)).output
    fails = "standard deviation, 0.3 of the mean, trailing: no such criterion as it is, failed"
    assert fails in said and "trailing: passed" not in said
    found = {row["criterion"]: row for row in rows(tmp_path / "verdicts.csv")}
    assert found["maximum contact force"]["verdict_changed"] == "no such criterion"
    (row,) = [
        row
        for row in rows(tmp_path / "statistics.csv")
        if row["of"] == "trailing" and row["statistic"] == "standard deviation, 0-20 Hz [N]"
    ]
    assert not row[AS_IT_IS] and not row["difference"] and float(row[CHANGED]) > 40.0


def test_times_slack_are_counted_from_the_record(folder: Path) -> None:
    table = rows(folder / "droppers.csv")
    for name in (AS_IT_IS, CHANGED):
        with Results(folder / name) as results:
            force = results.channel("dropper_force")
            by_hand = results.dt * results.line_record.every * (force <= 0.0).sum(axis=0)
            np.testing.assert_allclose(slack_times(results), by_hand, atol=1e-9)
            assert by_hand.max() > 0.1
        told = [float(row[f"slack_s_{name}"]) for row in table]
        np.testing.assert_allclose(told, by_hand, atol=1e-9)
        slack = [float(row[f"min_N_{name}"]) <= 0.0 for row in table]
        assert slack == [value > 0.0 for value in by_hand]


def test_places_are_paired_one_to_one() -> None:
    first, second = np.array([0.0, 5.0, 5.0, 9.0]), np.array([5.0, 5.0 + 1e-9, 8.0])
    assert _pairs(first, second) == [(1, 0), (2, 1)]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "nothing is changed"),
        (["--set", "line.spam_m=50"], "did you mean line.span_m"),
        (["--set", "train.speed_km_h=-1"], "train.speed_km_h"),
    ],
)
def test_what_changes_nothing_or_is_wrong_is_refused(words: list[str], told: str) -> None:
    done = invoke("what-if", CASE, *words)
    assert done.exit_code == 2 and told in done.output


def test_without_a_folder_nothing_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    done = invoke("what-if", CASE, "--short", "--set", "train.speed_km_h=240")
    assert done.exit_code == 0 and "Uplift at" in done.output
    assert not list(tmp_path.iterdir())
