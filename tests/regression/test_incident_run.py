"""A run with incidents as a user makes it: told, continued from anywhere, on any ranks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from program import MPIRUN, SHORT_SCENE, assert_same_histories, short_run
from program import catenary as called
from scenes import with_words

import catenary
from catenary.postproc.read.results import Results

INCIDENTS = (
    "incidents=[{type='dropper_break',at_s=0.6,span=4,dropper=2},"
    "{type='tension_loss',at_s=1.0,wire='messenger_wire',share=0.9},"
    "{type='lowering',at_s=1.5,drop_m=0.2}]"
)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory, quick_reports: None) -> Path:
    out = tmp_path_factory.mktemp("whole") / "out"
    catenary.run(with_words("en50318_2002", (*SHORT_SCENE, INCIDENTS)), out).close()
    return out


def test_incidents_are_told(uninterrupted: Path) -> None:
    with catenary.open(uninterrupted) as run:
        summary = run.summary
    assert [(fact["type"], fact["time_s"]) for fact in summary["incidents"]] == [
        ("dropper_break", pytest.approx(0.6)),
        ("tension_loss", pytest.approx(1.0)),
        ("lowering", pytest.approx(1.5)),
    ]
    assert set(summary["effects_on"]) >= {"dropper_break", "tension_loss", "lowering"}
    report = (uninterrupted / "report.html").read_text()
    # The evaluated stretch, 180 to 240 m, is run through from 0.86 to 1.73 s: all three count.
    assert report.count("statistics of the evaluated stretch include") == 3
    assert "incident at 0.6\xa0s" in report


def test_rows_are_whole_and_show_what_happened(uninterrupted: Path) -> None:
    with catenary.open(uninterrupted) as run:
        assert run.outcome == "done"
        hung = run.channel("dropper_force").sel(dropper=190.5, method="nearest")
        time, dropper, force = hung.time.values, hung.values, run.force.values[:, 0]
    assert np.diff(time) == pytest.approx(1e-3)
    assert dropper[600] > 10.0 and not dropper[601:].any()
    # The wire comes down behind the head, and may touch it once more while both fall.
    last = time[np.flatnonzero(force)[-1]]
    print(f"last contact at {last:.3f} s")
    assert 1.6 < last < 1.9


@pytest.mark.parametrize(
    ("steps", "ranks", "ranks_of_restart"),
    [
        (300, 1, 1),
        pytest.param(600, 1, 2, marks=pytest.mark.study),
        pytest.param(1000, 2, 1, marks=pytest.mark.study),
        pytest.param(1700, 1, 1, marks=pytest.mark.study),
    ],
)
def test_an_interrupted_run_is_continued(
    steps: int, ranks: int, ranks_of_restart: int, tmp_path: Path, uninterrupted: Path
) -> None:
    """Before, at and after incidents; PETSc's own limit of steps holds across them."""
    if max(ranks, ranks_of_restart) > 1 and MPIRUN is None:
        pytest.skip("there is no mpirun")
    out = tmp_path / "out"
    words = [*short_run(out, INCIDENTS), "--", "-march_ts_max_steps", str(steps)]
    done = called(*words, cwd=tmp_path, ranks=ranks)
    assert done.code == 1, done.stderr
    with Results(out) as results:
        assert results.outcome == "interrupted"
        assert results.n_steps == steps == results.checkpoint["step"]
    # With pictures, which ranks have nowhere else.
    words = ["restart", str(out)]
    again = called(*words, cwd=tmp_path, ranks=ranks_of_restart, pictures=ranks_of_restart > 1)
    assert again.code == 0, again.stderr
    smallest = min(path.stat().st_size for path in out.glob("*.png"))
    assert (smallest > 1000) is (ranks_of_restart > 1)
    assert_same_histories(out, uninterrupted)
