"""Exit codes and folders: --strict, results that are there already, folders that cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from program import catenary, short_run

# 310 km/h is 0.71 of the wave speed of the contact wire, 438 km/h: above the rule V <= 0.7 C.
TOO_FAST = ("train.speed_km_h=310",)


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_strict_exits_with_3_if_a_criterion_fails(tmp_path: Path) -> None:
    done = catenary(*short_run(tmp_path / "out", *TOO_FAST), "--strict", cwd=tmp_path)
    assert done.code == 3, done.stderr
    assert done.sentences == []
    assert "FAILED      train speed against 0.7 of the wave speed" in done.stdout
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    failed = [line["criterion"] for line in summary["acceptance"] if line["passed"] is False]
    assert "train speed against 0.7 of the wave speed" in failed
    assert summary["passed"] is False


def test_results_are_replaced_only_by_force(tmp_path: Path) -> None:
    """A run that passes is no error with --strict; nothing but --force touches its results."""
    out = tmp_path / "made" / "on the way"
    done = catenary(*short_run(out), "--strict", cwd=tmp_path)
    assert done.code == 0, done.stderr
    before = content(out)

    refused = catenary(*short_run(out, *TOO_FAST), cwd=tmp_path)
    assert refused.code == 2
    (sentence,) = refused.sentences
    assert str(out / "run.h5") in sentence and "--force" in sentence
    assert content(out) == before

    # Nor does a run that is refused for another reason, even with --force.
    impossible = catenary(*short_run(out), "--force", "--", "-march_ts_dt", "1", cwd=tmp_path)
    assert impossible.code == 2
    assert content(out) == before

    # Without --strict a criterion that fails is no error.
    replaced = catenary(*short_run(out, *TOO_FAST), "--force", cwd=tmp_path)
    assert replaced.code == 0, replaced.stderr
    assert json.loads((out / "summary.json").read_text())["speed_km_h"] == pytest.approx(310)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    done = catenary(*short_run(tmp_path / "file" / "out"), cwd=tmp_path)
    assert done.code == 2
    (sentence,) = done.stderr.splitlines()
    assert f"{tmp_path / 'file'} is no folder" in sentence
    assert content(tmp_path) == {"file": b"mine"}


def test_a_refused_folder_is_all_that_is_told(tmp_path: Path) -> None:
    """Warnings about a run that is not made would hide the refusal."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "run.h5").write_bytes(b"mine")
    refused = catenary(*short_run(out), cwd=tmp_path)
    assert refused.code == 2
    (sentence,) = refused.stderr.splitlines()
    assert "--force" in sentence
    made = catenary(*short_run(out), "--force", cwd=tmp_path)
    assert made.code == 0, made.stderr
    assert "WARNING" in made.stderr
