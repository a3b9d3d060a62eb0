"""``catenary separation``: the same figures as runs by hand, and as the published table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scenes import load_scene
from verb_runner import invoke

import catenary
from catenary.cases.studies.asked import Distances
from catenary.cases.studies.questions.separation import (
    Period,
    SeparationStudy,
    as_text,
    period_of,
    variant_of,
)
from catenary.cases.studies.waves.theory import WaveTheory
from catenary.postproc.report.study_table import Row
from catenary.solver.waves.bloch import BlochWaves

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"


def test_distances_are_even_and_end_in_the_range() -> None:
    assert Distances(31, 41, 4).values() == [31, 35, 39]
    assert Distances(31, 32, 0.1).values() == pytest.approx(np.linspace(31, 32, 11))
    assert len(Distances().values()) == 370


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--from", "50", "--to", "40"], "is no range of distances"),
        (["--to", "1500"], "is no range of distances"),
        (["--step", "0"], "at least 0.001 m"),
        (["--from", "100", "--to", "100.001", "--step", "0.0005"], "at least 0.001 m"),
        (["--step", "0.01"], "more than 2000"),
        (["--from", "nan"], "is no range of distances"),
        (["--step", "nan"], "at least 0.001 m"),
    ],
)
def test_what_is_no_range_is_refused(words: list[str], told: str) -> None:
    done = invoke("separation", CASE, *words)
    assert done.exit_code == 2 and told in done.output


def test_each_distance_has_a_run_of_its_own() -> None:
    """Runs are kept by their names, which six digits do not tell apart here."""
    scene, distances = load_scene(CASE), Distances(100.0005, 100.0105, 0.001).values()
    assert len({variant_of(scene, one).name for one in distances}) == len(distances) == 11


def test_the_train_ends_as_much_later_as_it_is_longer() -> None:
    scene = load_scene(CASE, ["train.end_m=900"])
    assert variant_of(scene, 50.0).assignments[:2] == (
        "train.start_m=140", "train.end_m=950",
    )  # fmt: skip


def pair(
    at: float | None, leading: float, trailing: float | None, *failed: str, outcome: str = "done"
) -> Row:
    row = {"separation_m": at, "outcome": outcome, "max_uplift_mm": 50.0, "remarks": []}
    return row | {"std_leading_N": leading, "std_trailing_N": trailing, "failed": [*failed]} | {
        f"{name}_{place}_{unit}": 0.0
        for name, unit in (("min", "N"), ("loss", "percent"))
        for place in ("leading", "trailing")
    }  # fmt: skip


def test_the_worse_pantograph_decides_and_failing_stretches_are_joined() -> None:
    rows = [
        pair(None, 20.0, None),
        pair(30, 20.0, 40.0, "arcing"),
        pair(40, 20.0, 41.0, "arcing"),
        pair(50, 39.0, 10.0),
        pair(60, 70.0, 20.0, "arcing"),
        pair(70, 0.0, 0.0, outcome="is too far"),
    ]
    study = SeparationStudy("case", "kind", 250.0, rows)
    ranked = study.by_deviation
    assert [row["separation_m"] for row in ranked] == [50, 30, 40, 60]
    nowhere = Period(np.nan, np.nan, np.full(2, np.nan), 91.0)
    text = as_text(study, nowhere)
    assert "arcing: at 30-40, 60 m" in text
    assert "1 of 5 distances could not be run, the first is 70 m: is too far" in text
    assert (
        "fewer than 12 distances; waves from the leading one repeat every 91 m." in text
        and "nan" not in text
    )


SPEED, WAVES, SPAN = 80.0, 120.0, 50.0
BAND = (1.0, 1.25)


def theory() -> WaveTheory:
    frequency = np.array([[BAND[0]], [BAND[1]]])
    empty = np.zeros((2, 1, 0), dtype=complex)
    waves = BlochWaves(SPAN, np.array([0.0, np.pi]), frequency, frequency, empty, np.zeros(0))
    return WaveTheory(SPEED, WAVES, (), 0.2, 0.4, 2.0, waves, "")


@pytest.mark.parametrize("period", [45.0, 72.0])
def test_a_period_is_found_in_a_decaying_curve(period: float) -> None:
    d = np.linspace(31.0, 400.0, 40)
    sigma = 60.0 + 30.0 * np.exp(-d / 250.0) * np.sin(2 * np.pi * d / period + 0.7)
    found = period_of(d, sigma, theory(), SPAN)
    # Reaches of the fit are not that of the curve.
    assert found.fitted == pytest.approx(period, rel=0.02) and found.explains > 0.98
    np.testing.assert_allclose(found.ringing, [SPEED / BAND[1], SPEED / BAND[0]])
    assert found.travel == pytest.approx(SPAN * (WAVES + SPEED) / WAVES)
    assert np.isnan(period_of(d[:5], sigma[:5], theory(), SPAN).fitted)
    study = SeparationStudy("case", "kind", 250.0, [pair(None, 1.0, None), pair(30, 1.0, 2.0)])
    assert f"A period of {period:.0f} m explains" in as_text(study, found)


def test_a_period_that_chance_explains_is_none() -> None:
    """A fit of six numbers to 13 without a period, of which some 60 % are explained."""
    d, rng = np.linspace(50.0, 110.0, 13), np.random.default_rng(3)
    found = [period_of(d, 40.0 + 8.0 * rng.normal(size=d.size), theory(), SPAN) for _ in range(20)]
    # One of 20 is expected by chance, with a standard deviation of one.
    assert sum(np.isfinite(one.fitted) for one in found) <= 4
    none = next(one for one in found if np.isnan(one.fitted))
    study = SeparationStudy("case", "kind", 250.0, [pair(None, 1.0, None), pair(30, 1.0, 2.0)])
    assert "No period from 10 to 30 m, which these distances can show" in as_text(study, none)


def test_a_smooth_curve_without_a_period_has_none() -> None:
    """Deviations at neighbouring distances are alike: a line, and sums of waves of all lengths
    above some 40 m, whose power has no peak."""
    d, rng = np.linspace(31.0, 400.0, 42), np.random.default_rng(4)
    assert np.isnan(period_of(d, 50.0 - 0.02 * d, theory(), SPAN).fitted)
    alike = np.linalg.cholesky(np.exp(-(((d[:, None] - d) / 20.0) ** 2)) + 1e-9 * np.eye(d.size))
    curves = [40.0 + 8.0 * alike @ rng.normal(size=d.size) for _ in range(20)]
    found = [period_of(d, one, theory(), SPAN).fitted for one in curves]
    assert np.count_nonzero(np.isfinite(found)) <= 4


@pytest.mark.study
def test_the_command_agrees_with_runs_by_hand(tmp_path: Path) -> None:
    """300 m is refused there: the leading one would start in the evaluated stretch."""
    words = ["separation", CASE, "--short", "--from", "60", "--to", "300", "--step", "120"]
    done = invoke(*words, "-o", str(tmp_path))
    assert done.exit_code == 0, done.output
    assert "could not be run, the first is 300 m: evaluation.from_m" in done.output
    alone, near, far, refused = csv.DictReader(
        (tmp_path / "separation.csv").read_text().splitlines()
    )
    assert refused["outcome"] != "done" and not refused["std_leading_N"]
    scene = catenary.load(CASE, short=True)
    start = scene["train.start_m"]
    single = catenary.run(scene)
    # Lanes leave round-off alone.
    std = single.statistics.std_N.iloc[0]
    assert float(alone["std_leading_N"]) == pytest.approx(std, abs=1e-8)
    for row, distance in ((near, 60.0), (far, 180.0)):
        both = [{"name": "reference"}, {"name": "reference", "behind_m": distance}]
        run = catenary.run(scene.replace(train={"start_m": start + distance, "pantographs": both}))
        for place, name in enumerate(("leading", "trailing")):
            by_hand = run.statistics.iloc[place]
            assert float(row[f"std_{name}_N"]) == pytest.approx(by_hand.std_N, abs=1e-8)
            assert float(row[f"min_{name}_N"]) == pytest.approx(by_hand.min_N, abs=1e-8)
        uplift = run.summary["supports"]["max_uplift_mm"]
        assert float(row["max_uplift_mm"]) == pytest.approx(uplift, abs=1e-8)
    record = json.loads((tmp_path / "separation.json").read_text())
    worse = {float(r["separation_m"]): float(r["std_trailing_N"]) for r in (near, far)}
    assert record["worst_separation_m"] == max(worse, key=lambda at: worse[at])
    # 250 km/h over the lowest pass band; 69.4 m/s and 121.7 m/s on spans of 60 m.
    assert record["travel_m"] == pytest.approx(60 * (1 + 250 / 3.6 / np.sqrt(20e3 / 1.35)))
    low, high = record["ringing_m"]
    assert 40 < low < high < 100 and record["fitted_period_m"] is None
    assert (tmp_path / "separation.png").is_file()


@pytest.mark.study
@pytest.mark.parametrize(
    ("alpha", "published"),
    [
        (0.00275, {63: 108.2, 200: 81.9}),
        (0.0275, {63: 85.6, 200: 66.4}),
    ],
)
def test_the_papers_line_gives_what_the_page_on_waves_shows(
    alpha: float, published: dict[int, float]
) -> None:
    """Deviation of the trailing pantograph; printed to 0.1 N."""
    changes = {
        "line.damping.alpha_s": alpha, "line.n_spans": 46, "train.start_m": 400,
        "evaluation.from_m": 1126, "evaluation.to_m": 1558,
    }  # fmt: skip
    scene = catenary.load("ambrosio2012").replace(changes)
    table = catenary.separations(scene, 63, 200, step=137).set_index("separation_m")
    for distance, sigma in published.items():
        assert table.std_trailing_N[distance] == pytest.approx(sigma, abs=0.051)
