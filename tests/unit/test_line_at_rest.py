"""``catenary static`` and drawings of ``mesh``: arms, temperatures, the line to scale."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from measuring import check
from PIL import Image
from scenes import load_scene
from verb_runner import invoke

from catenary import InputError
from catenary.cases.run.at_rest import (
    check_line,
    range_of,
    rest_text,
    static_table,
    temperature_text,
)
from catenary.cases.run.scene_mesh import draw_scene
from catenary.postproc.report.pictures.line_pictures import draw_temperatures
from catenary.solver.model.axial_motion import WireEnd
from catenary.solver.statics.line_at_rest import LineAtTemperature, WireAtRest

# --- `catenary static` shows what steady arms do --------------------------------------------------


SHORT = ["line.n_spans=5", "train.start_m=60", "evaluation.from_m=110", "evaluation.to_m=165"]
RUN = [word for change in SHORT for word in ("--set", change)]


def rows_of(path: Path) -> list[dict[str, float]]:
    with path.open() as stream:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(stream)]


def test_a_staggered_line_has_its_registration_as_table_and_csv(tmp_path: Path) -> None:
    """Radial force 4 T a / L within what leaning droppers take, slope from lift over force."""
    out = tmp_path / "arms.csv"
    result = invoke("static", "ac_simple_3d", *RUN, "-o", str(out), "--registration")
    assert result.exit_code == 0, result.output
    assert "arm at [m]" in result.stdout and "m to the left" in result.stdout
    rows = rows_of(out)
    assert [row["position [m]"] for row in rows] == [55.0, 110.0, 165.0, 220.0]
    radial = np.array([row["radial force [N]"] for row in rows])
    expected = 4 * 22e3 * 0.2 / 55
    assert np.abs(radial) == pytest.approx(expected, rel=0.25)
    assert (np.sign(radial) == np.sign([row["stagger [m]"] for row in rows])).all()
    assert [row["slope [deg]"] for row in rows] == pytest.approx([10.0] * 4, abs=0.01)
    assert [row["slew [deg]"] for row in rows] == [0.0] * 4


def test_a_vertical_scene_has_the_radial_forces_of_its_stagger(tmp_path: Path) -> None:
    out = tmp_path / "arms.csv"
    result = invoke("static", "ac_simple", *RUN, "-o", str(out), "--registration")
    assert result.exit_code == 0, result.output
    radial = [abs(row["radial force [N]"]) for row in rows_of(out)]
    assert radial == pytest.approx([4 * 22e3 * 0.2 / 55] * 4, rel=1e-3)


def test_arms_that_the_wind_pushes_are_told(tmp_path: Path) -> None:
    words = ["line.n_spans=17", "train.start_m=330", "evaluation.from_m=660"]
    words += ["evaluation.to_m=770", "wind.speed_m_per_s=35"]
    result = invoke("static", "windy_viaduct", *(w for c in words for w in ("--set", c)))
    assert result.exit_code == 0, result.output
    assert "At rest wires push" in result.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["ac_simple", "--registration"], "--registration takes -o with the name of a"),
        (["en50318_2002", "--registration", "-o", "a.csv"], "no steady arm pulls a wire sideways"),
    ],
)
def test_what_has_no_registration_is_refused(
    words: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke("static", *words)
    assert result.exit_code == 2 and sentence in result.stderr
    assert not list(tmp_path.iterdir())


def test_arms_without_length_take_the_wind_of_their_spans() -> None:
    """A wind pulls at each arm by its load on a span, to the side it blows to."""
    blown = ["line.contact_wire.diameter_mm=12", "wind={speed_m_per_s=20, height_m=10}"]
    still, windy = (
        static_table(load_scene("tramway", [*own, "effects.lateral_motion=true"], shortened=True))
        for own in (blown[:1], blown)
    )
    change = (windy["arm_force"] - still["arm_force"])[:, 0]
    on_a_span = 0.5 * 1.225 * 20.0**2 * 0.012 * 1.2 * 30.0
    # The first and last arms lie beside ends that turn freely: they take 1 % more, by bending.
    check("radial force [N]", change[1:-1], -on_a_span, within=1e-3 * on_a_span)
    assert still["arm_force"][:, 0].min() < -350.0


def test_arms_pull_with_the_tension_that_a_wire_hangs_with() -> None:
    slack = ['defects=[{type="wrong_tension", wire="contact_wire", factor=0.5}]']
    sound, wrong = (
        static_table(load_scene("ac_simple", own, shortened=True)) for own in ([], slack)
    )
    check("radial force [N]", wrong["arm_force"], 0.5 * sound["arm_force"], within=1e-9)
    assert np.abs(sound["arm_force"]).max() > 300.0
    text = rest_text(load_scene("ac_simple", slack, shortened=True), wrong)
    assert "contact_wire: tension 11000 N" in text


# --- what ``catenary static --temperatures`` prints and draws -------------------------------------


SCENE = [
    "line.n_spans=12",
    "evaluation.to_m=420",
    "train.end_m=440",
    "effects.axial_motion=true",
    "line.contact_wire.axial_stiffness_N=18e6",
    "line.messenger_wire.axial_stiffness_N=11e6",
    "line.ends.end.along=tensioner",
    "line.tensioner.efficiency=0.98",
    "mesh.elements_per_gap=1",
]


def test_a_range_has_round_steps_and_its_own_ends() -> None:
    assert range_of("-20,40") == [-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0]
    assert range_of("-15,35") == [-15.0, -10.0, 0.0, 10.0, 20.0, 30.0, 35.0]
    assert len(range_of("0,0.5")) == 6


@pytest.mark.parametrize("text", ["20", "a,b", "40,-20", "-200,0", "1,2,3", "nan,3"])
def test_what_is_no_range_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--temperatures"):
        range_of(text)


def test_the_verb_prints_a_table_and_draws_it(tmp_path: Path) -> None:
    picture = tmp_path / "range.png"
    assigned = [word for key in SCENE for word in ("--set", key)]
    words = ["static", "en50318_2002", *assigned, "--temperatures=-20,20", "-o", str(picture)]
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    rows = [line.split() for line in done.output.splitlines()]
    contact = {float(row[0]): row for row in rows if len(row) == 8 and row[1] == "contact_wire"}
    assert sorted(contact) == [-20.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0]
    assert contact[0.0][2:4] == ["20000", "20000"]
    # The end has moved by less than alpha dT L: droppers and elasticity hold it back.
    assert 0.5 * 245 < float(contact[20.0][6]) < 245
    assert float(contact[20.0][7]) == pytest.approx(3 * float(contact[20.0][6]), abs=2)
    assert float(contact[20.0][5]) == pytest.approx(2.0, abs=0.01)
    assert "All changes of tension are within 10 %" in done.output
    with Image.open(picture) as image:
        assert image.size[0] > 500


def test_a_scene_at_a_temperature_has_the_table_of_it() -> None:
    assigned = [
        word for key in (*SCENE, "line.temperature.difference_K=15") for word in ("--set", key)
    ]
    done = invoke("static", "en50318_2002", *assigned)
    assert done.exit_code == 0, done.output
    table = done.output[done.output.index("dT [K]") :]
    assert table.splitlines()[1].split()[:2] == ["15", "contact_wire"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--temperatures=-20,20"], "--temperatures needs effects.axial_motion = true"),
        (["--temperatures=20,-20"], "must ascend"),
        (["--temperatures=-20,20", "-o", "a.csv"], "must have a name that ends in .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused(words: list[str], sentence: str) -> None:
    done = invoke("static", "en50318_2002", *words)
    assert done.exit_code == 2 and sentence in done.output, done.output


def wire(share: float) -> WireAtRest:
    """A wire that loses a share of 20 kN along its way to a tensioner."""
    x, installed = np.array([0.0, 100.0]), np.full(2, 20e3)
    tension = installed * np.array([1 - share, 1.0])
    ends = (WireEnd(0, "contact_wire", False, -1), WireEnd(1, "contact_wire", True, 1))
    return WireAtRest(
        "contact_wire", x, tension, installed, ends, np.array([0.0, 0.4]), np.zeros(2)
    )


@pytest.mark.parametrize(("share", "remarks"), [(0.07, 0), (0.09, 1), (0.105, 2), (0.12, 3)])
def test_limits_that_are_exceeded_are_named(share: float, remarks: int) -> None:
    rests = [
        LineAtTemperature(30.0, (wire(share),)),
        LineAtTemperature(60.0, (), "slack"),
    ]
    text = temperature_text(rests, 3.0)
    assert text.count("contact_wire: at +30 K") == remarks
    assert "60 slack" in text
    assert ("are within 10 %" in text) == (remarks == 0)


def test_a_check_tells_tensioners_at_their_stops() -> None:
    """720 m of wire, 40 K warmer, would move its end by 0.49 m."""
    warm = ["line.temperature.difference_K=40"]
    free, stopped = (
        check_line(load_scene("en50318_2002", [*SCENE, *warm, f"line.tensioner.travel_m={own}"]))
        for own in (0.6, 0.3)
    )
    assert not any("stops" in text for text in free.warnings)
    (told,) = (text for text in stopped.warnings if "stops" in text)
    assert "At rest stops hold 2 of 2 tensioners, that of contact_wire at 720 m among them" in told


def test_temperatures_are_told_apart_in_grey() -> None:
    """Neighbours differ in their dashes, and the lines get lighter with the temperature."""
    rests = [LineAtTemperature(warmer, (wire(0.01),)) for warmer in (-20.0, 0.0, 20.0, 40.0, 60.0)]
    figure = draw_temperatures(rests)
    curves = [line for line in figure.axes[0].get_lines() if line.get_label().endswith(" K")]
    assert len(curves) == len(rests)
    grey = [to_rgba(line.get_color())[:3] @ np.array([0.299, 0.587, 0.114]) for line in curves]
    assert np.all(np.diff(grey) > 0.05) and grey[-1] < 0.75
    styles = [line.get_linestyle() for line in curves]
    assert all(one != other for one, other in zip(styles, styles[1:], strict=False))
    start, end = figure.axes[-1].get_lines()[:2]
    assert start.get_markersize() > end.get_markersize()


# --- `catenary mesh CASE -o NAME.png` and `NAME.svg` ----------------------------------------------


@pytest.mark.parametrize(
    ("case", "drawn"),
    [
        ("re330_stitched", ["stitched: side view, heights 20 times", "stitch wire"]),
        ("overlap", ["simple: side view, heights 100 times", "cross-section at 495 m"]),
        ("tramway", ["single: side view, heights", "plan view, lateral positions"]),
    ],
)
def test_a_drawing_shows_the_three_views(case: str, drawn: list[str], tmp_path: Path) -> None:
    out = tmp_path / "line.svg"
    draw_scene(load_scene(case, shortened=True), out, force=False)
    said = " ".join(re.findall(r"([^<>]+)</text>", out.read_text(encoding="utf-8")))
    for words in drawn:
        assert words in said, said


def test_views_are_to_scale(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A metre of height is as many times longer on paper than one along the track as is said."""
    seen: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: seen.append(self))
    strips = ["pantographs.three_masses.strips.length_m=1.45"]
    draw_scene(load_scene("overlap", strips, shortened=True), tmp_path / "a.svg", force=False)
    for axes in seen[0].axes:
        box = axes.get_window_extent()
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        ratio = (box.height / (y1 - y0)) / (box.width / (x1 - x0))
        told = re.search(r"(\d+) times", axes.get_title("left"))
        if told is None:
            assert axes.get_aspect() == 1.0
        else:
            assert ratio == pytest.approx(float(told[1]), rel=1e-6)
    plan = seen[0].axes[1]
    assert plan.get_ylim()[1] > 0.725 and "working length of the pan head" in plan.get_title("left")


def test_a_picture_is_written_once_and_only_by_its_suffix(tmp_path: Path) -> None:
    out = tmp_path / "line.png"
    words = "mesh", "tramway", "--set", "line.n_spans=20", "-o"
    done = invoke(*words, str(out))
    assert done.exit_code == 0 and "the line at rest from" in done.output, done.output
    with Image.open(out) as picture:
        assert picture.size == (1170, 871) and len(picture.convert("L").getcolors()) > 20
    again = invoke(*words, str(out))
    assert again.exit_code == 2 and "exists already" in again.output
    other = invoke(*words, str(tmp_path / "line.pdf"))
    assert other.exit_code == 2 and "ends in .msh or .png or .svg" in other.output


@pytest.mark.parametrize(
    ("case", "arms"),
    [("en50318_2002", ""), ("ac_simple", " arms sketched,"), ("ac_simple_3d", " arms at rest,")],
)
def test_the_title_of_the_cross_section_names_arms_only_where_they_are_drawn(
    case: str, arms: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: seen.append(self))
    draw_scene(load_scene(case, shortened=True), tmp_path / "a.svg", force=False)
    title = " ".join(seen[0].axes[2].get_title("left").split())
    assert re.fullmatch(rf"cross-section at [0-9.]+ m,{arms} hollow: at [0-9.]+ m", title), title
