"""A storm over the viaduct: bounded, refused or ended in a sentence, never "done" without one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from program import catenary

LINE = (
    "line.n_spans=14",
    "train.start_m=275",
    "evaluation.from_m=440",
    "evaluation.to_m=550",
    "mesh.elements_per_gap=4",
    "output.field_every_s=0",
)
# Strips of which no end is known: contact goes on however far a wire is blown.
ENDLESS = ("pantographs.three_masses.strips=",)


def run(folder: Path, speed: float, *more: str) -> tuple[int, str]:
    words = (*LINE, f"wind.speed_m_per_s={speed:g}", *more)
    ended = catenary("run", "windy_viaduct", "-o", folder, "--set", *words, cwd=folder.parent)
    return ended.returncode, ended.stdout + ended.stderr


def test_a_wire_that_the_wind_holds_beside_the_strips_is_refused(tmp_path: Path) -> None:
    code, text = run(tmp_path / "lost", 65.0)
    assert code == 2
    assert "at rest the contact wire stands beside the strips at 29" in text
    assert not (tmp_path / "lost" / "run.h5").exists()


def test_arms_that_are_pushed_are_told_and_a_march_that_they_end_ends(tmp_path: Path) -> None:
    code, text = run(tmp_path / "storm", 80.0, *ENDLESS)
    assert code == 1
    assert "is lifted by" in text and "of its length" in text
    summary = json.loads((tmp_path / "storm" / "summary.json").read_text())
    assert summary["outcome"] != "done" and summary["passed"] is None
    assert any("wires push 6 of 13 steady arms" in text for text in summary["remarks"])
    assert summary["watched"]["largest_arm_turn"] > 1.0


@pytest.mark.parametrize("verb", ["check", "static"])
def test_pushed_arms_are_told_before_a_run(verb: str, tmp_path: Path) -> None:
    words = (*LINE, "wind.speed_m_per_s=50")
    ended = catenary(verb, "windy_viaduct", "--set", *words, cwd=tmp_path)
    assert ended.returncode == 0
    assert "wires push 6 of 13 steady arms, the one at 660 m the most, with 13" in (
        ended.stdout + ended.stderr
    )
