"""What ``catenary static --temperatures`` prints and draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from PIL import Image
from scenes import load_scene
from verb_runner import invoke

from catenary import InputError
from catenary.cases.run.at_rest import check_line, range_of, temperature_text
from catenary.postproc.report.pictures.line_pictures import draw_temperatures
from catenary.solver.model.axial_motion import WireEnd
from catenary.solver.statics.line_at_rest import LineAtTemperature, WireAtRest

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
