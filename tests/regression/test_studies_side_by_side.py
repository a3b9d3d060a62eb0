"""``-j`` of all studies but the sweep: the same tables as one run after the other."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest
from mpi4py import MPI
from program import SHORT_SCENE, catenary
from scenes import read_draft, shipped
from studies import few

from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.stability.map import Grid, make_map

pytestmark = pytest.mark.process
CASE = "en50318_2002"
STUDY = """
from catenary.cases.studies.case_study import StudyVariant
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.report.study_report import Reading, Study

def variants(scene, shortened):
    speeds = (240, 250, 260)
    return [StudyVariant(Variant(f"v{v}", (f"train.speed_km_h={v}",))) for v in speeds]

def measure(results):
    return {"largest_N": float(results.column("contact_force", 0).max())}

def conclude(runs):
    told = ", ".join(f"{name} {one.ended.measured['largest_N']!r}" for name, one in runs.items())
    return Study("Largest forces", told, [Reading("case", "as it is", [], [])])
"""
# Steps of twice the length: tables are the same or not whatever they are.
SET = ["--set", *SHORT_SCENE, "numerics.dt_s=2e-3"]
ACCURACY = ["--axes", "dt,dropper", "--quick", "--repeats", "2", "--target", "3%"]
# Words, table, and columns with times, which depend on the machine.
STUDIES = {
    "hard": (["hard", "undamped_line", "speed_0.7", "--short"], "hard.csv", ()),
    "cost": (
        ["plan", CASE, "--cost", "--only", "dropper_slackening", "--rounds", "1", *SET],
        "cost.csv",
        ("us_per_step", "cost", "advice"),
    ),
    "accuracy": (["accuracy", CASE, *ACCURACY, *SET], "accuracy.csv", ("march_s_per_s", "n_timed")),
    "study": (["run", "own", "--study", *SET], "study.csv", ("wall_s",)),
}


def table(path: Path, times: tuple[str, ...]) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{key: cell for key, cell in row.items() if key not in times} for row in rows]


@pytest.mark.parametrize(
    "study",
    few(STUDIES, "study"),
)
def test_tables_are_the_same_for_any_number_at_a_time(study: str, tmp_path: Path) -> None:
    words, name, times = STUDIES[study]
    (tmp_path / "own").mkdir()
    shutil.copy(shipped()[CASE], tmp_path / "own" / "case.toml")
    (tmp_path / "own" / "study.py").write_text(STUDY)
    found = []
    for out, n_jobs in (("one", []), ("two", ["-j", "2"])):
        done = catenary(*words[:2], "-o", out, *n_jobs, *words[2:], cwd=tmp_path)
        assert done.code in (0, 3), done.stderr
        found.append(table(tmp_path / out / name, times))
    assert found[0] == found[1]
    assert len(found[0]) > 1


@pytest.mark.study
def test_a_stability_map_is_the_same_in_two_processes(tmp_path: Path) -> None:
    grid = Grid((1e6, 1e7), (2.0,), (1e6,), (2.0,))
    one, two = (
        make_map(
            read_draft(CASE, (), True),
            MPI.COMM_SELF,
            grid,
            kept=KeptRows(tmp_path / str(n)),
            n_at_once=n,
        )
        for n in (1, 2)
    )
    assert one == two
    assert len(one.limits) == 2 * 4


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run", CASE, "-o", "out", "-j", "2"], "-j and --part belong to --study"),
        (["plan", CASE, "-j", "2"], "-j belongs to plan --cost"),
        (["sweep", CASE, "-o", "out", "-j", "-1"], "greater than or equal to 0"),
    ],
)
def test_many_at_a_time_where_there_is_one_run_is_refused(
    words: list[str], told: str, tmp_path: Path
) -> None:
    done = catenary(*words, cwd=tmp_path)
    assert done.code == 2 and told in done.stderr, done.stderr
    assert not (tmp_path / "out").exists()
