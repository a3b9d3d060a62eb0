"""Every shipped case, found from its folder, runs end to end; published figures are met."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import pytest
from program import assert_sound
from program import catenary as called
from scenes import shipped

import catenary

CASES = shipped()
# One of each kind of line is run with every test, all of them in whole studies.
OF_EACH_KIND = ("ambrosio2012", "en50318_2002", "ac_simple_3d", "overlap", "re330_stitched")
ALL_CASES = [
    pytest.param(case, marks=() if case in OF_EACH_KIND else pytest.mark.study) for case in CASES
]
FILES = {"run.h5", "fields.xdmf", "fields.h5", "summary.json", "report.html"}

# What other programs rely on in summary.json: keys and the kind of their values.
NUMBER = (int, float)
TOP = {
    "case": str,
    "speed_km_h": NUMBER,
    "n_dofs": int,
    "n_ranks": int,
    "n_steps": int,
    "dt_s": NUMBER,
    "simulated_s": NUMBER,
    "march_wall_s": NUMBER,
    "march_cpu_s": NUMBER,
    "records_wall_s": NUMBER,
    "real_time_factor": NUMBER,
    "real_time_factor_with_records": NUMBER,
    "phase_wall_s": dict,
    "evaluation_m": list,
    "pantographs": list,
    "supports": dict,
    "droppers": dict,
    "static": dict,
    "acceptance": list,
}
PANTOGRAPH = dict.fromkeys(
    [
        "mean_N",
        "std_N",
        "std_0_5_N",
        "std_5_20_N",
        "max_N",
        "min_N",
        "stat_max_N",
        "stat_min_N",
        "loss_percent",
        "contact_height_range_mm",
    ],
    NUMBER,
)
DROPPERS = {"n_slackened": int, "max_force_N": NUMBER, "min_force_N": NUMBER}
CRITERION = {"criterion": str, "value": NUMBER, "limit": NUMBER, "passed": bool}

# Rows of cases/en50318_2002/reference/accepted_ranges.csv and where summary.json has them.
QUANTITIES = {
    "mean": "mean_N",
    "standard_deviation": "std_N",
    "statistical_maximum": "stat_max_N",
    "statistical_minimum": "stat_min_N",
    "maximum": "max_N",
    "minimum": "min_N",
    "loss_of_contact": "loss_percent",
}
# A run that repeats the same operations on another processor or with another BLAS differs by
# round-off, 1e-10 at most (tests/support/rank_histories.py); the figures are filtered means.
GOLDEN = 1e-6
# benchmarks of ten codes: dropper lengths within 5 mm of the nominal ones.
LENGTH = 5e-3


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file with comments."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def run(folder: Path, *words: str) -> dict[str, Any]:
    """Summary of a run into a folder."""
    # A phase that takes long leaves a line on standard error otherwise.
    done = called("run", *words, "-o", str(folder), "--quiet", cwd=folder.parent, pictures=True)
    assert done.code == 0, done.stderr
    assert done.stderr == ""
    return dict(json.loads((folder / "summary.json").read_text()))


@pytest.fixture(scope="module")
def shortened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, dict[str, Any]]]:
    """Folder and summary of every case, each run once when first asked for."""

    class Runs(dict[str, tuple[Path, dict[str, Any]]]):
        def __missing__(self, case: str) -> tuple[Path, dict[str, Any]]:
            folder = tmp_path_factory.mktemp(case) / "out"
            self[case] = (folder, run(folder, case, "--short"))
            return self[case]

    return Runs()


def assert_kinds(found: dict[str, Any], kinds: dict[str, Any]) -> None:
    for key, kind in kinds.items():
        assert isinstance(found[key], kind), f"{key} is {found[key]!r}"
        if kind == NUMBER:
            assert math.isfinite(found[key]), key


@pytest.mark.parametrize("case", ALL_CASES)
def test_every_case_runs_and_is_judged(case: str, shortened: Any) -> None:
    folder, summary = shortened[case]
    scene = catenary.load(case, short=True)
    assert {path.name for path in folder.iterdir()} >= FILES
    assert any(path.suffix == ".png" for path in folder.iterdir())
    assert_sound(folder / "run.h5")

    assert_kinds(summary, TOP)
    assert summary["case"] == scene.name
    assert summary["speed_km_h"] == pytest.approx(scene["train.speed_km_h"], rel=1e-12)
    assert summary["n_ranks"] == 1
    assert summary["n_steps"] * summary["dt_s"] == pytest.approx(summary["simulated_s"], rel=1e-9)
    assert set(summary["phase_wall_s"]) >= {"mesh", "equilibrium", "prepare solver", "march"}
    assert summary["evaluation_m"] == [scene[f"evaluation.{end}_m"] for end in ("from", "to")]

    assert len(summary["pantographs"]) == len(scene["train.pantographs"])
    for pantograph in summary["pantographs"]:
        assert_kinds(pantograph, PANTOGRAPH)
        assert pantograph["min_N"] < pantograph["mean_N"] < pantograph["max_N"]
        assert pantograph["std_N"] > 0.0

    supports = summary["supports"]
    uplifts = [row["max_uplift_mm"] for row in supports["per_support"] if row["evaluated"]]
    assert supports["max_uplift_mm"] == max(uplifts) > 0.0
    lengths = summary["static"]["dropper_lengths_m"]
    if scene["line.dropper"] is None:
        assert summary["droppers"]["n_slackened"] == 0 and lengths == []
    else:
        assert_kinds(summary["droppers"], DROPPERS)
        assert len(lengths) > 0 and min(lengths) > 0.0
    assert_kinds(summary["static"]["elasticity_mm_per_N"], {"max": NUMBER, "min": NUMBER})

    assert len(summary["acceptance"]) > 0
    for line in summary["acceptance"]:
        assert_kinds(line, CRITERION)
    assert summary["passed"] is all(line["passed"] for line in summary["acceptance"])
    assert summary["complaints"] == []


@pytest.mark.parametrize("case", ALL_CASES)
def test_shortened_cases_keep_their_golden_numbers(case: str, shortened: Any) -> None:
    rows = [row for row in table(Path(__file__).with_name("golden.csv")) if row["case"] == case]
    assert rows, f"golden.csv lacks {case}: run golden.py"
    _, summary = shortened[case]
    assert [row["pantograph"] for row in rows] == [p["name"] for p in summary["pantographs"]]
    for row, found in zip(rows, summary["pantographs"], strict=True):
        for name in ("mean_N", "std_N"):
            expected = float(row[name])
            print(f"{case} {name}: {found[name]:.9g}, expected {expected:.9g}, since {row['date']}")
            assert found[name] == pytest.approx(expected, rel=GOLDEN), row["reason"]


@pytest.mark.parametrize("speed", [pytest.param("250", marks=pytest.mark.study), "300"])
def test_en50318_meets_every_accepted_range(speed: str) -> None:
    path = CASES["en50318_2002"].parent / "reference" / "accepted_ranges.csv"
    ranges = [row for row in table(path) if row["speed_km_h"] == speed]
    assert {row["quantity"] for row in ranges} == {*QUANTITIES, "support_uplift"}
    scene = catenary.load("en50318_2002").replace(train={"speed_km_h": int(speed)})
    summary = catenary.run(scene).summary
    (pantograph,) = summary["pantographs"]
    outside = []
    for row in ranges:
        quantity = row["quantity"]
        uplift = quantity == "support_uplift"
        value = summary["supports"]["max_uplift_mm"] if uplift else pantograph[QUANTITIES[quantity]]
        low, high = float(row["lower"]), float(row["upper"])
        print(
            f"{quantity} at {speed} km/h: {value:.4g}, accepted {low:g} to {high:g} {row['unit']}"
        )
        if not low <= value <= high:
            outside.append(quantity)
    assert outside == []


def test_ac_simple_finds_the_nominal_dropper_lengths() -> None:
    """In every span between two supports; the first and the last one hang from an anchor."""
    path = CASES["ac_simple"].parent / "reference" / "dropper_lengths.csv"
    nominal = {float(row["position_m"]): float(row["length_m"]) for row in table(path)}
    rows = catenary.static("ac_simple").droppers
    n_spans = catenary.load("ac_simple")["line.n_spans"]
    assert len(rows) == len(nominal) * n_spans
    inner = rows[(rows.span > 1) & (rows.span < n_spans)]
    expected = inner.in_span_m.round(6).map(nominal.__getitem__)
    worst = (inner.length_m - expected).abs().max()
    print(f"largest difference {1e3 * worst:.1f} mm, allowed {1e3 * LENGTH:.0f} mm")
    assert worst < LENGTH
