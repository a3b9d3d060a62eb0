"""Remarks on what decides a result stand wherever a reader may look for the result."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from program import SHORT_SCENE, catenary

STIFF = "contact.stiffness_N_per_m=1e8"
SAYS = "does not resolve its hops"


@pytest.mark.study
def test_remarks_are_told_wherever_results_are(tmp_path: Path) -> None:
    run = tmp_path / "run"
    ended = catenary(
        "run", "en50318_2002", "-o", str(run), "--set", *SHORT_SCENE, STIFF, cwd=tmp_path
    )
    assert ended.code == 0
    assert SAYS in ended.stdout
    remarks = json.loads((run / "summary.json").read_text())["remarks"]
    assert any(SAYS in text for text in remarks)
    assert SAYS in (run / "report.html").read_text()
    compared = catenary("compare", str(run), str(run), cwd=tmp_path)
    assert f"A: {next(text for text in remarks if SAYS in text)}" in compared.stdout
    vary = ("--vary", "contact.stiffness_N_per_m=1e8")
    swept = catenary(
        "sweep", "en50318_2002", "-o", "sweep", "--set", *SHORT_SCENE, *vary, cwd=tmp_path
    )
    assert SAYS in swept.stdout
    with (tmp_path / "sweep" / "sweep.csv").open(encoding="utf-8") as file:
        assert all(SAYS in row["remarks"] for row in csv.DictReader(file))
    waves = catenary("waves", "en50318_2002", "-o", "w", "--set", *SHORT_SCENE, STIFF, cwd=tmp_path)
    assert [line for line in waves.stdout.splitlines() if SAYS in line][0].startswith("REMARK  ")
    again = catenary("waves", "w", cwd=tmp_path)
    assert again.stdout == waves.stdout


def test_a_study_of_accuracy_names_the_levels_that_a_remark_is_of(tmp_path: Path) -> None:
    options = ("--axes", "dt", "--quick", "--repeats", "1", "-o", "study")
    studied = catenary(
        "accuracy", "en50318_2002", *options, "--set", *SHORT_SCENE, STIFF, cwd=tmp_path
    )
    assert studied.code == 0, studied.stderr
    with (tmp_path / "study" / "accuracy.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 and all(SAYS in row["remarks"] for row in rows)
    page = (tmp_path / "study" / "accuracy.md").read_text()
    for level in ("0.25 ms", "1 ms", "2 ms"):  # the first is part of how good the reference is
        step = f"a step of {level} {SAYS}"
        for text in (studied.stdout, page):
            assert any(f"dt {level}: " in line and step in line for line in text.splitlines())


@pytest.mark.study
def test_hard_cases_tell_what_their_marches_tell(tmp_path: Path) -> None:
    done = catenary("hard", "lost_over_spans", "--short", "-o", "hard", cwd=tmp_path)
    assert done.code == 0, done.stdout
    says = "has not touched a wire for more than a span"
    assert "REMARK      lost_over_spans, lost_over_spans" in done.stdout
    for text in (done.stdout, (tmp_path / "hard" / "hard.md").read_text()):
        assert "lost_over_spans at half the step: The pantograph" in text and says in text
    with (tmp_path / "hard" / "hard.csv").open(encoding="utf-8") as file:
        (row,) = [row for row in csv.DictReader(file) if row["criterion"] == "remarks"]
    assert int(row["value"]) >= 2 and says in row["note"]
