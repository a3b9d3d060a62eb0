"""A case that ``catenary new`` writes runs, of every kind of line."""

from __future__ import annotations

from pathlib import Path

import pytest
from program import assert_sound, catenary
from studies import few

from catenary.cases.scene.starter import BEGINNINGS


@pytest.mark.parametrize("kind", few(BEGINNINGS, "simple", "single", "conductor_rail"))
def test_a_new_case_runs_when_shortened(tmp_path: Path, kind: str) -> None:
    made = catenary("new", "my_line", "--topology", kind, cwd=tmp_path)
    assert made.code == 0, made.stderr
    # What it says to try is what is tried.
    line = next(line for line in made.stdout.splitlines() if " run " in line)
    done = catenary(*line.split()[1:], cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert_sound(tmp_path / "my_line" / "results" / "run.h5")
