"""Curves over the separation of two pantographs: what is run, what is read from it, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from program import catenary

from catenary.base.errors import InputError
from catenary.cases.scene.load import load_scene
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.variants import Variant, parse_vary
from catenary.cases.studies.waves import separation
from catenary.cases.studies.waves.theory import WaveTheory
from catenary.solver.waves.bloch import BlochWaves

pytestmark = pytest.mark.study

SPEED, WAVES, SPAN = 80.0, 120.0, 50.0
BAND = (1.0, 1.25)


def theory() -> WaveTheory:
    frequency = np.array([[BAND[0]], [BAND[1]]])
    empty = np.zeros((2, 1, 0), dtype=complex)
    waves = BlochWaves(SPAN, np.array([0.0, np.pi]), frequency, frequency, empty, np.zeros(0))
    return WaveTheory(SPEED, WAVES, (), 0.2, 0.4, 2.0, waves, "")


def ended(separation_m: str, leading: float, trailing: float | None) -> Ended:
    forces = [leading] if trailing is None else [leading, trailing]
    summary = {
        "pantographs": [
            {"name": f"p{n}", "std_N": force, "mean_N": 100.0, "loss_percent": None}
            for n, force in enumerate(forces)
        ]
    }
    varied = {separation.SEPARATION: separation_m, separation.WITH: "light"}
    return Ended(Variant(f"v{separation_m}", (), varied), "done", summary)


def test_separations_are_read_in_both_forms() -> None:
    assert separation.parse_separations("31:400:4") == [31.0, 154.0, 277.0, 400.0]
    assert separation.parse_separations("200,31.5") == [31.5, 200.0]


@pytest.mark.parametrize("text", ["", "31", "31:400", "31:400:1", "31:400:1e9", "a,b", "31:400:x"])
def test_other_forms_are_refused_but_for_single_lengths(text: str) -> None:
    if text == "31":
        assert separation.parse_separations(text) == [31.0]
        return
    with pytest.raises(InputError, match="--separations"):
        separation.parse_separations(text)


@pytest.mark.parametrize("text", ["-1,3", "0,5", "31,31", "nan,2", "inf,2"])
def test_impossible_lengths_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="positive lengths, each once"):
        separation.parse_separations(text)


def test_the_trailing_pantograph_starts_where_the_scene_says() -> None:
    given = ["line.n_spans=34", "train.start_m=200", "evaluation.from_m=800",
             "evaluation.to_m=1000"]  # fmt: skip
    scene = load_scene("ambrosio2012", given)
    varied = [parse_vary("line.damping.alpha_s=0.00275,0.0275")]
    jobs = separation.jobs_of("ambrosio2012", scene, [31.0, 200.0], varied, given, False)
    assert len(jobs) == 6 and len({job.variant.name for job in jobs}) == 6
    assert not any(job.keep_results for job in jobs)
    alone, near, far = jobs[:3]
    assert [job.variant.varied[separation.WITH] for job in jobs[2:4]] == [
        "alpha 0.00275 s", "alpha 0.0275 s"
    ]  # fmt: skip
    assert alone.scene.train.start_m == 200.0 and len(alone.scene.train.pantographs) == 1
    assert near.scene.train.start_m == 231.0
    assert [place.behind_m for place in far.scene.train.pantographs] == [0.0, 200.0]
    assert [job.scene.line.damping.alpha_s for job in jobs] == [0.00275] * 3 + [0.0275] * 3
    with pytest.raises(InputError):
        separation.jobs_of("ambrosio2012", scene, [3000.0], varied, given, False)


def test_a_curve_has_both_pantographs_and_one_alone() -> None:
    runs = [ended("200", 11.0, 22.0), ended("", 10.0, None), ended("31", 12.0, 9.0)]
    (curve,) = separation.curves_of(runs)
    assert curve.name == "light" and curve.separation.tolist() == [31.0, 200.0]
    assert curve.alone["std_N"] == 10.0 and np.isnan(curve.alone["loss_percent"])
    assert curve.trailing["std_N"].tolist() == [9.0, 22.0]
    assert curve.leading["std_N"].tolist() == [12.0, 11.0]
    broken = Ended(runs[0].variant, "it broke")
    (curve,) = separation.curves_of([broken, *runs[1:]])
    assert curve.separation.tolist() == [31.0]


@pytest.mark.parametrize("period", [45.0, 72.0])
def test_a_period_is_found_in_a_decaying_curve(period: float) -> None:
    d = np.linspace(31.0, 400.0, 40)
    sigma = 60.0 + 30.0 * np.exp(-d / 250.0) * np.sin(2 * np.pi * d / period + 0.7)
    none = {"std_N": np.nan, "mean_N": np.nan, "loss_percent": np.nan}
    curve = separation.Curve("", d, none, {"std_N": sigma}, {"std_N": sigma})
    found = separation.period_of(curve, theory(), SPAN)
    # Reaches of the fit are not that of the curve.
    assert found.fitted == pytest.approx(period, rel=0.02) and found.explains > 0.98
    np.testing.assert_allclose(found.ringing, [SPEED / BAND[1], SPEED / BAND[0]])
    assert found.travel == pytest.approx(SPAN * (WAVES + SPEED) / WAVES)
    few = curve._replace(separation=d[:5], trailing={"std_N": sigma[:5]})
    assert np.isnan(separation.period_of(few, theory(), SPAN).fitted)
    few.alone["std_N"] = 60.0
    told = separation.as_text([few], theory(), SPAN)
    assert "; no period below 12 separations; ringing" in told and "nan" not in told


@pytest.mark.process
def test_the_verb_runs_and_draws_a_curve(tmp_path: Path) -> None:
    words = ["waves", "en50318_2002", "--short", "--separations", "35", "-o", "pairs",
             "--set", "evaluation.to_m=420", "--set", "mesh.elements_per_gap=3"]  # fmt: skip
    done = catenary(*words, cwd=tmp_path, pictures=True)
    assert done.code == 0, done.stderr
    assert "alone, trailing" in done.stdout
    told = [line for line in done.stdout.splitlines() if line.startswith("REMARK")]
    assert any("alone, 35m: A head of" in line for line in told)
    pairs = tmp_path / "pairs"
    assert (pairs / "separations.png").stat().st_size > 1000
    rows = (pairs / "separations.csv").read_text().splitlines()
    assert len(rows) == 1 + 1 + 2
    # The one alone has no separation, and nothing is varied.
    assert [row.split(",")[:3] for row in rows[1:3]] == [["alone", "", ""], ["35m", "35", ""]]
    again = catenary(*words, cwd=tmp_path, pictures=True)
    assert again.code == 0 and "done already" in again.stdout
    for more, sentence in (
        (["--excite", "pulse"], "--separations runs the train"),
        (["--separations", "5:6"], "--separations 5:6 must be metres"),
        (["--vary", "line.colour=1"], "line.colour"),
    ):
        refused = catenary(*words, *more, cwd=tmp_path)
        assert refused.code == 2 and sentence in refused.stderr, refused.stderr
    lone = catenary("waves", "en50318_2002", "--vary", "mesh.elements_per_gap=3", cwd=tmp_path)
    assert lone.code == 2 and "--vary belongs to --separations" in lone.stderr
