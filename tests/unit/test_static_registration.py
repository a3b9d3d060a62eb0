"""`catenary static` shows what steady arms do: radial forces, slopes, slews, lateral positions."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from verb_runner import invoke

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
