"""A sweep that is stopped under way says so, and the same command does the rest."""

from __future__ import annotations

import csv
import signal
from pathlib import Path

import pytest
from program import SHORT_SCENE, catenary, catenary_started, n_rows

SPEEDS = ("250", "275", "300")


def words(out: Path) -> list[str]:
    vary = f"train.speed_km_h={','.join(SPEEDS)}"
    return ["sweep", "en50318_2002", "-o", str(out), "--vary", vary, "--set", *SHORT_SCENE]


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.study)]
)
def test_a_stopped_sweep_is_continued_by_the_same_command(
    number: signal.Signals, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    first, second, third = (out / f"speed_km_h_{speed}" for speed in SPEEDS)
    with catenary_started(*words(out), cwd=tmp_path) as program:
        program.wait_for(lambda: n_rows(second / "run.h5") > 0)
        program.send(number)
        stopped = program.end()
    assert (first / "variant.json").exists() and not (second / "variant.json").exists()
    assert not third.exists()
    if number == signal.SIGINT:
        assert stopped.code == 1
        assert stopped.sentences == [
            "catenary: the sweep was interrupted; the same command continues it"
        ]
    before = (first / "run.h5").stat().st_mtime_ns

    done = catenary(*words(out), cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert done.stdout.count(": done already") == 1
    assert (first / "run.h5").stat().st_mtime_ns == before
    with (out / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["train.speed_km_h"] for row in rows] == list(SPEEDS)
    assert all(row["outcome"] == "done" and float(row["std_N"]) > 0 for row in rows)
