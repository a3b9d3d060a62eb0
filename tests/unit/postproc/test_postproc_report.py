"""Summary, report, pictures, tables and comparison."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pypdf
import pytest

import catenary.postproc.report.page
from catenary import InputError
from catenary.postproc.evaluate.compare import compare
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import Section, Text, page, pdf
from catenary.postproc.report.pictures import line_pictures
from catenary.postproc.report.report import write_report
from catenary.postproc.report.study_table import texts_table

TEMPLATES = Path(catenary.postproc.report.page.__file__).parent / "templates"
PNG = b"\x89PNG\r\n\x1a\n"
PICTURES = (
    "contact_force",
    "statistics",
    "histogram",
    "uplift",
    "droppers",
    "static",
    "energy",
)


class Page(HTMLParser):
    """Checks that tags are balanced and collects addresses, tags and text."""

    VOID = {"meta", "img", "br", "link"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []
        self.tags: set[str] = set()
        self.words = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.addresses += [v or "" for k, v in attrs if k in ("src", "href", "srcset", "action")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += f" {data}"


@pytest.fixture(scope="module")
def report_folder(run_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    found = write_report(run_folder, folder)
    assert found.verdict is True
    assert sorted(found.files) == sorted(folder.iterdir())
    return folder


def test_summary_has_the_keys_that_others_rely_on(report_folder: Path) -> None:
    summary = json.loads((report_folder / "summary.json").read_text())
    assert {
        "case": "made_up",
        "speed_km_h": 300.0,
        "n_ranks": 1,
        "n_steps": 8000,
        "dt_s": 1e-3,
        "march_wall_s": 4.0,
        "outcome": "done",
        "passed": True,
    }.items() <= summary.items()
    assert summary["n_dofs"] > 0
    assert summary["simulated_s"] == pytest.approx(8.0)
    assert summary["real_time_factor"] == pytest.approx(2.0)
    assert summary["real_time_factor_with_records"] == pytest.approx(1.6)
    assert summary["phase_wall_s"]["equilibrium"] == 0.2
    assert summary["evaluation_m"] == [250.0, 550.0]
    assert len(summary["pantographs"]) == 2
    for pantograph in summary["pantographs"]:
        assert {
            "mean_N",
            "std_N",
            "std_0_5_N",
            "std_5_20_N",
            "max_N",
            "min_N",
            "stat_max_N",
            "stat_min_N",
            "loss_percent",
            "contact_height_range_mm",
        } <= pantograph.keys()
        assert pantograph["mean_N"] == pytest.approx(150.0, abs=1.0)
        assert pantograph["contact_height_range_mm"] == pytest.approx(30.0, rel=1e-3)
    assert summary["supports"]["max_uplift_mm"] == pytest.approx(61.6, abs=0.1)
    assert len(summary["supports"]["per_support"]) == 15
    assert summary["droppers"]["n_slackened"] == 54
    assert summary["droppers"]["min_force_N"] == -0.5
    assert len(summary["static"]["dropper_lengths_m"]) == 9
    elasticity = summary["static"]["elasticity_mm_per_N"]
    assert (elasticity["max"], elasticity["min"]) == pytest.approx((0.45, 0.33))
    assert {"criterion", "value", "limit", "passed"} <= summary["acceptance"][0].keys()
    told = [
        (effect["name"], effect["simulated"], effect["reason"]) for effect in summary["effects"]
    ]
    assert told == [
        ("vertical", True, "always"),
        ("dropper_slackening", True, "default"),
        ("lateral", False, "not asked for"),
    ]
    assert all(c["passed"] is True for c in summary["acceptance"])


def test_report_is_one_file_that_needs_no_network(report_folder: Path) -> None:
    text = (report_folder / "report.html").read_text()
    page = Page(text)
    assert not re.search(r"https?://|//[a-z]|@import|url\(", re.sub(r"base64,[^\"]*", "", text))
    assert not page.tags & {"script", "link", "iframe", "object"}
    anchors = {address for address in page.addresses if address.startswith("#")}
    assert all(f'id="{address[1:]}"' in text for address in anchors)
    pictures = [address for address in page.addresses if address not in anchors]
    assert len(pictures) == len(PICTURES)
    for address in pictures:
        kind, data = address.split(",")
        assert kind == "data:image/png;base64"
        assert base64.b64decode(data).startswith(PNG)


def test_pages_are_printed_on_a4() -> None:
    """And nothing is cut off there: what scrolls on a screen is shown in full on paper."""
    template = (TEMPLATES / "page.html.j2").read_text(encoding="utf-8")
    assert "@page { size: A4;" in template
    printed = template[template.index("@media print") :]
    assert ".scroll { overflow: visible; }" in printed
    assert ("<pre" in template) == ("white-space: pre-wrap" in printed)


@pytest.mark.process
def test_a_wide_table_ends_within_the_margins_of_its_sheet() -> None:
    """Its heads take several lines, and units stay whole: texts begin before the margin of 15 mm,
    which is 737 of 794 pixels of CSS from the left."""
    heads = [f"damping of wire {n} [1/s]" for n in range(9)]
    table = texts_table(heads, [["0.01"] * 9], range(9))
    html = page("title", "", [Section("Wires", [table])], {})
    assert "damping of wire 0 <span>[1/s]</span>" in html
    places: list[float] = []
    (sheet,) = pypdf.PdfReader(io.BytesIO(pdf(html))).pages
    sheet.extract_text(visitor_operand_before=lambda *found: places.append(found[3][4]))
    assert 600.0 < max(places) < 737.0


def test_no_line_ends_within_a_unit() -> None:
    """Of a cell or a sentence; what is to be copied stays as it is."""
    cells = [["vertical stiffness 182 N/m, 45 % of it, 3 of 4"], ["run `catenary judge` 9 % or so"]]
    table = texts_table(["data"], cells)
    text = Text("Elasticity 0.42 mm/N; `catenary worst --at 100 m`.")
    html = page("title", "By 7.8 % [mm/N].", [Section("Wires", [text, table])], {})
    assert 'By 7.8\u00a0% <span class="unit">[mm/N]</span>.' in html
    assert 'stiffness 182\u00a0<span class="unit">N/m</span>, 45\u00a0% of it, 3 of 4' in html
    assert "run <code>catenary judge</code> 9\u00a0% or so" in html
    assert 'Elasticity 0.42\u00a0<span class="unit">mm/N</span>; <code>' in html
    assert "<code>catenary worst --at 100 m</code>." in html


def test_report_says_what_was_found(report_folder: Path, march: Any) -> None:
    text = (report_folder / "report.html").read_text()
    words = " ".join(Page(text).words.split())
    assert "A made-up line <with> & awkward title" in words  # and therefore escaped
    by = "EN 50367:2006 (AC): 14 of 14 criteria passed, 1 not judged; 14 of 14 limits"
    assert f"Passed. {by} not compared with the text of their standard." in words
    assert "not complete" not in words
    assert "lateral stagger and lateral motion not asked for" in words
    assert "vertical vertical motion of the tensioned wires always" in words
    # Eight seconds simulated by four of steps, five with the records after them.
    factors = "2.00 of the steps, 1.60 with all records"
    assert f"real-time factor (simulated / wall) {factors}" in words
    assert "equilibrium 0.20 s" in words[words.index("wall time") :]
    assert "petsc 3.18.5" in words[words.index("versions") :]
    assert '"scheme": "one_solve"' in words
    assert f"Droppers of all spans ({march.dropper_x.size})" in words


def test_pictures_are_pictures(report_folder: Path) -> None:
    for name in PICTURES:
        data = (report_folder / f"{name}.png").read_bytes()
        width, height = (int.from_bytes(data[i : i + 4], "big") for i in (16, 20))
        assert data.startswith(PNG) and width >= 1000 and height >= 300


def test_static_picture_shows_three_spans_and_the_span_of_the_elasticity(run_folder: Path) -> None:
    with Results(run_folder) as results:
        profile, elasticity = line_pictures.static_line(results).axes
    assert profile.get_xlim() == pytest.approx((350.0, 500.0), abs=3.0)
    assert elasticity.get_xlim() == pytest.approx((400.0, 450.0), abs=1.0)


def test_dropper_table_has_what_an_installer_cuts_by(report_folder: Path, march: Any) -> None:
    rows = list(csv.DictReader((report_folder / "droppers.csv").read_text().splitlines()))
    assert len(rows) == march.dropper_x.size
    tenth = rows[9]
    assert (tenth["span"], tenth["dropper"]) == ("2", "1")
    assert float(tenth["position in span [m]"]) == 5.0
    assert float(tenth["position [m]"]) == 55.0
    upper, lower = march.mesh.points[march.mesh.droppers[9], 2]
    assert float(tenth["length [m]"]) == pytest.approx(upper - lower, abs=5e-5)


@pytest.mark.usefixtures("quick_report")
def test_a_failed_criterion_is_named(tmp_path: Path, make_march: Any, record_run: Any) -> None:
    march = make_march(separations=(0.0,), n_steps=3750, dt=2e-3, speed=160.0 / 3.6)
    record_run(tmp_path / "run.h5", march, attributes={"title": "slow"})
    found = write_report(tmp_path, tmp_path)
    assert found.verdict is False
    words = " ".join(Page((tmp_path / "report.html").read_text()).words.split())
    # At 160 km/h the mean may be 0.00047 * 160^2 + 90 = 102.0 N.
    assert re.search(
        r"Not passed\. EN 50367:2006 \(AC\): 7 of 8 criteria passed, 1 not judged; 8 of 8 "
        r"limits not compared with the text of their standard\. Failed: "
        r"mean contact force: 1(49|50)\.\d N, must be ≤ 102\.0 N",
        words,
    )
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["passed"] is False
    failed = [c["criterion"] for c in summary["acceptance"] if c["passed"] is False]
    assert failed == ["mean contact force"]


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize(
    "steps",
    [0, pytest.param(1, marks=pytest.mark.study), 30, pytest.param(3000, marks=pytest.mark.study)],
)
def test_an_interrupted_run_is_reported_as_far_as_it_went(
    tmp_path: Path, make_march: Any, steps: int
) -> None:
    from catenary.postproc.record.recorder import Recorder

    march = make_march()
    watcher = Recorder(march.comm, tmp_path / "run.h5", march.header())
    march.drive(watcher, outcome="interrupted", last=steps)
    watcher.close()
    found = write_report(tmp_path, tmp_path)
    assert found.verdict is None
    words = " ".join(Page((tmp_path / "report.html").read_text()).words.split())
    assert "This run is not complete. It was interrupted." in words
    assert f"{steps} of 8000 steps" in words
    assert "No statistics of the leading pantograph" in words
    assert "NaN" not in words and "nan" not in words.split()
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["outcome"] == "interrupted" and summary["passed"] is None
    assert summary["pantographs"][0]["mean_N"] is None
    assert summary["march_wall_s"] is None and summary["real_time_factor"] is None
    assert summary["real_time_factor_with_records"] is None
    judged = {c["criterion"]: c["passed"] for c in summary["acceptance"]}
    assert judged["mean contact force, leading"] is None
    assert judged["train speed against 0.7 of the wave speed"] is True


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize(
    "separations", [pytest.param((0.0,), marks=pytest.mark.study), (0.0, 31.0, 62.0, 93.0)]
)
def test_one_and_four_pantographs_are_reported(
    tmp_path: Path, make_march: Any, record_run: Any, separations: tuple[float, ...]
) -> None:
    march = make_march(separations=separations, n_steps=3750, dt=2e-3)
    record_run(tmp_path / "run.h5", march)
    assert write_report(tmp_path, tmp_path).verdict is not None
    summary = json.loads((tmp_path / "summary.json").read_text())
    names = [p["name"] for p in summary["pantographs"]]
    assert names == (
        ["pantograph"] if len(names) == 1 else ["leading", "no. 2", "no. 3", "trailing"]
    )


def test_reports_leave_no_partial_files_behind(report_folder: Path, run_folder: Path) -> None:
    assert not list(report_folder.glob(".*"))
    assert [p.name for p in run_folder.iterdir()] == ["run.h5"]


def test_a_folder_without_a_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        write_report(tmp_path, tmp_path)


def test_comparison_of_a_run_with_itself_is_zero(run_folder: Path) -> None:
    text = compare(run_folder, run_folder / "run.h5")
    rows = re.findall(r"(-?\d+(?:\.\d+)?) +(-?\d+(?:\.\d+)?) +(\S+)$", text, flags=re.MULTILINE)
    differences = [last for *_, last in rows]
    assert len(differences) == 2 * 8 + 4
    assert {float(d) for d in differences} == {0.0}
    assert "Largest difference of the contact force histories: 0.0000 N" in text


def test_comparison_finds_what_differs(
    tmp_path: Path, run_folder: Path, make_march: Any, record_run: Any
) -> None:
    march = make_march()
    shown = march.force
    march.force = lambda t: shown(t) + np.array([0.5, 0.0])
    record_run(tmp_path / "run.h5", march)
    text = compare(run_folder, tmp_path)
    assert re.search(r"leading\n  mean \[N\] +149\.\d+ +150\.\d+ +0\.50$", text, re.MULTILINE)
    assert "0.5000 N at t = " in text and "(leading)" in text


def test_runs_of_different_step_are_compared_by_statistics_only(
    tmp_path: Path, run_folder: Path, make_march: Any, record_run: Any
) -> None:
    record_run(tmp_path / "run.h5", make_march(dt=2e-3, n_steps=4000, separations=(0.0,)))
    text = compare(run_folder, tmp_path)
    assert "A has 2 pantographs, B has 1" in text
    assert ", 1 rank, " in text and "-0.0000" not in text
    assert "force histories are not compared" in text


def test_dropper_table_has_the_forces_of_the_run(report_folder: Path, run_folder: Path) -> None:
    """By hand from the record: every step of it stands for a time step."""
    rows = list(csv.DictReader((report_folder / "droppers.csv").read_text().splitlines()))
    with Results(run_folder) as results:
        force, dt = results.channel("dropper_force"), results.dt
        order = np.argsort(results.line("dropper_x"), kind="stable")
    expected = np.stack([force.min(axis=0), force.max(axis=0)], axis=1)[order]
    names = ("least force [N]", "largest force [N]")
    found = np.array([[float(row[name]) for name in names] for row in rows])
    np.testing.assert_allclose(found, expected, atol=0.5e-2 + 1e-9)  # two decimals
    slack = np.array([float(row["slack [s]"]) for row in rows])
    by_hand = dt * np.count_nonzero(force <= 0.0, axis=0)[order]
    np.testing.assert_allclose(slack, by_hand, atol=0.5e-3 + 1e-9)  # three decimals
    assert slack.max() > 0.1 and slack.min() == 0.0
