"""`catenary static` shows what steady arms do: radial forces, slopes, slews, lateral positions."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from measuring import check
from scenes import load_scene
from verb_runner import invoke

from catenary.cases.run.at_rest import rest_text, static_table

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
