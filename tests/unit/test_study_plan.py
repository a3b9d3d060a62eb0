"""Studies: which case has one, what a study.py must hold, which runs the paper's study makes."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scenes import Scene, load_scene, resolved, shipped
from verb_runner import invoke

from catenary import InputError
from catenary.cases.ambrosio2012.study import TABLE, variants
from catenary.cases.studies.case_study import StudyVariant, make_plan
from catenary.cases.studies.paper_study import PaperStudy, changes_of
from catenary.postproc.report.study_report import (
    NOT_REPRODUCED,
    REPRODUCED,
    Finding,
    Reading,
    Study,
    StudyFigure,
    columns_csv,
    verdict_text,
    write_study,
)

pytestmark = pytest.mark.usefixtures("quick_reports")


# What its functions return but `conclude`, which returns nothing.
OWN_STUDY = """from catenary.cases.studies.case_study import StudyVariant
from catenary.cases.studies.sweep.variants import Variant
def variants(scene, shortened):
    return {}
def measure(results):
    return {}
def conclude(runs):
    pass
"""
RUNS_ONCE = '[StudyVariant(Variant("a", ()))]'


def own_case(folder: Path, study: str) -> Path:
    """A folder with a shipped case and a study of its own."""
    shutil.copy(shipped()["en50318_2002"], folder / "case.toml")
    (folder / "study.py").write_text(study)
    return folder


def test_a_case_without_a_study_says_so(tmp_path: Path) -> None:
    done = invoke("run", "en50318_2002", "--study", "-o", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert "en50318_2002 has no study: there is no study.py beside its case.toml" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", ["--strict", "--no-report"])
def test_a_study_has_no_options_of_a_run(option: str, tmp_path: Path) -> None:
    done = invoke("run", "ambrosio2012", "--study", option, "-o", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert f"give --study without {option}" in done.stderr


@pytest.mark.parametrize(
    ("study", "sentence"),
    [
        ("x = 1\n", "has no function variants"),
        ("def variants(scene, shortened): ...\n", "has no function measure"),
        ("def variants(\n", "cannot be loaded: SyntaxError"),
        ("import no_such_module\n", "cannot be loaded: ModuleNotFoundError"),
        (OWN_STUDY.format("[][1]", "{}"), "variants of .*study.py fails in line 4: IndexError: "),
        (
            OWN_STUDY.format("[]", "{}").replace("(scene, shortened)", "(scene)"),
            "variants of .*study.py fails: TypeError: ",  # its caller's line is not the user's
        ),
        (OWN_STUDY.format("[]", "{}"), "variants of .*study.py must give a list of StudyVariant, "),
        (
            OWN_STUDY.format("[1]", "{}"),
            "variants of .*study.py must give a list of StudyVariant, ",
        ),
    ],
)
def test_a_study_that_cannot_be_used_is_told(study: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=sentence):
        make_plan(str(own_case(tmp_path, study)))


@pytest.mark.parametrize(
    ("measured", "sentence"),
    [("{}['x']", "measure of .*study.py fails in line 6: KeyError: 'x'"),
     ("{}", "conclude of .*study.py must give a Study")],
)  # fmt: skip
def test_what_a_study_makes_of_its_runs_may_fail(
    measured: str, sentence: str, tmp_path: Path
) -> None:
    """It ended in a traceback."""
    case = own_case(tmp_path, OWN_STUDY.format(RUNS_ONCE, measured))
    done = invoke("run", str(case), "--study", "--short", "-o", str(tmp_path / "out"))
    assert done.exit_code == 2 and re.search(sentence, done.stderr)


@pytest.fixture(scope="module")
def planned() -> list[StudyVariant]:
    """The runs of the paper's study."""
    return variants(load_scene("ambrosio2012"), False)


def scene_of(one: StudyVariant) -> Scene:
    return load_scene("ambrosio2012", one.variant.assignments)


def test_every_train_runs_under_both_dampings_and_so_does_every_variation(
    planned: list[StudyVariant],
) -> None:
    table = PaperStudy.read(TABLE).table
    variations = sum(len(group) for group in table["variations"].values())
    options = sum(len(group) for group in table["search"]["inputs"].values())
    readings = len(table["readings"]) + options
    assert len(planned) == 2 * (readings * len(table["trains"]) + variations)
    kept = [one for one in planned if one.keep_results]
    assert {one.variant.varied["reading"] for one in kept} == {"case", "printed", "best"}
    first = [scene_of(one) for one in kept if one.variant.varied["reading"] == "case"]
    assert {scene.line.damping.alpha_s for scene in first} == {0.00275, 0.0275}
    assert sorted(max(p.behind_m for p in scene.train.pantographs) for scene in first) == sorted(
        2 * [0.0, 31.0, 85.0, 100.0, 200.0, 400.0]
    )


def test_all_trains_start_and_are_judged_at_the_same_place_of_a_span(
    planned: list[StudyVariant],
) -> None:
    # The trailing pantograph starts at 110 m; the stretch lies a whole number of spans of 54 m on.
    for one in planned:
        if one.variant.varied["reading"] == "case":
            scene = scene_of(one)
            behind = max(one.behind_m for one in scene.train.pantographs)
            assert scene.train.start_m - behind == 110.0
            assert scene.evaluation.to_m - scene.evaluation.from_m == 400.0
            assert (scene.evaluation.from_m - 400.0) % 54.0 == 0.0


def test_the_kind_of_pantograph_is_the_cases_own_or_the_readings(
    planned: list[StudyVariant],
) -> None:
    own = load_scene("ambrosio2012").train.pantographs[0].name
    kinds = {
        reading["name"]: reading.get("kind", own)
        for reading in PaperStudy.read(TABLE).table["readings"]
    }
    assert {own, "lumped"} == set(kinds.values())
    for one in planned:
        reading, train = (one.variant.varied[key] for key in ("reading", "train"))
        if reading in kinds and train in ("single", "200m"):
            assert {place.name for place in scene_of(one).train.pantographs} == {kinds[reading]}


def test_the_changes_of_a_reading_name_its_kind_of_pantograph() -> None:
    told = {
        reading["name"]: changes_of(reading) for reading in PaperStudy.read(TABLE).table["readings"]
    }
    assert told["case"] == []
    assert told["two_masses"] == ["train.pantographs.0.name=lumped"]
    assert told["two_masses_50"] == ["train.pantographs.0.name=lumped", "line.span_m=50"]
    assert {"train.pantographs.0.name=lumped", "line.dropper.slack_damping=kept"} < set(
        told["best"]
    )


def test_the_search_takes_each_option_in_the_place_of_the_best_readings(
    planned: list[StudyVariant],
) -> None:
    chosen = {"damping": "light", "train": "single"}
    scenes = {
        one.variant.varied["reading"]: scene_of(one)
        for one in planned
        if one.variant.varied == chosen | {"reading": one.variant.varied["reading"]}
        and one.variant.varied["reading"].startswith(("best", "search"))
    }
    best = scenes.pop("best")
    del scenes["best_released"]
    assert len(scenes) == len(PaperStudy.read(TABLE).searched())
    records = [json.dumps(resolved(scene), sort_keys=True, default=str) for scene in
               (best, *scenes.values())]  # fmt: skip
    assert len(set(records)) == len(records)
    for scene in scenes.values():
        assert scene.line.dropper.slack_damping == "kept"
        assert scene.train.pantographs[0].name == best.train.pantographs[0].name == "lumped"


def test_a_table_without_trains_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(TABLE.read_text().replace("[[trains]]", "[[cars]]"))
    with pytest.raises(InputError, match="study.toml has no trains; a study needs title, "):
        PaperStudy.read(path)


def test_the_users_kind_takes_the_place_of_the_cases() -> None:
    plan = make_plan("ambrosio2012", ["train.pantographs.0.name=lumped"], shortened=True)
    assert {one.name for job in plan.jobs for one in job.scene.train.pantographs} == {"lumped"}


def study() -> Study:
    def finding(verdict: str) -> Finding:
        return Finding(1, "A < B.", "as it says", verdict, "1 & 2", "because")

    figure = StudyFigure("figure_1", "Caption.", Figure(), {"x": np.array([0.5]), "y": [1, 2]})
    readings = [
        Reading("case", "the case", [], [finding(NOT_REPRODUCED)]),
        Reading("other", "another", ["a.b=1"], [finding(REPRODUCED)]),
    ]
    return Study("Title", "Lead.", readings, figures=[figure])


def test_the_report_shows_every_verdict_and_escapes_what_it_is_given(tmp_path: Path) -> None:
    files = write_study(study(), tmp_path, [{"variant": "v"}], {"runs": 1})
    assert {path.name for path in files} == {
        "study.html", "study.json", "figure_1.png", "figure_1.csv",
    }  # fmt: skip
    html = (tmp_path / "study.html").read_text()
    for text in ("A &lt; B.", "1 &amp; 2", "because", "not reproduced", "a.b=1", "Caption."):
        assert text in html
    assert "data:image/png;base64," in html


def test_verdicts_stand_in_one_line_each() -> None:
    head, line = verdict_text(study()).splitlines()
    assert head.split() == ["case", "other", "statement"]
    assert line.split("  ")[0].strip() == "1. not reproduced"
    assert line.endswith("A < B.")


def test_columns_of_different_lengths_end_in_empty_cells() -> None:
    assert columns_csv({"a": [1, 2], "b": np.array([0.25])}) == "a,b\n1,0.25\n2,\n"
