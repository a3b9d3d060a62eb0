"""Reference solutions: their error bars, files, and results of other programs beside them."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from measuring import check
from scenes import problem_of
from verb_runner import invoke

from catenary import InputError
from catenary.cases.studies.reference import validation
from catenary.cases.studies.reference.judgement import (
    FAILED,
    PASSED,
    curve_through,
    judged,
    limits,
    read_results,
)
from catenary.cases.studies.reference.solutions import (
    DATA,
    FINEST,
    HISTORY,
    LINE,
    OF_FORCE,
    PLACE,
    QUANTITIES,
    UPLIFT,
    configurations,
    jobs_of,
    model_table,
    read_solution,
    run_name,
    statistics_of_solution,
)
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.variants import Variant

ONE, TWO = "ac_simple_275_one", "ac_simple_275_two"


def summary_of(
    figures: Callable[[str, str], float], lengths: tuple[float, ...] = (), train: str = "one"
) -> dict[str, Any]:
    """As much of ``summary.json`` as is read, from a figure by place and quantity."""
    places = ["pantograph"] if train == "one" else ["leading", "trailing"]
    pantographs = [
        {"name": of} | {column.name: figures(of, column.name) for column in OF_FORCE}
        for of in places
    ]
    elasticity = {which: figures(LINE, f"elasticity_{which}_mm_per_N") for which in ("max", "min")}
    return {
        "pantographs": pantographs,
        "supports": {UPLIFT: figures(LINE, UPLIFT)},
        "static": {"elasticity_mm_per_N": elasticity, "dropper_lengths_m": list(lengths)},
    }


def test_error_bars_cover_a_law_of_second_order() -> None:
    """Figures 10 + a dt^2 + b h^2: the bar is 1.25 times what the finest run is wrong by."""
    (one,) = configurations([ONE])
    ended = {}
    a, b = 0.8, 30.0
    for job in jobs_of([one]):
        dt = job.scene.numerics.dt_s * 1e3
        h = 1.0 / job.scene.mesh.elements_per_gap
        value = 10.0 + a * dt**2 + b * h**2
        measured = {"histories": [[value, -value]]}
        run = Ended(job.variant, "done", summary_of(lambda *_, v=value: v), measured)
        ended[job.variant.name] = run
    finest = a * one.steps[0] ** 2 + b / one.elements[0] ** 2
    rows = {(row["of"], row["quantity"]): row for row in statistics_of_solution(one, ended)}
    assert set(QUANTITIES) == {quantity for _, quantity in rows}
    for row in rows.values():
        # Rounded to a millionth each.
        assert row["error_bar"] == pytest.approx(1.25 * finest, abs=2e-6)
        assert row["error_bar"] == pytest.approx(
            row["error_of_step"] + row["error_of_mesh"], abs=2e-6
        )
    assert rows["pantograph", "mean_N"]["value"] == pytest.approx(10.0 + finest, abs=1e-6)
    assert rows["pantograph", HISTORY]["value"] == 0.0
    assert ended[run_name(one, FINEST)].measured["histories"]


def test_the_line_is_moved_on_by_whole_spans() -> None:
    (one,) = configurations(["dc_simple_200_one"])
    scene, further = one.scene(), jobs_of([one])[-1].scene
    spans = model_table()["levels"]["further_spans"]
    assert further.line.n_spans - scene.line.n_spans == spans
    assert further.evaluation.from_m - scene.evaluation.from_m == 55.0 * spans
    assert further.evaluation.to_m - scene.evaluation.to_m == 55.0 * spans


@pytest.mark.parametrize("one", configurations(), ids=lambda one: one.name)
def test_shipped_statistics_are_those_of_the_shipped_forces(one: Any) -> None:
    solution = read_solution(one.name)
    scene = one.scene()
    assert solution.stretch == (scene.evaluation.from_m, scene.evaluation.to_m)
    assert {of for of, _ in solution.figures} == {*solution.forces, LINE}
    for of, force in solution.forces.items():
        # 0.25 m of at least 2.8 m, the wave of 20 Hz at 200 km/h: rectangles are exact to the ends
        # of the stretch, which are worth a sample in some 2000; extremes may lie between samples,
        # which costs 1 - cos(pi 0.25 / 2.8) = 4 % of the amplitude of such a wave.
        std, _ = solution.figures[of, "std_N"]
        assert force.mean() == pytest.approx(solution.figures[of, "mean_N"][0], abs=3e-3 * std)
        assert force.std() == pytest.approx(std, abs=3e-3 * std)
        assert force.max() == pytest.approx(solution.figures[of, "max_N"][0], abs=0.04 * std)
        assert force.min() == pytest.approx(solution.figures[of, "min_N"][0], abs=0.04 * std)


def test_error_bars_are_small() -> None:
    """Below 0.02 N in deviations and 0.1 N in extremes."""
    rows = pd.read_csv(DATA / "statistics.csv")
    assert set(rows["configuration"]) == {one.name for one in configurations()}
    bars = rows.set_index(["configuration", "of", "quantity"])["error_bar"].unstack()
    bars = bars[["mean_N", "std_N", "max_N", "min_N", HISTORY]].dropna()
    print(bars.to_string())
    assert (bars["mean_N"] < 0.002).all() and (bars["std_N"] < 0.02).all()
    assert (bars[["max_N", "min_N"]] < 0.1).all(axis=None)
    assert sum(path.stat().st_size for path in DATA.iterdir()) < 2e6


def test_the_guide_has_the_shipped_figures() -> None:
    guide = Path(__file__).parents[2] / "docs/guide/reference_solutions.md"
    text = guide.read_text(encoding="utf-8")
    bar = r"[^|]+ ± [^|]+"
    row = rf"^\| `(\w+)` \| (\w+) \| ({bar} \| {bar} \| {bar}) \| ([\d.]+) \|$"
    shown = re.findall(row, text, re.MULTILINE)
    expected = []
    for one in configurations():
        solution = read_solution(one.name)
        for of in solution.forces:
            bars = [solution.figures[of, name] for name in ("std_N", "max_N", "min_N")]
            cells = " | ".join(f"{value:.3f} ± {bar:.3f}" for value, bar in bars)
            place = of.replace("pantograph", "single")
            expected.append((one.name, place, cells, f"{solution.figures[of, HISTORY][1]:.2f}"))
    assert shown == expected


def test_its_own_forces_are_within_the_bars(tmp_path: Path) -> None:
    """Over place and over time, as they are published."""
    solution = read_solution(TWO)
    train = problem_of(solution.configuration.scene()).train
    given = pd.read_csv(DATA / f"{TWO}.csv")
    for number, of in enumerate(solution.forces):
        path = tmp_path / f"{of}.csv"
        own = given[[f"{of}_N"]].copy()
        start = train.start - train.placements[number].behind
        own.insert(0, "time_s", (given[PLACE] - start) / train.speed)
        own.to_csv(path, index=False)
    paths = [DATA / f"{TWO}.csv", *(tmp_path / f"{of}.csv" for of in solution.forces)]
    for path in paths:
        (found,) = read_results([path], TWO, is_filtered=True)
        rows = {(row["of"], row["quantity"]): row for row in judged(solution, found.figures)}
        for (_, quantity), row in rows.items():
            # Samples every 0.25 m, in thousandths of a newton, of curves below 20 Hz.
            assert abs(row["difference"]) < 0.02, (path, quantity)
            assert row["verdict"] != FAILED
        assert rows["leading" if "leading" in found.forces else "trailing", HISTORY]["value"] < 2e-3


def test_places_and_times_that_differ_are_told(tmp_path: Path) -> None:
    """Times of the leading pantograph beside places at which each one passes: the trailing one is
    200 m behind at these times."""
    given = pd.read_csv(DATA / f"{TWO}.csv")
    train = problem_of(read_solution(TWO).configuration.scene()).train
    given["time_s"] = (given[PLACE] - train.start) / train.speed
    given.to_csv(tmp_path / "forces.csv", index=False)
    (found,) = read_results([tmp_path / "forces.csv"], TWO, is_filtered=True)
    (remark,) = found.remarks
    assert "by which the trailing is up to 200 m elsewhere: place_m counts" in remark
    assert found.figures["trailing", HISTORY] < 2e-3


def test_a_planted_error_is_found(tmp_path: Path) -> None:
    given = pd.read_csv(DATA / f"{ONE}.csv")
    given["pantograph_N"] = 300.0 - given["pantograph_N"] + 9.0
    given.to_csv(tmp_path / "forces.csv", index=False)
    (found,) = read_results([tmp_path / "forces.csv"], ONE, is_filtered=True)
    rows = {row["quantity"]: row for row in judged(found.solution, found.figures)}
    mean, std = (found.solution.figures["pantograph", name][0] for name in ("mean_N", "std_N"))
    assert rows["mean_N"]["difference"] == pytest.approx(309.0 - 2 * mean, abs=2e-3)
    assert rows["mean_N"]["verdict"] == FAILED
    assert rows["std_N"]["verdict"] == PASSED
    gap = np.sqrt((309.0 - 2 * mean) ** 2 + (2 * std) ** 2)
    assert rows[HISTORY]["value"] == pytest.approx(gap, rel=1e-3)
    assert rows[HISTORY]["within_bar"] == "no"


def test_unfiltered_forces_are_filtered(tmp_path: Path) -> None:
    """A ripple of 200 Hz goes; what is left is the shipped force, but for ends of the record."""
    solution = read_solution(ONE)
    speed = problem_of(solution.configuration.scene()).train.speed
    place = np.linspace(*solution.stretch, 14401)
    force = np.interp(place, solution.place, solution.forces["pantograph"])
    force += 30.0 * np.sin(2 * np.pi * 200.0 * place / speed)
    path = tmp_path / "raw.csv"
    pd.DataFrame({PLACE: place, "pantograph_N": force}).to_csv(path, index=False)
    (found,) = read_results([path], ONE, is_filtered=False)
    assert found.figures["pantograph", "std_N"] == pytest.approx(force.std(), rel=0.3)
    # What is filtered twice loses at most half of what is near 20 Hz.
    assert found.figures["pantograph", HISTORY] < 0.1 * solution.figures["pantograph", "std_N"][0]
    assert found.figures["pantograph", "loss_percent"] == 0.0
    (remark,) = found.remarks
    assert "goes on only 0.0 m beyond the stretch" in remark


def rippled(path: Path, spacing: float) -> None:
    """The shipped force and 20 N at 66 Hz, which samples every metre, 76 a second, show as 10."""
    solution = read_solution(ONE)
    train = problem_of(solution.configuration.scene()).train
    start, end = solution.stretch
    place = np.arange(start - 30.0, end + 30.0, spacing)
    force = np.interp(place, solution.place, solution.forces["pantograph"])
    force += 20.0 * np.sin(2 * np.pi * 66.0 * place / train.speed)
    pd.DataFrame({PLACE: place, "pantograph_N": force}).to_csv(path, index=False)


def test_rare_samples_of_unfiltered_forces_are_told(tmp_path: Path) -> None:
    """By its frequency of samples a ripple above the filter becomes one below it."""
    path, off = tmp_path / "raw.csv", {}
    for spacing in (0.25, 1.0):
        rippled(path, spacing)
        (found,) = read_results([path], ONE, is_filtered=False)
        off[spacing] = found.figures["pantograph", HISTORY]
        told = [text for text in found.remarks if "has a sample every" in text]
        assert len(told) == (spacing == 1.0), found.remarks
    assert "every 1 m, 76.4 a second" in told[0] and "faster than 56.4 Hz" in told[0]
    # The whole ripple, beside half of what is near 20 Hz.
    assert off[1.0] > 0.9 * 20.0 / np.sqrt(2) and off[0.25] < 4.0


@pytest.mark.parametrize("spacing", [0.25, 1.0])
def test_forces_that_passed_no_filter_are_told(tmp_path: Path, spacing: float) -> None:
    rippled(tmp_path / "raw.csv", 0.25)
    (found,) = read_results([tmp_path / "raw.csv"], ONE, is_filtered=True)
    (remark,) = found.remarks
    assert "N above 32 Hz" in remark and remark.endswith("takes --unfiltered.")
    filtered = pd.read_csv(DATA / f"{ONE}.csv")[:: round(spacing / 0.25)]
    filtered.to_csv(tmp_path / "filtered.csv", index=False)
    (found,) = read_results([tmp_path / "filtered.csv"], ONE, is_filtered=True)
    assert not found.remarks


@pytest.mark.study
def test_a_table_of_statistics_is_judged(tmp_path: Path) -> None:
    out = tmp_path / "out"
    statistics_file = DATA / "statistics.csv"
    done = invoke("judge", str(statistics_file), "-o", str(out), "--strict")
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader((out / "judged.csv").read_text().splitlines()))
    shipped = list(csv.DictReader(statistics_file.read_text().splitlines()))
    assert len(rows) == len(shipped)
    assert {row["within_bar"] for row in rows} == {"yes"}
    assert {row["verdict"] for row in rows} == {PASSED, "not judged"}
    page = (out / "judged.html").read_text()
    assert "not publicly known" in page and "not compared with the text" in page
    path = tmp_path / "other.csv"
    path.write_text(f"of,quantity,value\nline,{UPLIFT},70\n")
    done = invoke("judge", str(path), "--of", ONE, "--strict")
    assert done.exit_code == 3 and FAILED in done.output


def rows(spacing: float) -> str:
    """Twenty samples of a constant force."""
    lines = (f"{spacing * (k + 1):g},2" for k in range(20))
    return "\n".join(["place_m,pantograph_N", *lines, ""])


def stretch(force: str) -> str:
    """A constant force all along the evaluated stretch."""
    return "\n".join(["place_m,pantograph_N", *(f"{x},{force}" for x in range(540, 1111)), ""])


@pytest.mark.parametrize(
    ("content", "of", "sentence"),
    [
        ("place_m,pantograph_N\n1,2\n2,3\n", None, "name the configuration of its forces"),
        ("place_m,pantograph_N\n1,2\n2,3\n", "ac_simple_275", "did you mean ac_simple_275_"),
        ("place_m,force\n1,2\n2,3\n", ONE, "has no column pantograph_N"),
        ("place_m,pantograph_kN\n1,2\n2,3\n", ONE, "it has place_m, pantograph_kN"),
        ("x,pantograph_N\n1,2\n2,3\n", ONE, "nor quantity, as statistics have: it has x, pant"),
        ("configuration,mean_N,std_N\na,1,2\n", None, "neither a column place_m"),
        (stretch("0.15"), ONE, "gives 0.15 for mean_N of pantograph, where ac_simple_275_one has"),
        ("place_m,pantograph_N\n" + 20 * "1,2\n", ONE, "equidistant samples in ascending order"),
        (rows(1.0), ONE, "covers 1.0 to 20.0 m"),
        (rows(-1.0), ONE, "rows must stand in the order of the passage$"),
        ("place_m,pantograph_N\n", ONE, "has 0 rows; at least 20 are needed"),
        (rows(2000.0), ONE, "has a sample every 2e.03 m"),
        (
            rows(1.0).replace("\n2,2", "\n2,"),
            ONE,
            'has no number in column "pantograph_N", row 2 below',
        ),
        (rows(1.0).replace("\n2,2", "\n2,nan"), ONE, "needs a finite number"),
        (
            rows(1.0).replace("\n2,2", '\n"2,5",2'),
            ONE,
            'has "2,5" in column "place_m", row 2 below its names; write decimal points',
        ),
        ("of,quantity\nline,max_uplift_mm\n", ONE, 'has no column "value"'),
        ("of,quantity,value\nline,max_uplift_mm,nan\n", ONE, 'no number in column "value", row 1'),
        ("of,quantity,value\nline,max_uplift_mm,0.07\n", ONE, "gives 0.07 for max_uplift_mm"),
        (
            "of,quantity,value\nline,max_uplift_mm,70\nline,max_uplift_mm,71\n",
            ONE,
            "gives max_uplift_mm of line for ac_simple_275_one, which was given before",
        ),
        ("of,quantity,value\n", ONE, "has no rows: it gives no statistics"),
        (
            f"configuration,of,quantity,value\n{ONE},line,max_uplift_mm,70\n,line,max_uplift_mm,70\n",
            None,
            'given.csv has nothing in column "configuration", row 2 below its names',
        ),
        (
            f"configuration,of,quantity,value\n{TWO},line,max_uplift_mm,70\n",
            ONE,
            f"has statistics of {TWO}, and --of names {ONE}: leave --of away",
        ),
        ("of,quantity,value\nline,uplift,2\n", ONE, 'has "uplift" of "line"'),
        ("of,quantity,value\nroof,std_N,2\n", ONE, "has figures of pantograph, line"),
        ("of,quantity,value\nline,max_uplift_mm,2\n", None, 'has no column "configuration"'),
    ],
)
def test_what_cannot_be_judged_is_one_sentence(
    tmp_path: Path, content: str, of: str | None, sentence: str
) -> None:
    path = tmp_path / "given.csv"
    path.write_text(content)
    with pytest.raises(InputError, match=sentence.replace("(", r"\(")):
        read_results([path], of, is_filtered=True)


def test_statistics_have_no_filter(tmp_path: Path) -> None:
    """--unfiltered was ignored."""
    path = tmp_path / "given.csv"
    path.write_text("of,quantity,value\nline,max_uplift_mm,70\n")
    done = invoke("judge", str(path), "--of", ONE, "--unfiltered")
    assert done.exit_code == 2 and "these files hold statistics" in done.stderr


def test_forces_that_are_given_twice_are_refused() -> None:
    """The second file took the place of the first, and nothing said so."""
    with pytest.raises(InputError, match="gives mean_N of pantograph for .*, which was given befo"):
        read_results([DATA / f"{ONE}.csv"] * 2, ONE, is_filtered=True)


def test_limits_have_clauses_and_marks() -> None:
    rules = [*limits()["tolerances"], limits()["rest"], limits()["elasticity"], limits()["ranges"]]
    for rule in rules:
        assert rule["clause"] and isinstance(rule["compared"], bool)
        assert rule.get("quantity", UPLIFT) in QUANTITIES


@pytest.fixture
def runs_of_validation() -> dict[str, Ended]:
    """Runs whose figures are the reference's, or in the middle of accepted ranges."""
    lengths = validation._reference("ac_simple", "dropper_lengths.csv")
    ranges = {
        (f"en50318_2002_{row['speed_km_h']}", validation._OF_RANGES[row["quantity"]]): 0.5
        * (float(row["lower"]) + float(row["upper"]))
        for row in validation._reference("en50318_2002", "accepted_ranges.csv")
    }
    nominal = tuple(float(row["length_m"]) for row in lengths)
    ended = {}
    for name in ("en50318_2002_250", "en50318_2002_300"):
        summary = summary_of(lambda _, quantity, n=name: ranges.get((n, quantity), 0.1))
        ended[name] = Ended(Variant(name, ()), "done", summary)
    for one in configurations():
        figures = read_solution(one.name).figures
        summary = summary_of(lambda *key, f=figures: f[key][0], nominal, one.train)
        ended[one.name] = Ended(Variant(one.name, ()), "done", summary)
    assert {job.variant.name for job in validation.jobs_of_validation()} == set(ended)
    return ended


def test_a_validation_finds_what_is_wrong(runs_of_validation: dict[str, Ended]) -> None:
    no_test = validation.line_test(None)
    found = validation.validate(list(runs_of_validation.values()), no_test)
    rest, elasticity, ranges, reference, line_test = found.steps
    assert (len(rest.rows), len(elasticity.rows), len(ranges.rows)) == (9, 6, 16)
    assert len({row["configuration"] for row in reference.rows}) == 12
    assert not line_test.rows and "no line test" in line_test.text
    assert {row["verdict"] for row in found.rows} == {PASSED, "not judged"}
    wrong = runs_of_validation
    wrong["ac_simple_275_one"].summary["static"]["dropper_lengths_m"][1] += 0.0049
    wrong["ac_simple_275_one"].summary["static"]["dropper_lengths_m"][2] += 0.0051
    wrong["ac_simple_275_one"].summary["static"]["elasticity_mm_per_N"]["max"] *= 1.011
    wrong["en50318_2002_300"].summary["pantographs"][0]["std_N"] = 40.01
    wrong["dc_simple_250_two"].summary["pantographs"][1]["std_N"] *= 1.21
    wrong["ac_stitched_320_one"].summary["supports"][UPLIFT] *= 0.79
    steps = validation.validate(list(wrong.values()), no_test).steps
    failed = [[row for row in step.rows if row["verdict"] == FAILED] for step in steps]
    assert [len(rows) for rows in failed] == [1, 1, 1, 2, 0]
    assert failed[3][1]["configuration"] == "dc_simple_250_two"
    assert failed[3][1]["of"] == "trailing" and failed[3][1]["quantity"] == "std_N"


def test_a_curve_through_samples_of_each_metre_is_that_of_the_force() -> None:
    """20 N at 5, 12 and 18 Hz each at 76.4 m/s. Between samples a spline of degree n takes a share
    r^(n + 1) of its alias for a wave, on either side, r = f / (f_s - f): of 18 Hz 8e-5 at n = 7,
    and 1 %, 0.5 N, at n = 3."""

    def force(x: np.ndarray) -> np.ndarray:
        sines = [20.0 * np.sin(2.0 * np.pi * f * x / 76.4 + f) for f in (5.0, 12.0, 18.0)]
        return np.asarray(140.0 + sum(sines))

    place, fine = np.arange(0.0, 400.0), np.arange(50.0, 350.0, 0.05)
    off = curve_through(place, force(place))(fine) - force(fine)
    # With a half for the other two waves.
    check("force [N]", off, 0.0, within=1.5 * 2.0 * 20.0 * (18.0 / (76.4 - 18.0)) ** 8)


def test_names_of_models_and_configurations_choose() -> None:
    assert [one.name for one in configurations([ONE])] == [ONE]
    assert len(configurations(["dc_simple"])) == 4
    with pytest.raises(InputError, match="did you mean dc_simple"):
        configurations(["dc_simpel"])
