"""The programs of docs/python.md run, one after the other, as a reader would type them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from documents import blocks_of

PAGE = Path(__file__).parents[3] / "docs/python.md"
BLOCKS = [block for block in blocks_of(PAGE.read_text(encoding="utf-8")) if block.kind == "python"]


@pytest.mark.timeout(280)
def test_the_programs_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    told = []
    for block in BLOCKS:
        exec(compile(block.body, f"{PAGE.name}:{block.line}", "exec"), names)
        told.append(capsys.readouterr().out)
    session, before, run, task, swept, steps, states, _ = told
    assert session.splitlines()[0] == "250.0 275.0"
    assert {line.partition(" - ")[0] for line in session.splitlines()[1:]} == {
        "train.speed_km_h",
        "line.n_spans",
    }
    assert before.startswith("[]\nen50318_2002: ") and "length_m" in before
    assert "mean_N" in run and "\nTrue [" in run and "N Frozen({'time'" in run
    assert (tmp_path / "force.png").stat().st_size > 1000
    assert (tmp_path / "sigma.png").stat().st_size > 1000
    assert len(names["table"]) == 4 and len(names["rows"]) == 6 and len(task.splitlines()) == 7
    loads = [row[3] for row in names["rows"]]
    assert min(loads) > 50.0 and all(360.0 <= row[4] <= 600.0 for row in names["rows"])
    sigmas = [float(word) for word in re.findall(r"\d+\.\d+", swept.split("200 ")[1])]
    assert len(sigmas) == 4 and sigmas[0] < sigmas[2]  # more at 250 km/h
    assert steps.startswith("5.0 ") or steps.startswith("4.99")
    gains = [float(word) for word in re.findall(r"sigma (\S+) N", states)]
    assert len(gains) == 3 and len(set(gains)) == 3


def test_the_task_of_a_student_takes_no_more_than_it_says() -> None:
    """Variants, the picture of sigma and the worst dropper of each, in fifteen lines."""
    (task,) = (block.body for block in BLOCKS if "sigma.png" in block.body)
    assert len([line for line in task.splitlines() if line.strip()]) <= 15
