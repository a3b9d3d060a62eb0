"""Remarks on what decides a result stand wherever a reader may look for the result."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from program import SHORT_SCENE, catenary

STIFF = "contact.stiffness_N_per_m=1e8"
SAYS = "does not resolve its hops"


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
