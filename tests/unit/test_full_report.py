"""``catenary report``: pages that are valid and closed in themselves, data sheets, a run again."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
import shutil
import tomllib
from pathlib import Path
from unittest import mock

import html5lib
import numpy as np
import pypdf
import pytest
import verb_runner
from pixels import FIGURES, PAINTERS
from scenes import Scene, load_scene, resolved

from catenary import InputError
from catenary.cases.studies import full_report
from catenary.cases.studies.accuracy.analysis import Row
from catenary.cases.studies.accuracy.axes import AXES
from catenary.cases.studies.accuracy.output import table_of
from catenary.cases.studies.accuracy.runs import make_plan
from catenary.cases.studies.effect_cost import (
    UNSWITCHED,
    CostOptions,
    Costs,
    Measured,
    Size,
    Switch,
    SwitchableEffects,
    files_of,
)
from catenary.cases.studies.full_report import SceneOfRun, measured_costs, measured_errors
from catenary.cases.studies.reference.judgement import FAILED, PASSED
from catenary.cases.studies.reference.validation import Step, Validation, validation_files
from catenary.postproc.files.own_files import OWN_FILES
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures import interactive, line_pictures
from catenary.postproc.report.study_table import write_files
from catenary.solver.time_loop.views.channels import CHANNELS

CHANGES = ("train.speed_km_h=280", "line.contact_wire.tension_N=21e3")


def invoke(*words: str) -> str:
    done = verb_runner.invoke(*words)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("full")
    changed = (word for change in CHANGES for word in ("--set", change))
    with mock.patch.multiple(FIGURES, **PAINTERS):  # pictures that the report replaces
        invoke("run", "ac_simple", "--short", "-q", "-o", str(out), *changed)
    said = invoke("report", str(out), "--pdf", "--interactive").splitlines()
    assert {Path(line).name for line in said} >= {"report.html", "report.pdf", "input.toml"}
    assert all(Path(line).is_file() for line in said)
    # Not one picture twice, and all that another run with --force replaces is known.
    assert not list(out.glob("*.png"))
    assert {Path(line).name for line in said} <= {*OWN_FILES, "input.toml"}
    return out


def words_of(page: str) -> str:
    tree = html5lib.parse(page, namespaceHTMLElements=False)
    return " ".join(" ".join(tree.itertext()).split())


@pytest.mark.process
@pytest.mark.parametrize("name", ["report.html", "report_interactive.html"])
def test_pages_are_valid_and_ask_for_nothing(folder: Path, name: str) -> None:
    text = (folder / name).read_text(encoding="utf-8")
    program = interactive.script()  # which holds letters that HTML calls invalid
    assert (program in text) == (name == "report_interactive.html")
    text = text.replace(program, "")
    parser = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False)
    tree = parser.parse(text)  # raises at the first error
    for element in tree.iter():
        for key, address in element.attrib.items():
            if key in ("src", "href", "srcset", "data", "action"):
                assert address.startswith(("#", "data:image/")), (element.tag, key)
    skip, *anchors = (one.get("href") for one in tree.iter("a"))
    assert skip == "#content" and tree.find(".//main").get("id") == "content"
    assert anchors == [f"#{one.get('id')}" for one in tree.iter("h2")]
    # What scrolls is reached by keyboard and has a name, and so has every picture.
    for element in tree.iter():
        if {"scroll", "plot"}.intersection(element.get("class", "").split()):
            assert element.get("role") in ("region", "group") and element.get("aria-label")
            assert element.get("tabindex") == "0" or element.get("class") == "plot"
    assert all(one.get("alt") for one in tree.iter("img"))
    levels = [int(one.tag[1]) for one in tree.iter() if re.fullmatch("h[1-6]", str(one.tag))]
    assert levels[0] == 1 and all(b - a <= 1 for a, b in itertools.pairwise(levels))
    scripts = [one for one in tree.iter("script")]
    assert bool(scripts) == (name == "report_interactive.html")
    plots = [one for one in tree.iter("div") if one.get("class") == "plot"]
    assert (len(plots) > 10) == bool(scripts)
    # Plotly has a button that uploads a picture.
    assert ("showSendToCloud: false" in text) == bool(scripts)


@pytest.mark.process
def test_all_sections_of_a_run_with_data_sheets(folder: Path) -> None:
    tree = html5lib.parse((folder / "report.html").read_text(), namespaceHTMLElements=False)
    assert [one.get("id") for one in tree.iter("h2")] == [
        "acceptance", "checks", "force", "spectrum", "waves", "motion", "worst", "places", "rest",
        "line", "above", "pantographs", "effects", "run", "validation", "signatures",
    ]  # fmt: skip
    pictures = {path.stem for path in folder.glob("*.svg")}
    assert pictures >= {"spectrum", "contact_height", "space_time", "worst_span",
                        "worst_dropper", "line", "pantograph_1"}  # fmt: skip


@pytest.mark.process
def test_data_sheets_have_the_data_of_the_scene(folder: Path) -> None:
    words = words_of((folder / "report.html").read_text())
    sheet = words[words.rindex("Data sheet of the line") :]
    wires = re.search(r"contact wire contact ([\d.]+) ([\d.]+) ([\d.]+) – ([\d.]+) ", sheet)
    assert wires is not None
    tension, mass, bending, speed = map(float, wires.groups())
    # AC simple: 1.35 kg/m and 195 N m2; waves of a string run at sqrt(T / m).
    assert (tension, mass, bending) == (21.0, 1.35, 195.0)
    assert speed == pytest.approx((21e3 / 1.35) ** 0.5, abs=0.05)
    assert "span length 55.00 m" in sheet
    # Masses, and stiffness and damping below each, from the head down.
    assert "1 (head) 7.5 7000 45.0 2 9.0 15500 0.1 3 6.0 160 100.0" in sheet


@pytest.mark.process
def test_the_paper_form_has_pages_and_text(folder: Path) -> None:
    paper = pypdf.PdfReader(folder / "report.pdf")
    assert len(paper.pages) > 5
    for page in paper.pages:  # 210 x 297 mm
        assert float(page.mediabox.width) == pytest.approx(595.3, abs=0.5)
        assert float(page.mediabox.height) == pytest.approx(841.9, abs=0.5)
    text = " ".join(" ".join(page.extract_text().split()) for page in paper.pages)
    assert "Acceptance" in paper.pages[0].extract_text()
    for words in ("The run's own checks", "Worst span by", "Data sheet of the line", "signature"):
        assert words in text
    assert f"1 / {len(paper.pages)}" in text
    # Pictures are vector graphics: their texts are texts of the page.
    assert "spectral density [N²/Hz]" in text
    # What is folded away on a screen is not printed.
    assert '"elements_per_gap"' not in text
    assert {one.title for one in paper.outline if not isinstance(one, list)}


@pytest.mark.process
def test_the_input_makes_the_same_run(folder: Path) -> None:
    own = folder / "input.toml"
    with Results(folder) as results:
        assert resolved(load_scene(own)) == results.attributes["config"]
    assert tomllib.loads(own.read_text())["line"]["contact_wire"]["tension_N"] == 21e3
    mark = hashlib.sha256(own.read_bytes()).hexdigest()
    assert f"input.toml, SHA-256 {mark}" in words_of((folder / "report.html").read_text())


@pytest.mark.study
@pytest.mark.process
def test_a_rail_has_neither_droppers_nor_a_view_from_above(tmp_path: Path) -> None:
    quiet = "-q", "--set", "output.field_every_s=0"
    invoke("run", "conductor_rail", "--short", "-o", str(tmp_path), *quiet)
    invoke("report", str(tmp_path))
    page = (tmp_path / "report.html").read_text()
    assert 'id="line"' in page and 'id="above"' not in page
    assert "There is no picture:" in page  # of waves, without snapshots
    words = words_of(page)
    assert "Worst span by" in words and "Worst dropper by" not in words
    assert "droppers that slackened" not in words and "Evaluated droppers" not in words
    # Nothing is told of what the rail has not: effects that are off, rods of its arms, pre-sag.
    effects = words.split("Simulated effects")[-1].split("Effects that were not simulated")[0]
    assert "contact_loss" in effects and "dropper" not in effects
    assert "clamp 7 kg" in words and "0 kg/m" not in words and "pre-sag wanted" not in words
    # The limit of the uplift, 500 times as much as the rail has, is named and not drawn.
    svg = (tmp_path / "uplift.svg").read_text()
    assert "limit 120 mm, far above" in svg and ">dropper<" not in svg
    assert re.search(
        r"Elasticity in span [0-9]+, [0-9.]+ to [0-9.]+ m.*0.00165 to 0.0261 mm/N", words
    )


def test_the_stagger_of_twins_is_that_of_both_wires() -> None:
    """0.2 m to either side, and the wires 30 mm to either side of it."""
    recorded = resolved(load_scene("dc_twin", shortened=True))
    scene = SceneOfRun(_Recorded(recorded))  # type: ignore[arg-type]
    _, geometry, *_ = full_report.line_section(scene, None).blocks  # type: ignore[arg-type]
    told = {row[0]: row[1:] for row in geometry.texts()}  # type: ignore[union-attr]
    assert told["stagger there, to the left"] == ["-0.230 to 0.230", "m"]


def test_the_data_sheet_tells_the_wind() -> None:
    """Speeds at the wires by the logarithmic law, ln(z / z0) / ln(10 m / z0) of that at 10 m."""
    recorded = resolved(load_scene("windy_viaduct", shortened=True))
    scene = SceneOfRun(_Recorded(recorded))  # type: ignore[arg-type]
    blocks = full_report.line_section(scene, None).blocks  # type: ignore[arg-type]
    table = next(block for block in blocks if getattr(block, "title", "") == "Wind")
    rows = {row[0]: row[1:] for row in table.texts()}
    for name, height in (("at the wires", 6.0), ("from 660 to 1100 m", 31.0)):
        (value,) = (own[0] for key, own in rows.items() if name in key)
        expected = 25.0 * math.log(height / 0.05) / math.log(10.0 / 0.05)
        assert float(value) == pytest.approx(expected, abs=0.051)  # one decimal is shown
    assert ["0.18", ""] in rows.values()


@pytest.mark.process
@pytest.mark.parametrize("case", ["ambrosio2012", "curve", "windy_viaduct", "conductor_rail"])
def test_other_inputs_load_to_the_same_scene(case: str) -> None:
    """Effects that are on for want of a word, and those that were switched off, stay so."""
    from scenes import find_case

    recorded = resolved(load_scene(find_case(case)))
    scene = SceneOfRun(_Recorded(recorded))  # type: ignore[arg-type]
    assert scene.input_text is not None
    assert "[line" in scene.input_text


class _Recorded:
    """Results of which nothing but the scene is known."""

    def __init__(self, config: object) -> None:
        self.attributes = {"config": config}
        self.path = Path("run.h5")


@pytest.mark.process
@pytest.mark.usefixtures("quick_report")
def test_a_scene_of_another_version_costs_the_data_sheets_alone(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(folder / "run.h5", tmp_path / "run.h5")

    def refuse(*_: object) -> None:
        raise InputError("overhead is no key")

    monkeypatch.setattr("catenary.cases.studies.full_report.recorded_scene", refuse)
    said = invoke("report", str(tmp_path))
    assert "the report has no data sheets: overhead is no key" in said
    page = (tmp_path / "report.html").read_text()
    assert 'id="worst"' in page and 'id="line"' not in page and 'id="pantographs"' not in page
    assert not (tmp_path / "input.toml").exists()


@pytest.mark.process
@pytest.mark.usefixtures("quick_report")
def test_the_validation_of_the_installation(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "run.h5", tmp_path / "run.h5")
    invoke("report", str(tmp_path))
    assert "No validation of this installation is at hand" in words_of(
        (tmp_path / "report.html").read_text()
    )
    row = dict.fromkeys(
        ("configuration", "of", "quantity", "value", "reference", "difference", "error_bar",
         "within_bar", "lower", "upper", "verdict", "clause", "compared")
    )  # fmt: skip
    row |= {"quantity": "std_N", "value": 31.5, "reference": 30.0, "difference": 1.5}
    failed = row | {"configuration": "ac_one", "verdict": FAILED, "upper": 31.25}
    steps = [
        Step("Reference models", [row | {"verdict": PASSED}, failed]),
        Step("Test", [], "no"),
    ]
    installation = {"program": "catenary 0.0.1", "machine": "Linux"}
    write_files(tmp_path, validation_files(Validation(steps, installation)))
    invoke("report", str(tmp_path), "--validation", str(tmp_path))
    said = words_of((tmp_path / "report.html").read_text())
    assert "Statement of catenary 0.0.1 on Linux. It is not one of the program of this run" in said
    assert "1 Reference models 1 of 2 judged figures are within their limits." in said
    assert "2 Test not judged: no" in said
    assert "differ from the reference solutions by at most 5.0 %" in said
    beyond = said.index("Figures beyond their limits")
    assert said.index("31.25", beyond) < said.index("Judged figures (2)", beyond)
    assert "standard deviation" in said[beyond:] and "error bar" not in said[beyond:]
    done = verb_runner.invoke("report", str(tmp_path), "--validation", str(folder))
    assert done.exit_code == 2
    assert "the record of `catenary validate`, cannot be read: no such file" in done.output


def study(folder: Path, case: str, **changes: object) -> Path:
    """The record of an accuracy study, as its own writer makes it."""
    sizes = {"dt": 1e-3, "h": 1.0 / 8} | changes
    errors = {"mean": 0.1, "std": -0.25, "max": 3.0, "uplift": 0.5}
    row = Row("grid", "own", "done", sizes, errors, dict.fromkeys(errors, 1.0))  # type: ignore[arg-type]
    record = {"case": case, "rows": table_of([row]).records()}
    (folder / "accuracy.json").write_text(json.dumps(record))
    return folder


def scene_of(step: float, elements: int) -> Scene:
    return load_scene("ac_simple", [f"numerics.dt_s={step}", f"mesh.elements_per_gap={elements}"])


def test_measured_errors_of_the_same_step_and_mesh(tmp_path: Path) -> None:
    found = measured_errors(scene_of(1e-3, 8), study(tmp_path, "ac_simple"))
    assert found == {"mean_force": 0.1, "force_std": 0.25, "force_max": 3.0, "arm_uplift": 0.5}
    with pytest.raises(InputError, match="no run with a step of 2 ms and 8 elements per gap"):
        measured_errors(scene_of(2e-3, 8), tmp_path)
    with pytest.raises(InputError, match="no run with a step of 1 ms and 5 elements per gap"):
        measured_errors(scene_of(1e-3, 5), tmp_path)
    with pytest.raises(InputError, match="a study of curve, the run is one of ac_simple"):
        measured_errors(scene_of(1e-3, 8), study(tmp_path, "curve"))
    file = tmp_path / "accuracy.json"
    for wrong, why in (("[]", "it holds no table"), ("[" * 100_000, "it is no JSON"), ("{}", "it")):
        file.write_text(wrong)
        with pytest.raises(InputError, match=f"is no record of `catenary accuracy`: {why}"):
            measured_errors(scene_of(1e-3, 8), tmp_path)
    file.unlink()
    with pytest.raises(InputError, match="`catenary accuracy`, cannot be read: no such file"):
        measured_errors(scene_of(1e-3, 8), tmp_path)


def test_errors_of_another_speed_or_stretch_are_refused(tmp_path: Path) -> None:
    """Step and mesh of a study, and what is recorded and judged, may be others."""
    plan = make_plan("ac_simple", [AXES["grid"]], ["train.speed_km_h=300", "numerics.dt_s=5e-4"])
    file = study(tmp_path, "ac_simple") / "accuracy.json"
    record = json.loads(file.read_text()) | {"scene": plan.scene}
    file.write_text(json.dumps(record))
    faster = ["train.speed_km_h=300", "output.flush_every_steps=10", 'evaluation.rules=["line"]']
    assert measured_errors(load_scene("ac_simple", faster), tmp_path)["mean_force"] == 0.1
    for changes, difference in (
        ([], "train.speed_km_h = 300.0, the run is one with 275.0"),
        ([*faster, "evaluation.to_m=990"], "evaluation.to_m = 1100.0, the run is one with 990.0"),
        ([*faster, "effects.dropper_slackening=false"], "effects.dropper_slackening = true"),
        ([*faster, "line.contact_wire.tension_N=21e3"], "line.contact_wire.tension_N = 22000.0"),
    ):
        with pytest.raises(InputError, match=f"is a study with {re.escape(difference)}"):
            measured_errors(load_scene("ac_simple", changes), tmp_path)


@pytest.mark.process
@pytest.mark.usefixtures("quick_report")
def test_a_report_shows_measured_errors(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "run.h5", tmp_path / "run.h5")
    with Results(folder) as results:
        config = results.attributes["config"]
    sizes = {"dt": config["numerics"]["dt_s"], "h": 1.0 / config["mesh"]["elements_per_gap"]}
    invoke("report", str(tmp_path), "--accuracy", str(study(tmp_path, "ac_simple", **sizes)))
    words = words_of((tmp_path / "report.html").read_text())
    assert "The error is that of step and mesh, from" in words
    assert re.search(r"maximum contact force passed [\d.]+ < 350.0 [\d.]+ 3.00 N", words)
    assert re.search(r"uplift at steady arms passed [\d.]+ ≤ 120.0 [\d.]+ 0.50 mm", words)


def cost_study(folder: Path, case: str, on: bool) -> Path:
    """The record of a study of costs, as its own writer makes it: of slackening droppers."""
    switch = Switch("dropper_slackening", "droppers that slacken", on, {}, ())
    figures = {"mean_N": 150.0, "std_N": 30.0, "max_N": 220.0, "min_N": 80.0, "max_uplift_mm": 50.0}
    size = Size(100, (4, 4), (4,))
    changed = [Measured(switch, "done", size, 0.8, [figures | {"std_N": 33.0}])]
    choice = SwitchableEffects([switch], [], {})
    own = Measured(UNSWITCHED, "done", size, 1.0, [figures])
    found = Costs(case, CostOptions(case), choice, (0.0, 50.0), 10, 5.0, ["p"], own, changed)
    write_files(folder, files_of(found))
    return folder


@pytest.mark.process
@pytest.mark.usefixtures("quick_report")
def test_a_report_shows_measured_costs_of_effects(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "run.h5", tmp_path / "run.h5")
    without = words_of((folder / "report.html").read_text())
    assert "catenary report --cost STUDY shows it here" in without
    invoke("report", str(tmp_path), "--cost", str(cost_study(tmp_path, "ac_simple", on=True)))
    words = words_of((tmp_path / "report.html").read_text())
    assert (
        "it makes a step 1.25 times as long; without it sigma changes most, by +10 %: keep it."
        in words
    )
    assert f"costs and changes are those of {tmp_path}" in words
    assert "--cost STUDY" not in words


@pytest.mark.process
def test_costs_of_another_case_or_of_other_effects_are_refused(
    folder: Path, tmp_path: Path
) -> None:
    with Results(folder) as results:
        scene = SceneOfRun(results)
    assert set(measured_costs(scene, cost_study(tmp_path, "ac_simple", on=True))) == {
        "dropper_slackening"
    }
    with pytest.raises(InputError, match="without the effect dropper_slackening, the run is one w"):
        measured_costs(scene, cost_study(tmp_path, "ac_simple", on=False))
    with pytest.raises(InputError, match="a study of curve, the run is one of ac_simple"):
        measured_costs(scene, cost_study(tmp_path, "curve", on=True))
    (tmp_path / "cost.json").write_text("{}")
    with pytest.raises(InputError, match="is no record of `catenary plan --cost`"):
        measured_costs(scene, tmp_path)


def test_a_channel_of_some_millimetres_is_drawn_in_millimetres(tmp_path: Path) -> None:
    """A contact wire moves sideways by less than 10 mm."""
    quiet = "-q", "--no-report", "--set", "output.field_every_s=0"
    invoke("run", "ac_simple_3d", "--short", "-o", str(tmp_path), *quiet)
    name = "lateral_displacement"
    with Results(tmp_path) as results:
        largest = 1e3 * float(np.nanmax(results.column(name, 0)))
        drawn = {file: draw for file, _, draw in line_pictures.channel_pictures(results)}
        figure = drawn[line_pictures.picture_name(CHANNELS[name])]()
    assert figure is not None and 1.0 < largest < 100.0
    (axes,) = figure.axes
    assert axes.get_ylabel() == "lateral displacement [mm]"
    (curve,) = (line for line in axes.get_lines() if line.get_label() == "lateral displacement")
    assert np.nanmax(curve.get_ydata()) == pytest.approx(largest)
