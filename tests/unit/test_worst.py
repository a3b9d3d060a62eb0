"""``catenary worst``: three planted defects are found with figures, and sound spans show none."""

from __future__ import annotations

import csv
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import verb_runner
from scenes import find_case, load_scene, mesh_of, problem_of

from catenary.cases.studies.questions import worst
from catenary.cases.studies.questions.worst import (
    Causes,
    Passage,
    elasticity_along,
    gust_forces,
    stands_out,
    worst_places,
)
from catenary.postproc.evaluate.observations import observe
from catenary.postproc.evaluate.statistics import contact_statistics, evaluate
from catenary.postproc.files.run_schema import COMPLETE
from catenary.postproc.read.results import Results
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.wind import UPWARD, GustField

pytestmark = pytest.mark.usefixtures("quick_reports")

# Three missing droppers, a mass, three droppers cut too short, in spans of 60 m.
PLANTED = {9: "missing", 13: "hard spot of 10 kg", 16: "higher at 930 m"}
CHANGES = (
    "line.n_spans=24",
    "evaluation.to_m=1080",
    "defects=["
    + ",".join(f'{{type="missing_dropper",span=9,dropper={n}}}' for n in (4, 5, 6))
    + ',{type="hard_spot",at_m=750,mass_kg=10}]',
    "irregularities.dropper_lengths.by_dropper=[[16,4,-40],[16,5,-40],[16,6,-40]]",
    "output.field_every_s=0",
)


def invoke(*words: str) -> str:
    done = verb_runner.invoke(*words)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("planted")
    invoke("run", "en50318_2002", "-q", "-o", str(out), *(w for c in CHANGES for w in ("--set", c)))
    return out


@pytest.fixture(scope="module")
def tables(run_folder: Path) -> dict[str, list[dict[str, str]]]:
    """The tables of all places, and what was said as a row."""
    out = run_folder / "worst"
    said = invoke("worst", str(run_folder), "-o", str(out))
    found = {
        name: list(csv.DictReader((out / f"worst_{name}.csv").read_text().splitlines()))
        for name in ("spans", "supports", "droppers")
    }
    return found | {"said": [{"text": said}]}


@pytest.mark.process
def test_the_three_worst_spans_are_those_with_defects(tables: dict[str, Any]) -> None:
    worst = tables["spans"][:3]
    assert {int(row["span"]) for row in worst} == set(PLANTED)
    for row in worst:
        assert PLANTED[int(row["span"])] in row["causes"]
    stand_out = {int(row["span"]) for row in tables["spans"] if row["stands_out"] == "true"}
    assert {9, 13} <= stand_out <= set(PLANTED)
    text = tables["said"][0]["text"]
    assert "span 9, 480 to 540 m" in text and "errors of the droppers' lengths" in text


@pytest.mark.process
def test_spans_away_from_defects_have_no_cause(tables: dict[str, Any]) -> None:
    """Spans 11 and 17 lie a span and more away; in span 18 the reflection arrives, at 1070 m."""
    by_span = {int(row["span"]): row["causes"] for row in tables["spans"]}
    assert by_span[11] == ""
    assert by_span[18].startswith("the reflection from the far end of the line arrives at 1070 m")
    # All that stands out has one, and what is like the others needs none.
    assert "no cause found" not in tables["said"][0]["text"]


@pytest.mark.process
def test_softer_without_droppers(tables: dict[str, Any]) -> None:
    (row,) = (row for row in tables["spans"] if row["span"] == "9")
    assert "elasticity: " in row["causes"] and "softest place (510 m) has" in row["causes"]


@pytest.mark.process
def test_droppers_beside_missing_ones_and_short_ones_stand_out(tables: dict[str, Any]) -> None:
    rows = {float(row["x_m"]): row for row in tables["droppers"]}
    assert float(tables["droppers"][0]["x_m"]) in (497.0, 523.0)
    for x in (497.0, 523.0, 936.5, 943.0):
        assert rows[x]["stands_out"] == "true", x
    assert "dropper at 943.0 m carries" in rows[943.0]["causes"]
    # Those that are missing carry nothing, and are not slack at times.
    assert float(rows[510.0]["max_N"]) == float(rows[510.0]["slack_s"]) == 0.0


def test_figures_of_a_span_are_statistics_of_that_stretch(run_folder: Path) -> None:
    with Results(run_folder) as results:
        places = worst_places(results)
        assert len(places.passages) == 12
        columns = [results.column(name, 0) for name in ("contact_position", "contact_force",
                                                        "wire_height")]  # fmt: skip
        for one in places.passages:
            alone = contact_statistics("p", *columns, results.dt, (one.start, one.end))
            assert one.std == pytest.approx(alone.std)
            assert (one.maximum, one.minimum) == (alone.maximum, alone.minimum)
            assert one.loss == pytest.approx(alone.loss_percent)
        uplift = results.extremes("arm_uplift")[1]
        x = results.line("arm_x")
        inside = (x >= 360) & (x <= 1080)
        assert places.arms[0].value == pytest.approx(1e3 * uplift[inside].max())


def test_missing_droppers_do_not_slacken(run_folder: Path) -> None:
    """Their force is zero throughout; others carry, are slack, and carry again."""
    with Results(run_folder) as results:
        force = results.channel("dropper_force")
        found = evaluate(results)
        droppers = found.droppers
        missing = droppers.evaluated & ~force.any(axis=0)
        assert missing.sum() == 3
        slack = droppers.evaluated & (force <= 0.0).any(axis=0)
        assert droppers.n_slackened == (slack & ~missing).sum() > 30
        assert not droppers.slackened[missing].any()
        alone = replace(found, droppers=replace(droppers, evaluated=missing))
        seen = observe(["dropper_slackenings"], results, alone)
        assert seen["dropper_slackenings"].values == {"": 0.0}


def test_places_that_no_pantograph_has_reached_are_left_out(
    run_folder: Path, tmp_path: Path
) -> None:
    """Their largest uplifts and forces are still to come, and would lower the medians."""
    shutil.copy(run_folder / "run.h5", tmp_path)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        rows = int(np.searchsorted(file["channels/contact_position"][:, 0], 800.0))
        file[COMPLETE][...] = [rows, 0, rows]
    with Results(tmp_path) as results:
        places = worst_places(results)
        text, _ = worst.answer_of(results, 3)
    assert "The record ends with the last pantograph at 800 m: supports and" in text
    # Spans of 60 m: the last mast before 800 m is at 780 m.
    assert max(one.x for one in places.arms) == pytest.approx(780.0)
    assert 780.0 < max(one.x for one in places.forces) <= 800.0
    with Results(run_folder) as results:
        whole = {one.x: one.value for one in worst_places(results).arms}
    assert min(one.value for one in places.arms) > 0.5 * min(whole.values())


def test_a_span_at_whose_end_the_record_ends_within_a_step_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So are the statistics of such a stretch: 262 km/h are 7.3 cm a step, which miss the mast."""
    changes = ("train.speed_km_h=262", "train.end_m=480", "evaluation.to_m=480", "line.n_spans=10",
               "output.field_every_s=0")  # fmt: skip
    out = tmp_path / "out"
    invoke("run", "en50318_2002", "-q", "-o", str(out), *(w for c in changes for w in ("--set", c)))
    with Results(out) as results:
        last = results.column("contact_position", 0)[-1]
        assert 480.0 - 0.073 < last < 480.0
        assert [one.span for one in sorted(worst_places(results).passages)] == [6, 7]
        # Gusts are looked at until the mast is passed, or to the last record before it.
        seen: list[list[tuple[float, ...]]] = []
        monkeypatch.setattr(worst, "gust_forces", lambda rest, when: seen.append(when) or [])
        rest: Any = object()
        monkeypatch.setattr(worst, "elasticity_along", lambda *_: None)
        Causes(results, worst_places(results).passages, rest)._gust_forces  # noqa: B018
        assert max(when[3] for when in seen[0]) == results.time[-1]


def test_what_stands_out_is_far_above_its_likes() -> None:
    likes = np.array([10.0, 10.1, 9.9, 10.0, 10.05, 12.0])
    assert stands_out(likes) == [False] * 5 + [True]
    # Median 10, median absolute deviation 1: three standard deviations are 4.4.
    wide = np.array([8.0, 9.0, 10.0, 11.0, 14.3])
    assert not any(stands_out(wide))
    assert stands_out(np.array([8.0, 9.0, 10.0, 11.0, 14.5])) == [False] * 4 + [True]
    assert stands_out(np.array([1.0, 100.0])) == [None, None]


class _Line:
    """What `Causes` reads of results, of six spans of 50 m."""

    evaluation = (0.0, 300.0)

    def __init__(self, speed: float, arrivals: dict[str, Any]) -> None:
        self.attributes = {"arrivals": arrivals}
        self._speed = speed

    def line(self, name: str) -> np.ndarray:
        return {"support_x": np.arange(0.0, 301.0, 50.0)}.get(name, np.zeros(0))

    def fact(self, name: str) -> float:
        return {"speed": self._speed}[name]


@pytest.mark.parametrize(("speed", "is_told"), [(50.0, True), (54.0, True), (57.0, False)])
def test_spans_passed_at_their_natural_frequency(speed: float, is_told: bool) -> None:
    """Waves of 100 m/s: spans of 50 m have c / 2 L = 1 Hz, and are passed so at 50 m/s."""
    line: Any = _Line(speed, {"wave_speed_m_per_s": 100.0})
    said = Causes(line, [], None).of_line()
    assert bool(said) == is_told
    assert not said or f"{speed / 50:.2f} Hz, near" in said[0] and "= 1.00 Hz" in said[0]


@pytest.mark.parametrize(
    ("met", "share", "is_told"),
    [(120.0, 0.5, True), (60.0, 0.5, True), (40.0, 0.5, False), (160.0, 0.5, False),
     (120.0, 0.005, False), (None, 0.5, False)],
)  # fmt: skip
def test_reflections_are_told_where_they_arrive(
    met: float | None, share: float, is_told: bool
) -> None:
    line: Any = _Line(50.0, {"pantographs": [{"far_end_met_at_m": met, "far_end_share": share}]})
    passage = Passage(2, 100.0, 150.0, 0, 20.0, 200.0, 50.0, 0.0, 20.0, False)
    said = list(Causes(line, [], None)._reflections(passage))
    assert bool(said) == is_told


def test_the_pantograph_ahead_is_told_where_it_is_better() -> None:
    line: Any = _Line(50.0, {})
    leading = Passage(2, 100.0, 150.0, 0, 20.0, 200.0, 50.0, 0.0, 20.0, False)
    worse, alike = (leading._replace(pantograph=1, std=std) for std in (26.0, 24.0))
    causes = Causes(line, [leading, worse], None)
    assert "the pantograph ahead, which has 20.0 N" in "".join(causes._pantograph_ahead(worse))
    third = worse._replace(pantograph=2)
    several = "the pantographs ahead, of which the leading one has 20.0 N"
    assert several in "".join(causes._pantograph_ahead(third))
    assert not list(causes._pantograph_ahead(alike)) and not list(causes._pantograph_ahead(leading))


def test_candidates_are_explained_where_there_are_some(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sentence about candidates stood below places without any."""
    with Results(run_folder) as results:
        assert worst.answer_of(results, 3)[0].endswith("none is proved.")
        for name in ("of_line", "of_passage", "at"):
            monkeypatch.setattr(Causes, name, lambda *_: [])
        text, _ = worst.answer_of(results, 3)
    assert "Spans by standard deviation" in text and "none is proved" not in text


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path / "nowhere", tmp_path):
        done = verb_runner.invoke("worst", str(folder))
        assert done.exit_code == 2 and len(done.output.strip().splitlines()) == 1


def test_elasticity_of_an_overlap_is_that_of_the_wires_that_a_head_meets() -> None:
    scene = load_scene(find_case("overlap"))
    rest = line_at_rest(problem_of(scene), mesh_of(scene))
    masts = rest.problem.line.support_positions
    start, end = float(masts[11]), float(masts[19])  # the overlap is spans 14 to 17, from 1
    x, lift = elasticity_along(rest, start, end)
    found = elasticity(rest.model, start, end)
    # In the first span of the overlap the other wire hangs 0.15 m and more higher; a head of 160 N
    # lifts the lower one by less than 160 N * 0.5 mm/N = 0.08 m.
    alone = (x > masts[13]) & (x < masts[14])
    assert np.isfinite(found.of_wires[alone]).all()
    np.testing.assert_allclose(lift[alone], found.of_wires[alone, 0], rtol=1e-9)
    # At the mast in the middle both are at one height, and a head presses both.
    middle = int(np.argmin(np.abs(x - masts[15])))
    assert lift[middle] == pytest.approx(found.lift[middle], rel=1e-6)
    assert lift[middle] < 0.9 * found.of_wires[middle].min()
    # The ends of the wires, which are anchored 0.6 m higher, are no stiff places: two wires give
    # way half as much as one, whose stiffest place has 0.174 mm/N, or a little more.
    assert found.lift.min() < 1e-9
    assert lift.min() > 0.5 * rest.lift.lift.min() > 0.08e-3


def at_rest(case: str, *changes: str) -> LineAtRest:
    scene = load_scene(find_case(case), changes, shortened=True)
    return line_at_rest(problem_of(scene), mesh_of(scene))


def test_force_of_gusts_on_a_span() -> None:
    """1/2 rho d C_d |W| g_z on two wires that both hang over the whole span, at each time."""
    rest = at_rest("windy_viaduct")
    wind = rest.problem.wind
    assert wind is not None and wind.gusts is not None
    start, end = 605.0, 660.0  # before the viaduct, where the mean is that of the data sheet
    points = np.arange(0.0, rest.mesh.points[:, 0].max() + 1.0, wind.gusts.spacing)
    field = GustField(wind, UPWARD, points, wind.gusts.spacing)
    inside = np.flatnonzero((points >= start) & (points < end))
    gusts = np.zeros((200, inside.size))
    field.fill(100, slice(int(inside[0]), int(inside[-1]) + 1), gusts)
    first, last = 100 * field.interval, 299 * field.interval
    # Diameters of 14.4 and 14 mm and a drag coefficient of 1.2, which no key changes here.
    expected = (
        0.5 * 1.225 * wind.mean * (14.4e-3 + 14.0e-3) * 1.2 * 55.0 * np.abs(gusts.mean(axis=1))
    )
    (found,) = gust_forces(rest, [(start, end, first, last)])
    assert found == pytest.approx(expected.max(), rel=1e-6)


def test_without_gusts_none_press_and_what_is_like_the_others_needs_no_cause() -> None:
    assert gust_forces(at_rest("windy_viaduct", "effects.gusts=false"), [(605, 660, 0, 9)]) == []
    of = worst._with_candidates
    assert of("5 m", True, []) == ("5 m; stands out", ["no cause found"])
    assert of("5 m", True, ["a mass"])[1] == ["a mass"]
    assert of("5 m", False, [])[1] == of("5 m", None, [])[1] == []


@pytest.mark.study
@pytest.mark.process
def test_gusts_are_told_where_they_are_stronger_and_the_force_varies_more(tmp_path: Path) -> None:
    quiet = "-q", "--set", "output.field_every_s=0", "--set", "evaluation.from_m=440"
    invoke("run", "windy_viaduct", "--short", *quiet, "-o", str(tmp_path))
    said = invoke("worst", str(tmp_path), "-o", str(tmp_path / "worst"))
    assert "one run does not tell which share of sigma is theirs" in said
    with (tmp_path / "worst" / "worst_spans.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    figures = [re.search("up to ([0-9]+) N as .* ([0-9]+) N", row["causes"]) for row in rows]
    told = {row["span"]: one for row, one in zip(rows, figures, strict=True) if one}
    assert 0 < len(told) < len(rows) == 6
    for row in rows:
        if row["span"] in told:
            force, usual = map(float, told[row["span"]].groups())
            assert force > 1.05 * usual  # 10 %, of rounded figures
            assert float(row["std_N"]) > float(row["median_std_N"])
