"""The paper's study in its short form: run, continued, and its report read back."""

from __future__ import annotations

import csv
import html
import json
import math
import re
from pathlib import Path

import pytest
from program import catenary

from catenary import open as open_run

pytestmark = pytest.mark.study

# Coarse: what is tested is the study, not its figures.
COARSE = ("mesh.elements_per_gap=2", "numerics.dt_s=0.002")


def words(out: Path) -> list[str]:
    return ["run", "ambrosio2012", "--study", "--short", "-o", str(out), "--set", *COARSE]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a short study and what was said."""
    out = tmp_path_factory.mktemp("study") / "out"
    ran = catenary(*words(out), cwd=out.parent, pictures=True)
    assert ran.code == 0, ran.stderr
    return out, ran.stdout


def test_remarks_on_runs_are_told_with_those_that_they_are_of(done: tuple[Path, str]) -> None:
    out, said = done
    with (out / "study.csv").open(encoding="utf-8") as file:
        remarks = {row["variant"]: row["remarks"] for row in csv.DictReader(file)}
    told = [line for line in said.splitlines() if line.startswith("REMARK")]
    assert any(remarks.values()) and told
    for line in told:
        whose, text = line.split(maxsplit=1)[1].split(": ", 1)
        names = list(remarks) if whose.startswith("all ") else whose.split(", ")
        assert all(text in remarks[name] for name in names), line


def test_every_statement_has_a_verdict_under_every_reading(done: tuple[Path, str]) -> None:
    out, said = done
    page = html.unescape((out / "study.html").read_text())
    # Units are kept within a line.
    page = re.sub(r"</?span[^>]*>", "", page).replace("\N{NO-BREAK SPACE}", " ")
    study = json.loads((out / "study.json").read_text())
    assert [reading["name"] for reading in study["readings"]] == ["case", "best", "smooth"]
    for reading in study["readings"]:
        assert [one["number"] for one in reading["findings"]] == list(range(1, 10))
        for one in reading["findings"]:
            assert one["verdict"] in ("reproduced", "not reproduced", "cannot be decided")
            assert one["found"]
    for one in study["readings"][0]["findings"]:
        assert one["verdict"] != "not reproduced" or one["reason"]
        assert f"{one['number']:2}. {one['verdict']}" in said
        assert one["statement"].split("<")[0] in page
    # Without the train of 200 m the two statements about it are open.
    assert [study["readings"][0]["findings"][i]["verdict"] for i in (2, 7)] == [
        "cannot be decided"
    ] * 2
    # Eq. (1.1) without its first term: 441.5 km/h.
    critical = 3.6 * math.sqrt(20000.0 / 1.33)
    assert study["readings"][0]["findings"][8]["found"].startswith(
        f"light, single: wave speed [km/h] {critical:.1f}"
    )


def test_figures_show_what_the_runs_hold(done: tuple[Path, str]) -> None:
    out, _ = done
    for number in range(8, 15):
        assert (out / f"figure_{number:02}.png").read_bytes().startswith(b"\x89PNG")
        assert (out / f"figure_{number:02}.csv").stat().st_size > 0
    with (out / "figure_09.csv").open() as file:
        rows = {(row["damping"], row["pantograph"]): row for row in csv.DictReader(file)}
    assert set(rows) == {
        (damping, pantograph)
        for damping in ("light", "average")
        for pantograph in ("single", "31m leading", "31m trailing")
    }
    summary = json.loads((out / "runs" / "case__light__31m" / "summary.json").read_text())
    trailing = rows["light", "31m trailing"]
    assert float(trailing["deviation [N]"]) == pytest.approx(
        summary["pantographs"][1]["std_N"], rel=1e-5
    )
    with (out / "figure_08.csv").open() as file:
        force = [float(row["light single force [N]"] or "nan") for row in csv.DictReader(file)]
    record = [value for value in force if not math.isnan(value)]
    mean = sum(record) / len(record)
    alone = json.loads((out / "runs" / "case__light__single" / "summary.json").read_text())
    assert mean == pytest.approx(alone["pantographs"][0]["mean_N"], rel=1e-5)


def test_readings_and_the_search_stand_beside_each_other(done: tuple[Path, str]) -> None:
    study = json.loads((done[0] / "study.json").read_text())
    beside, searched = study["tables"][:2]
    assert len(beside["rows"]) == 9 and len(beside["head"]) == 2 + 2
    assert "reproduced" in beside["note"]
    for row, one in zip(beside["rows"], study["readings"][1]["findings"], strict=True):
        assert row[3] == f"{one['verdict']}: {one['found']}"
    titles = [row[0] for row in searched["rows"]]
    assert sorted(titles) == sorted([study["readings"][1]["title"], "spans: 54 m"])
    best = searched["rows"][titles.index(study["readings"][1]["title"])]
    met = [one["number"] for one in study["readings"][1]["findings"]
           if one["verdict"] == "reproduced"]  # fmt: skip
    assert best[1:3] == [str(len(met)), ", ".join(map(str, met))]
    for number in range(8, 15):
        assert (done[0] / f"figure_{number:02}_best.png").read_bytes().startswith(b"\x89PNG")


def test_only_the_readings_of_the_figures_keep_their_result_files(done: tuple[Path, str]) -> None:
    kept = {path.parent.name for path in (done[0] / "runs").glob("*/run.h5")}
    assert kept == {
        f"{r}__{d}__{t}"
        for r in ("case", "best")
        for d in ("light", "average")
        for t in ("single", "31m")
    }
    for name in kept:
        with open_run(done[0] / "runs" / name) as run:
            assert run.outcome == "done"


def test_a_study_goes_on_where_it_was(done: tuple[Path, str]) -> None:
    out, _ = done
    study = json.loads((out / "study.json").read_text())
    (out / "runs" / "vary__light__contact-2e5-N-m" / "variant.json").unlink()  # as a kill does
    again = catenary(*words(out), cwd=out.parent)
    assert again.code == 0, again.stderr
    assert again.stdout.count(": done already") == len(list((out / "runs").iterdir())) - 1
    assert "vary__light__contact-2e5-N-m: done already" not in again.stdout
    assert json.loads((out / "study.json").read_text())["readings"] == study["readings"]


def test_another_configuration_is_refused(done: tuple[Path, str]) -> None:
    other = catenary(*words(done[0]), "train.speed_km_h=290", cwd=done[0].parent)
    assert other.code == 2
    assert "another configuration" in other.stderr and "--force" in other.stderr
