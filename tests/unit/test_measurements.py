"""``catenary compare`` with a measurement and with several runs: what is read, told and written."""

from __future__ import annotations

import gzip
import json
import re
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import verb_runner
from measuring import check
from mpi4py import MPI
from scenes import load_scene
from scipy import signal, stats

from catenary import InputError
from catenary.cases.run.runner import run_case
from catenary.cases.studies.measured import Description, passage_of
from catenary.cases.studies.reference.judgement import FAILED, NOT_JUDGED, PASSED, any_failed
from catenary.cases.studies.reference.validation import line_test
from catenary.cases.studies.task_files import checked_table
from catenary.postproc.evaluate.compare import SpanSums, compare, differences, span_sums
from catenary.postproc.files.run_schema import COMPLETE
from catenary.postproc.measurements import compared
from catenary.postproc.measurements.alignment import align, correlation_time
from catenary.postproc.measurements.compared import Comparison
from catenary.postproc.measurements.comparison import compare_with
from catenary.postproc.measurements.passage import RunForce
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.usefixtures("quick_reports")

# Nine spans with two elements a gap, 6.7 s at 2 ms.
SCENE = (
    "line.n_spans=9", "mesh.elements_per_gap=2", "train.start_m=65", "train.end_m=475",
    "train.raise_time_s=0.2", "numerics.dt_s=0.002", "evaluation.from_m=120",
    "evaluation.to_m=420", "output.field_every_s=0",
)  # fmt: skip
PLACES: dict[str, Any] = {"place": {"column": "place_m"}, "force": {"column": "force_N"}}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("run")
    run_case(load_scene("en50318_2002", [*SCENE]), folder, MPI.COMM_SELF, only_summary=True)
    return folder


@pytest.fixture(scope="module")
def table(run: Path) -> pd.DataFrame:
    """The passage of the run itself, below 20 Hz by SciPy's own filter, with 2 N of noise."""
    with Results(run) as results:
        position = results.column("contact_position", 0)
        sos = signal.butter(6, 20.0, fs=500.0, output="sos")
        force = signal.sosfiltfilt(sos, results.column("contact_force", 0), padlen=150)
        height = signal.sosfiltfilt(sos, results.column("head_height", 0), padlen=150)
    force = force + 2.0 * np.random.default_rng(0).normal(size=force.size)
    return pd.DataFrame({"place_m": position, "force_N": force, "head_height_m": height})[::2]


def found_in(run: Path, table: pd.DataFrame, folder: Path = Path(), **tables: Any) -> Comparison:
    """What a description tells of a table."""
    tables.setdefault("measured", PLACES)
    with Results(run) as results:
        own = checked_table(tables, Description, "m.toml")
        return compare_with(results, passage_of(table, Path("m.csv"), own, folder, results))


# --- figures and findings ------------------------------------------------------------------------


def test_figures_of_the_measurement_are_those_of_its_samples(
    run: Path, table: pd.DataFrame
) -> None:
    found = found_in(run, table)
    own = table[(table.place_m >= 120.0) & (table.place_m <= 420.0)].force_N
    by_name = {one.figure: one for one in found.figures}
    # The alignment moves the stretch by millimetres: a sample less or more of a thousand,
    # which is off the mean by up to 80 N.
    check("mean", by_name["mean"].measured, own.mean(), within=0.1)
    check("deviation", by_name["standard deviation"].measured, own.std(ddof=0), within=0.1)
    assert found.findings == [] and found.passed is True
    assert by_name["mean"].passed is None and "no tolerance is known" in by_name["mean"].because


def test_given_tolerances_are_kept(run: Path, table: pd.DataFrame) -> None:
    table = table.assign(force_N=table.force_N + 10.0)
    found = found_in(run, table, tolerances={"mean_N": 5.0, "maximum_N": 50.0, "std_percent": 30.0})
    judged = {one.figure: (one.passed, one.source, one.tolerance) for one in found.figures}
    assert judged["mean"] == (False, "description", 5.0) and found.passed is False
    assert judged["maximum"] == (True, "description", 50.0)
    deviation = next(one for one in found.figures if one.figure == "standard deviation")
    assert deviation.tolerance == pytest.approx(0.3 * deviation.measured)


def test_an_offset_is_told_unless_it_is_a_stated_bias(run: Path, table: pd.DataFrame) -> None:
    table = table.assign(force_N=table.force_N + 8.0, head_height_m=table.head_height_m + 0.006)
    heights = {**PLACES, "head_height": {"column": "head_height_m"}}
    found = found_in(run, table, measured=heights)
    assert [one.kind for one in found.findings] == ["gain", "height"]
    assert "an offset of +8.0 N" in found.findings[0].text
    assert found.findings[1].value == pytest.approx(0.006, abs=1e-4)
    stated = {
        "place": {"column": "place_m"},
        "force": {"column": "force_N", "bias": 4.0},
        "head_height": {"column": "head_height_m", "bias": 0.003},
    }
    assert found_in(run, table, measured=stated).findings == []


def test_a_filter_that_was_taken_for_granted_is_told_as_such(
    run: Path, table: pd.DataFrame
) -> None:
    with Results(run) as results:
        position, force = (results.column(f"contact_{of}", 0) for of in ("position", "force"))
    raw = np.interp(table.place_m, position, force)
    found = found_in(run, table.assign(force_N=raw), measured=PLACES)
    (text,) = (one.text for one in found.findings if one.kind == "filter")
    assert "no filter, and are taken for filtered at 20 Hz (is_filtered" in text


def test_noise_that_was_stated_is_beside_what_remains(run: Path, table: pd.DataFrame) -> None:
    told = {noise: found_in(run, table, measured={**PLACES, "force": {
        "column": "force_N", "noise": noise}}).remarks for noise in (2.0, 0.5)}  # fmt: skip
    assert not any("stated noise" in text for text in told[2.0])
    (text,) = (text for text in told[0.5] if "stated noise" in text)
    # The root of 2^2 - 0.5^2, of noise with 3 % of its own.
    assert "the stated noise of 0.50 N: run" in text
    assert float(text.split("differ by ")[1].split(" N")[0]) == pytest.approx(1.94, rel=0.1)


def test_a_damaged_run_is_told_and_one_that_ends_before_the_stretch_refused(
    run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    shutil.copy(run / "run.h5", tmp_path)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["time"][2800:] = np.nan
    assert any("time is damaged from record" in one for one in found_in(tmp_path, table).remarks)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["time"][300:] = np.nan
    words = (
        r"has the pantograph from 65 to 106\.\d+ m, outside of the compared stretch, 120 to 420 m"
    )
    with pytest.raises(InputError, match=words):
        found_in(tmp_path, table)


def test_noise_of_heights_is_beside_what_remains(run: Path, table: pd.DataFrame) -> None:
    noise = 4e-3 * np.random.default_rng(7).normal(size=len(table))
    table = table.assign(head_height_m=table.head_height_m + noise)
    column = {"column": "head_height_m", "noise": 1e-3}
    remarks = found_in(run, table, measured={**PLACES, "head_height": column}).remarks
    (text,) = (text for text in remarks if "stated noise" in text)
    # The root of 4^2 - 1^2, of noise with 3 % of its own.
    assert "the stated noise of 1.00 mm: run" in text
    assert float(text.split("differ by ")[1].split(" mm")[0]) == pytest.approx(3.87, rel=0.1)


def test_forces_of_another_world_are_not_aligned(run: Path, table: pd.DataFrame) -> None:
    rng = np.random.default_rng(3)
    smooth = signal.sosfiltfilt(
        signal.butter(4, 2.0, fs=250.0, output="sos"), rng.normal(size=len(table))
    )
    table = table.assign(force_N=120.0 + 25.0 / smooth.std() * smooth)
    found = found_in(run, table)
    assert [one.kind for one in found.findings] == ["unlike"]
    assert found.overlays[0].alignment is None


@pytest.mark.parametrize(
    ("factor", "kind", "words"),
    [
        (-1.0, "sign", "a force counts positive where it presses on the wire"),
        (1e-3, "unit", "check the unit of its column, N or kN"),
        (1e3, "unit", "check the unit of its column, N or kN"),
        (-1e-3, "unit", "check the unit of its column, N or kN"),
    ],
)
def test_forces_of_another_sign_or_unit_are_named(
    run: Path, table: pd.DataFrame, factor: float, kind: str, words: str
) -> None:
    found = found_in(run, table.assign(force_N=factor * table.force_N))
    assert [one.kind for one in found.findings] == [kind]
    assert words in found.findings[0].text and not found.figures


def test_a_lowered_pantograph_has_no_other_unit(run: Path, table: pd.DataFrame) -> None:
    """Its sensor shows a noise of 2 N about zero, where the run has 120 N with 27 N about it."""
    noise = 2.0 * np.random.default_rng(5).normal(size=len(table))
    found = found_in(run, table.assign(force_N=noise))
    assert [one.kind for one in found.findings] == ["missing pantograph"]


@pytest.mark.parametrize("is_filtered", [True, False])
def test_gaps_are_left_out_and_told(run: Path, table: pd.DataFrame, is_filtered: bool) -> None:
    """A hole of 14 m at a span's highest forces, and single cells: figures of both are those of
    the other samples, and what remains is the noise alone."""
    holed = table.copy()
    if not is_filtered:
        with Results(run) as results:
            holed.force_N = results.column("contact_force", 0)[::2]
    place, force = holed.place_m.to_numpy(), holed.force_N.to_numpy(copy=True)
    highest = int(np.argmax(np.where((place > 200.0) & (place < 350.0), force, 0.0)))
    gap = np.zeros(place.size, dtype=bool)
    gap[highest - 25 : highest + 25] = gap[[900, 905, 1010]] = True
    holed.loc[gap, "force_N"] = np.nan
    holed.iloc[:10, 1] = holed.iloc[-10:, 1] = np.nan  # outside of the stretch, and no gaps
    found = found_in(run, holed, measured={**PLACES, "is_filtered": is_filtered})
    assert [(one.kind, one.value) for one in found.findings] == [("gaps", float(gap.sum()))]
    alignment = found.overlays[0].alignment
    assert alignment is not None
    at = found.overlays[0].place
    inside = (place >= 120.0) & (place <= 420.0) & ~gap
    if is_filtered:
        assert alignment.residual < 1.1 * 2.0  # of the noise; straight lines left 5 N
        assert abs(at.size - np.count_nonzero(inside)) <= 2  # at the ends, by the shift found
    else:  # single cells of 4 ms are bridged for the filter, with a newton or less
        assert alignment.residual < 1.0
        # A wave of 20 Hz, 3.5 m, beyond the ends of the hole is left out, too.
        beyond = np.abs(at - place[highest])
        assert beyond.min() > 25 * (place[1] - place[0]) + 3.0
    figures = {one.figure: one for one in found.figures}
    with Results(run) as results:
        raw, position = results.column("contact_force", 0), results.column("contact_position", 0)
    whole = signal.sosfiltfilt(signal.butter(6, 20.0, fs=500.0, output="sos"), raw, padlen=150)
    own = np.interp(at, position, whole)
    # Of 700 samples with 2 N the mean has 0.08 N, the deviation 0.06 N; at twice their spacing.
    check("mean", figures["mean"].run, own.mean(), within=0.1)
    check("measured mean", figures["mean"].measured, own.mean(), within=0.3)
    check("measured deviation", figures["standard deviation"].measured, own.std(), within=0.3)


def test_gaps_of_heights_are_left_out_and_told(run: Path, table: pd.DataFrame) -> None:
    """A hole at the lowest head beside a force without one: the range is that of the others."""
    holed = table.copy()
    place, height = table.place_m.to_numpy(), table.head_height_m.to_numpy()
    inside = (place >= 120.0) & (place <= 420.0)
    lowest = int(np.argmin(np.where(inside, height, 9.0)))
    gap = np.zeros(place.size, dtype=bool)
    gap[lowest - 30 : lowest + 30] = True
    holed.loc[gap, "head_height_m"] = np.nan
    measured = {**PLACES, "head_height": {"column": "head_height_m"}}
    found = found_in(run, holed, measured=measured)
    assert [(one.kind, one.value) for one in found.findings] == [("gaps", 60.0)]
    heights = {one.figure: one for one in found.figures}["range of head height"]
    others = 1e3 * float(np.ptp(height[inside & ~gap]))
    # One sample more or less at the ends, 0.28 m on slopes of 1 in 1000.
    assert others < 1e3 * float(np.ptp(height[inside])) - 1.2
    check("run", heights.run, others, within=0.4)
    check("measured", heights.measured, others, within=0.4)
    holed.loc[: len(holed), "head_height_m"] = np.nan
    found = found_in(run, holed, measured=measured)
    assert "heights are not compared" in found.findings[0].text


def test_places_that_count_against_the_train_are_turned(run: Path, table: pd.DataFrame) -> None:
    """Kilometre posts that fall from 12.3 km at the begin of the line."""
    posts = table.assign(post=12.3 - 1e-3 * table.place_m)
    place = {"column": "post", "unit": "km", "zero_m": 12300.0, "direction": "against"}
    found = found_in(run, posts, measured={**PLACES, "place": place})
    alignment = found.overlays[0].alignment
    assert found.findings == [] and alignment is not None
    check("shift", alignment.shift.value, 0.0, within=5.0 * alignment.shift.deviation)
    with pytest.raises(InputError, match="fall along the line"):
        found_in(run, posts, measured={**PLACES, "place": {**place, "direction": "with"}})


def test_uplifts_are_found_at_their_supports(
    run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    with Results(run) as results:
        x, uplift = results.line("arm_x"), results.extremes("arm_uplift")[1]
    rows = [f"{a + 3.0:.3f},{1e3 * b + 30.0:.4f}" for a, b in zip(x, uplift, strict=True)]
    (tmp_path / "u.csv").write_text("\n".join(["x,u", *rows]), encoding="utf-8")
    columns = {"place": {"column": "x"}, "largest": {"column": "u", "unit": "mm"}}
    found = found_in(run, table, tmp_path, uplift={"file": "u.csv", **columns})
    assert [one.kind for one in found.findings] == ["supports"]
    assert found.findings[0].value == pytest.approx(3.0, abs=1e-3)
    assert found.uplift is not None
    inside = (x >= 120.0) & (x <= 420.0)
    np.testing.assert_allclose(found.uplift.run, uplift[inside])
    # All 30 mm higher, beyond 20 mm and without scatter.
    assert found.figures[-1].passed is False
    with pytest.raises(InputError, match="name a file beside the description"):
        found_in(run, table, tmp_path, uplift={"file": "../u.csv", **columns})


def test_shifts_that_fit_as_well_are_told() -> None:
    """A force that repeats itself every 60 m, and a record with noise of it."""
    position = np.arange(0.0, 600.0, 0.1)
    force = 120.0 + 30.0 * np.sin(2.0 * np.pi * position / 60.0)
    force += 20.0 * np.sin(2.0 * np.pi * position / 12.0)
    run = RunForce(position, force, 0.1 / 70.0)
    rng = np.random.default_rng(1)
    place = position[1000:5000:5]
    measured = force[1000:5000:5] + 3.0 * rng.normal(size=place.size)
    found = align(place + 58.0, measured, run, (120.0, 480.0), 20.0, True)
    assert found is not None
    # The smallest shift is taken.
    check("shift", found.shift.value, -2.0, within=5.0 * found.shift.deviation)
    assert 58.0 in np.round(found.other_shifts)


def test_a_passage_that_ends_early_is_compared_where_it_has_values(
    run: Path, table: pd.DataFrame
) -> None:
    """From 250 m on it has 77 m, of the 170 m that are compared and of 262 m of its own."""
    measured = {**PLACES, "from_m": 250.0}
    found = found_in(run, table[table.place_m < 327.0], measured=measured)
    assert [one.kind for one in found.findings] == []
    assert any("compared from 250 to 327 m" in text for text in found.remarks)
    assert not any("compared from" in text for text in found_in(run, table).remarks)


@pytest.mark.study
def test_a_long_record_is_aligned_from_its_middle_outwards() -> None:
    """20 km with a drift of 3 in 1000, which is 30 m at its ends."""
    rng, n, speed, dt = np.random.default_rng(5), 150_000, 70.0, 2e-3
    position = speed * dt * np.arange(n)
    sos = signal.butter(4, 12.0, fs=1.0 / dt, output="sos")
    waves = signal.sosfiltfilt(sos, rng.normal(size=n))
    force = 120.0 + 20.0 * np.sin(position / 9.0) + 15.0 / waves.std() * waves
    part = slice(3000, -3000, 3)
    place = position + 500.0 + 3e-3 * (position - position.mean())
    measured = force[part] + 5.0 * rng.normal(size=force[part].size)
    found = align(
        place[part], measured, RunForce(position, force, dt), (300.0, 20700.0), 20.0, True
    )
    assert found is not None
    # Of the middle of what is compared, by the file's places.
    expected = 500.0 + 3e-3 * (position[part].mean() - position.mean())
    check("shift", found.shift.value, expected, within=5.0 * found.shift.deviation + 0.01)
    # By the file's places, which are longer by the drift.
    expected = 3e-3 / (1.0 + 3e-3)
    check("drift", found.drift.value, expected, within=5.0 * found.drift.deviation)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_the_time_of_correlation_is_that_of_a_series(memory: float) -> None:
    """First-order: 1 + 2 sum of a^k is (1 + a) / (1 - a), cut off at correlations of 0.05."""
    rng = np.random.default_rng(2)
    series = signal.lfilter([1.0], [1.0, -memory], rng.normal(size=100_000))
    expected = (1.0 + memory) / (1.0 - memory)
    # What is cut off is 0.05 a / (1 - a) twice: 0.4 of 9.
    check("time", correlation_time(series), expected, within=0.05 * expected + 0.05)


# --- differences of runs by spans ----------------------------------------------------------------


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    """Of spans with as many samples each: the deviation of their means over the root of n."""
    rng = np.random.default_rng(4)
    edges = np.arange(0.0, 481.0, 60.0)
    position = np.arange(0.25, 480.0, 0.5)
    a = 120.0 + 20.0 * rng.normal(size=position.size)
    b = a + 1.0 + rng.normal(size=8).repeat(120)
    sums = span_sums(position, a, edges), span_sums(position, b, edges)
    found = differences(*sums, paired=True)
    assert found is not None
    per_span = (b - a).reshape(8, 120).mean(axis=1)
    expected = stats.t.interval(0.95, 7, per_span.mean(), stats.sem(per_span))
    check("mean", found[0].value, per_span.mean(), within=1e-10)
    check("interval", np.array(found[0][1:]), np.array(expected), within=1e-9)
    assert differences(*(SpanSums(*(one[:3] for one in own)) for own in sums), True) is None


def test_a_stretch_without_masts_has_no_spans() -> None:
    """Nothing is said of differences there, whatever the records hold."""
    place, force = np.linspace(10.0, 20.0, 9), np.full(9, 120.0)
    for edges in (np.zeros(0), np.array([15.0])):
        sums = span_sums(place, force, edges)
        assert sums.samples.size == 0
        assert differences(sums, sums, paired=True) is None


@pytest.mark.parametrize("paired", [True, False])
def test_chance_is_called_more_in_a_twentieth_of_cases(paired: bool) -> None:
    """Two runs of independent spans: of 400, 20 with a deviation of 4.4; five of these allowed."""
    rng = np.random.default_rng(6)
    wrong = np.zeros(2)
    edges, position = np.arange(11.0), np.arange(0.005, 10.0, 0.01)
    for _ in range(400):
        forces = [
            rng.normal(120.0, 5.0, 10).repeat(100) + rng.normal(25.0, 3.0, 10).repeat(100) * wave
            for wave in np.sin(2.0 * np.pi * 5.0 * position)[None].repeat(2, axis=0)
        ]
        found = differences(*(span_sums(position, own, edges) for own in forces), paired)
        assert found is not None
        wrong += [one.is_certain for one in found]
    check("wrong", wrong, np.full(2, 20.0), within=22.0)
    sure = differences(
        span_sums(position, forces[0], edges), span_sums(position, forces[0] * 1.5, edges), paired
    )
    assert sure is not None and sure[0].is_certain


def test_intervals_of_a_mean_hold_for_samples_that_depend_on_each_other() -> None:
    """Two runs of 12 spans whose difference is 1 N and a first-order series that remembers a fifth
    of a span: the interval misses 1 N in 5 % of 400 cases, with a deviation of 1.1 %.

    Half a variance of a span's mean is shared with the next one at most, which widens the spread of
    means by a tenth: up to 8 % are expected. Samples taken as independent would miss it in most.
    """
    rng, memory = np.random.default_rng(8), np.exp(-1.0 / 20.0)
    edges, position = np.arange(13.0), np.arange(0.005, 12.0, 0.01)
    missed = naive = 0
    for _ in range(400):
        apart = 1.0 + signal.lfilter([1.0], [1.0, -memory], rng.normal(size=1700))[500:]
        sums = [span_sums(position, 120.0 + own, edges) for own in (0.0 * apart, apart)]
        found = differences(*sums, paired=True)
        assert found is not None
        missed += not found[0].low <= 1.0 <= found[0].high
        low, high = stats.t.interval(0.95, apart.size - 1, apart.mean(), stats.sem(apart))
        naive += not low <= 1.0 <= high
    # Three deviations beyond either bound.
    assert 0.05 * 400 - 3 * 4.4 < missed < 0.08 * 400 + 3 * 5.4
    assert naive > 200


def test_a_difference_from_a_measurement_has_its_interval(run: Path, table: pd.DataFrame) -> None:
    """A constant of 3 N is more than chance in the mean; 2 N of noise change the deviation by
    2^2 / (2 * 26) = 0.08 N. An interval holds what was added."""
    shifted = table.assign(force_N=table.force_N + 3.0)
    said = [text for text in found_in(run, shifted).remarks if "confidence of 95 %" in text]
    mean, deviation = said
    words = r"within ([-+][0-9.]+) to ([-+][0-9.]+) N with a confidence of 95 %: (.*)"
    low, high, chance = re.search(words, mean).groups()  # type: ignore[union-attr]
    assert mean.startswith("pantograph: mean, run - measured") and chance == "more than chance"
    assert float(low) <= -3.0 <= float(high)
    # The figures of the table have the difference; an interval is about it.
    check("mean", 0.5 * (float(low) + float(high)), -3.0, within=0.5)
    assert deviation.startswith("pantograph: standard deviation, run - measured")


def test_three_runs_stand_side_by_side(run: Path, tmp_path: Path) -> None:
    scene = load_scene("en50318_2002", [*SCENE, "train.speed_km_h=275"])
    run_case(scene, tmp_path, MPI.COMM_SELF, only_summary=True)
    lines = compare(run, run, tmp_path).splitlines()
    (head,) = (line for line in lines if line.split()[-2:] == ["-", "A"] and "B - A" in line)
    assert head.split() == ["A", "B", "C", "B", "-", "A", "C", "-", "A"]
    (mean,) = (line.split() for line in lines if line.startswith("  mean [N]"))
    assert mean[2] == mean[3] and float(mean[5]) == 0.0
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (tmp_path, run)]
    faster, slower = (one["pantographs"][0]["mean_N"] for one in summaries)
    # Rounded to half a unit of its last decimal.
    last = 10.0 ** -len(mean[6].partition(".")[2])
    assert float(mean[6]) == pytest.approx(faster - slower, abs=0.501 * last)
    by_spans = [line for line in lines if line.endswith(("within chance", "more than chance"))]
    assert len(by_spans) == 4
    assert all(re.search(r"- A +\S+ +\S+ to +\S+ (within|more than) chance", r) for r in by_spans)
    # The stretch is of whole spans, its last record included: both tables have one difference.
    *_, again = (line for line in by_spans if line.startswith("  pantograph mean"))
    assert float(again.split("C - A")[1].split()[0]) == pytest.approx(faster - slower, abs=6e-4)
    assert by_spans[-1].startswith("  pantograph standard deviation C - A")
    assert sum("Largest difference" in line for line in lines) == 1
    assert any(line.startswith("C - A: The runs differ") for line in lines)


# --- the command line ----------------------------------------------------------------------------


def invoke(*words: str) -> Any:
    return verb_runner.invoke("compare", *words)


def test_part_of_a_span_is_no_sample_of_a_difference(run: Path, tmp_path: Path) -> None:
    """Of the five evaluated spans the second record ends within the last."""
    shutil.copy(run / "run.h5", tmp_path)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        rows = int(np.searchsorted(file["channels/contact_position"][:, 0], 400.0))
        file[COMPLETE][...] = [rows, 0, rows]
    assert "differences [N] by the spread" in compare(run, run)
    assert "differences [N] by the spread" not in compare(run, tmp_path)


def test_stretches_that_differ_are_told(run: Path, tmp_path: Path) -> None:
    """Figures of one record over other places are no difference of two lines."""
    shutil.copy(run / "run.h5", tmp_path)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["line/evaluation_range"][...] = [120.0, 405.0]
    told = "the evaluated stretches differ: A from 120 to 420 m, B from 120 to 405 m"
    assert told in compare(run, tmp_path).splitlines()
    assert "different stretches" not in compare(run, run)


def test_a_validation_takes_a_comparison_as_its_line_test(
    run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    """A force sensor shows 4 N too much, of which the description allows 2.5 N."""
    off = table.assign(force_N=table["force_N"] + 4.0)
    compared.write_comparison(tmp_path, found_in(run, off, tolerances={"mean_N": 2.5}))
    step = line_test(tmp_path)
    rows = {row["quantity"]: row for row in step.rows}
    mean = rows["mean [N]"]
    assert mean["verdict"] == FAILED and mean["difference"] == pytest.approx(-4.0, abs=0.1)
    assert mean["upper"] - mean["reference"] == pytest.approx(2.5) and mean["compared"]
    assert mean["configuration"] == run.name
    deviation = rows["standard deviation [N]"]
    assert deviation["verdict"] == PASSED and not deviation["compared"]
    assert rows["maximum [N]"]["verdict"] == NOT_JUDGED  # no tolerance is known
    assert any_failed(step.rows)
    assert "m.csv beside" in step.text and "Error: pantograph: the measured force" in step.text
    (tmp_path / "measurement.json").write_text("{}")
    with pytest.raises(InputError, match="is no record of `catenary compare RUN measured.csv`"):
        line_test(tmp_path)


@pytest.mark.parametrize("name", ["m.csv.gz", "m.txt", "m"])
def test_a_measurement_of_another_kind_is_no_damaged_run(
    run: Path, table: pd.DataFrame, tmp_path: Path, name: str
) -> None:
    """The sentence was about HDF5."""
    file = tmp_path / name
    table.to_csv(file, index=False)  # what ends in .gz is compressed
    for words in ([str(run), str(file)], [str(file), str(run)]):
        done = invoke(*words)
        assert done.exit_code == 2 and f"{file} is neither a run nor a meas" in done.stderr
    packed = tmp_path / "m.csv"
    for content, says in (
        (gzip.compress(b"place_m,force_N"), "is compressed with gzip: unpack it"),
        (b"PK\x03\x04", "is a workbook of a spreadsheet or a ZIP archive: export it as CSV"),
    ):
        packed.write_bytes(content)
        done = invoke(str(run), str(packed))
        assert done.exit_code == 2 and says in done.stderr


@pytest.mark.process
def test_a_file_with_the_usual_names_needs_no_description(
    run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    file, out = tmp_path / "m.csv", tmp_path / "out"
    table.to_csv(file, index=False, sep=";", decimal=",")
    done = invoke(str(run), str(file), "-o", str(out))
    assert done.exit_code == 0, done.output
    assert "No error is seen" in done.stdout and "standard deviation" in done.stdout
    about = json.loads((out / "measurement.json").read_text())
    assert about["errors"] == [] and about["passed"] is True
    assert abs(about["alignments"]["pantograph"]["shift"]["value"]) < 0.1
    forces = pd.read_csv(out / "forces.csv")
    assert list(forces.columns[:4]) == ["pantograph", "place_m", "measured_N", "run_N"]
    # Noise of 2 N, to 5 deviations of its deviation.
    left = (forces.measured_N - forces.run_N).std()
    check("noise", left, 2.0, within=5.0 * 2.0 / np.sqrt(2.0 * len(forces)))
    page = (out / "measurement.html").read_text()
    assert "data:image/png" in page and "No error is seen" in page
    again = invoke(str(run), str(file), "-o", str(out))
    assert again.exit_code == 2 and "is there already" in again.output


@pytest.mark.process
@pytest.mark.parametrize(
    ("columns", "told"),
    [
        (
            ["force_kN"],
            "m.csv has 2 columns of a force, force_N, force_kN: say which one is of the",
        ),
        (["Force_2_N"], "force_N, Force_2_N: say which one is of the pantograph by measured.force"),
        (["head_height_m", "head_height_mm"], "2 columns of a head height, head_height_m, head_"),
    ],
)
def test_several_columns_of_a_signal_are_refused_without_a_description(
    columns: list[str], told: str, run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    file = tmp_path / "m.csv"
    table.assign(**{name: 0.0 for name in columns}).to_csv(file, index=False)
    done = invoke(str(run), str(file))
    assert done.exit_code == 2, done.output
    assert told in " ".join(done.output.split())


@pytest.mark.process
@pytest.mark.parametrize(
    ("description", "told"),
    [
        ("[measured]\nplace = { column = 'x' }\nforce = { column = 'F' }", 'no column "x"'),
        ("[measured]\nforce = { column = 'force_N' }", "one of place and time"),
        (
            "[measured]\nplace = { column = 'place_m' }\nhead_height = { column = 'h' }",
            "must name the column measured.force",
        ),
        (
            "[measured]\nplace = { column = 'place_m' }\n"
            "force = { column = 'force_N', unit = 'kg' }",
            "measured.force.unit",
        ),
        (
            "[measured]\nplace = { column = 'place_m' }\nforce = { column = 'force_N' }\n"
            "pantograph = 2",
            "m.csv has pantograph 2 by its description, and the run",
        ),
        (
            "[measured]\nplace = { column = 'place_m' }\nforce = { column = 'force_N' }\n"
            "filter_Hz = 200.0",
            "m.csv has 250 samples a second, too few for the filter",
        ),
        (
            "[measured]\nplace = { column = 'place_m' }\nforce = { column = 'force_N' }\n"
            "[[others]]\npantograf = 2",
            "did you mean others.0.pantograph?",
        ),
        (
            "[measured]\nplace = { column = 'place_m' }\nforce = { column = 'force_N' }\n"
            "from_m = 1000.0\nto_m = 2000.0",
            "outside of the compared stretch, 1000 to 2000 m",
        ),
    ],
)
def test_a_wrong_description_is_refused_in_a_sentence(
    description: str, told: str, run: Path, table: pd.DataFrame, tmp_path: Path
) -> None:
    file, toml = tmp_path / "m.csv", tmp_path / "m.toml"
    table.to_csv(file, index=False)
    toml.write_text(description, encoding="utf-8")
    done = invoke(str(run), str(file), "--description", str(toml))
    assert done.exit_code == 2, done.output
    assert told in " ".join(done.output.split()) and done.output.count("\n") == 1


def test_what_belongs_to_a_measurement_is_refused_of_runs(run: Path, tmp_path: Path) -> None:
    done = invoke(str(run), str(run), "-o", str(tmp_path / "out"))
    assert done.exit_code == 2 and "-o belongs to a measurement" in done.output
    (tmp_path / "m.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    done = invoke(str(run), str(tmp_path / "m.csv"))
    assert done.exit_code == 2 and "describe its columns with --description" in done.output
    table = str(tmp_path / "m.csv")
    # The last two were read as results, and called damaged.
    for words in ((str(run), table, str(run)), (table, str(run)), (str(run), str(run), table)):
        done = invoke(*words)
        assert done.exit_code == 2 and "name the run, then the CSV file" in done.output
