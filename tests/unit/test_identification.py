"""``catenary identify``: noise, posterior, residuals, and what is read and refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import verb_runner
from measuring import check
from scenes import load_scene
from scipy import stats
from scipy.optimize import least_squares
from twin_passages import filtered_noise, write_measurement

import catenary
from catenary import InputError
from catenary.cases.studies.measured import Measured, column_of, read_table
from catenary.cases.studies.parameters.identification import Identification, Unknown
from catenary.cases.studies.parameters.identified import draw_parameters, draw_passage, verdict
from catenary.cases.studies.parameters.measurement import (
    Measurement,
    Signal,
    Task,
    Whitening,
    correlation,
)
from catenary.cases.studies.parameters.posterior import (
    innovations_of,
    is_doubtful,
    judge,
    posterior_of,
)
from catenary.cases.studies.task_files import checked_table
from catenary.postproc.evaluate import filters

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
# Six spans with two elements a gap, run through in 1152 steps.
TINY = (
    "line.n_spans=6", "mesh.elements_per_gap=2", "train.start_m=65", "train.end_m=225",
    "train.raise_time_s=0.2", "numerics.dt_s=0.002", "evaluation.from_m=80",
    "evaluation.to_m=220",
)  # fmt: skip
FORCE = "pantographs.reference.static_force_N"
TASK = f"""
[measured]
place = {{ column = "x_m" }}
force = {{ column = "force_N", noise = 5.0 }}
head_height = {{ column = "height_mm", unit = "mm", noise = 5.0, bias = 20.0 }}

[[parameters]]
key = "{FORCE}"
deviation = 4.0
mean = 117.0
"""


# --- noise --------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [1e-3, 0.01])
def test_filtered_noise_has_the_correlation_of_the_filters_impulse(dt: float) -> None:
    """The impulse response of the filter itself: its correlation is a finite sum."""
    impulse = np.zeros(4001)
    impulse[2000] = 1.0
    response = filters.low_pass(impulse, dt)
    lags = np.arange(0, 60)
    sums = np.array([response[lag:] @ response[: len(response) - lag] for lag in lags])
    # Trapezoids over a smooth spectrum that ends at a gain of 6e-8: 1e-6 of the whole.
    check("variance", filters.kept_variance(20.0, dt), sums[0], within=1e-5 * sums[0])
    check("correlation", correlation(lags * dt, 20.0, dt), sums / sums[0], within=1e-5)


def test_dense_samples_have_the_correlation_of_no_samples() -> None:
    lags = np.linspace(0.0, 2.0, 81)
    # tan(x)/x differs from 1 by x^2/3, with x = pi 20 Hz 1e-4 s: 1e-5 of the frequencies.
    check("limit", correlation(lags, 20.0, 1e-4), correlation(lags, 20.0), within=1e-4)


def test_whitened_noise_is_white() -> None:
    """2000 records of 40 samples at 25 ms: covariances spread by 1/sqrt(2000), 5 deviations."""
    rng = np.random.default_rng(3)
    every, n = 25, 40
    record = filtered_noise(rng, 2000 * n * every, 5.0, 1e-3)
    records = record[::every].reshape(2000, n).T
    white = Whitening(0.025 * np.arange(n), 5.0, 20.0, None).of(records)
    check("covariance", white @ white.T / 2000.0, np.eye(n), within=5.0 * np.sqrt(2.0 / 2000.0))


# --- posterior and residuals --------------------------------------------------------------------


def test_the_posterior_is_the_inverse_of_the_information() -> None:
    rng = np.random.default_rng(5)
    jacobian = rng.normal(size=(30, 4)) * [3.0, 1.0, 0.3, 0.0]
    found = posterior_of(jacobian)
    expected = np.linalg.inv(np.eye(4) + jacobian.T @ jacobian)
    check("covariance", found.covariance, expected, within=1e-13)
    # The data do not depend on the last parameter: its prior remains, its direction is told.
    assert found.widths[-1] == pytest.approx(1.0) and found.condition > 1e10
    assert abs(found.directions[-1, -1]) == pytest.approx(1.0)
    assert found.information[-1] < 1e-20 < found.information[0]


def test_parameters_that_act_alike_are_known_as_a_sum_only() -> None:
    """Both columns are alike: the sum is measured, the difference keeps its prior."""
    column = np.full((50, 1), 2.0)
    found = posterior_of(np.hstack([column, column]))
    assert found.information == pytest.approx([400.0, 0.0], abs=1e-12)
    assert abs(found.directions[:, 1] @ [1.0, -1.0]) == pytest.approx(np.sqrt(2.0))
    assert found.n_known == 1 and found.n_found == pytest.approx(400.0 / 401.0)
    assert found.correlation[0, 1] < -0.99


def test_a_posterior_with_fewer_data_than_parameters() -> None:
    found = posterior_of(np.array([[3.0, 0.0, 4.0]]))
    assert found.information == pytest.approx([25.0, 0.0, 0.0])
    assert np.diag(found.covariance)[1] == pytest.approx(1.0)


def test_the_innovations_have_the_sum_of_squares_that_was_minimised() -> None:
    rng = np.random.default_rng(6)
    jacobian, before = rng.normal(size=(25, 3)), rng.normal(size=25)
    found = least_squares(
        lambda at: np.concatenate([before - jacobian @ at, at]), np.zeros(3), xtol=1e-15
    )
    innovations = innovations_of(before - jacobian @ found.x, jacobian, found.x)
    check("sum", float(innovations @ innovations), 2.0 * found.cost, within=1e-9)
    covariance = np.eye(25) + jacobian @ jacobian.T
    check("form", 2.0 * found.cost, float(before @ np.linalg.inv(covariance) @ before), within=1e-9)


def test_residuals_are_called_wrong_as_rarely_as_said() -> None:
    """400 right models: probabilities are uniform, by Kolmogorov and Smirnov at one in 10^4."""
    rng = np.random.default_rng(8)
    n = 120
    found = [judge(rng.normal(size=n), {"force": slice(0, n)}) for _ in range(400)]
    for name in ("probability", "whiteness_probability"):
        seen = [getattr(one["force"], name) for one in found]
        assert stats.kstest(seen, "uniform").pvalue > 1e-4, name
    assert not found[0]["all"].autocorrelation.size and not found[0]["all"].is_coloured


def test_a_right_model_is_doubted_once_in_ten_passages_at_most() -> None:
    """1000 models of two signals; 4 deviations of a share of one in ten. What is larger than noise
    by a tenth, 2.8 deviations of chi-square, mostly is doubted, long before it is called wrong."""
    rng, n, trials = np.random.default_rng(10), 200, 1000
    of = {"force": slice(0, n), "head height": slice(n, 2 * n)}
    right = [judge(rng.normal(size=2 * n), of) for _ in range(trials)]
    spread = np.sqrt(0.1 * 0.9 / trials)
    assert 0.05 < np.mean([is_doubtful(one) for one in right]) < 0.1 + 4.0 * spread
    large = [judge(1.1 * rng.normal(size=2 * n), of) for _ in range(100)]
    doubted = np.mean([is_doubtful(one) for one in large])
    assert doubted > 0.8 > np.mean([one["all"].is_too_large for one in large])


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        (0.5, "The model fits:"),
        (0.02, "The model fits, with a doubt:"),
        (1e-4, "The model does not"),
    ],
)
def test_a_verdict_names_a_doubt(probability: float, said: str) -> None:
    """White residuals whose chi-square has a chosen probability."""
    n = 200
    white = np.random.default_rng(11).normal(size=n)
    size = np.sqrt(stats.chi2.isf(probability, n) / (white @ white))
    found: Any = SimpleNamespace(judged=judge(size * white, {"force": slice(0, n)}))
    assert verdict(found).startswith(said)


def test_wrong_residuals_are_told_by_size_and_by_colour() -> None:
    rng = np.random.default_rng(9)
    white, n = rng.normal(size=201), 200
    of = {"force": slice(0, n)}
    assert judge(1.5 * white[:n], of)["force"].is_too_large
    assert judge(0.5 * white[:n], of)["force"].is_too_small
    coloured = judge((white[1:] + 0.8 * white[:-1]) / np.sqrt(1.64), of)["force"]
    assert coloured.is_coloured
    # The first autocorrelation of a moving average of 0.8 is 0.8/1.64; 4 deviations.
    assert coloured.autocorrelation[0] == pytest.approx(0.8 / 1.64, abs=4.0 / np.sqrt(n))


# --- measurements -------------------------------------------------------------------------------


def measurement(table: pd.DataFrame, **changes: Any) -> Measurement:
    keys = {
        "place": {"column": "x"},
        "force": {"column": "F", "noise": 5.0},
        "filter_Hz": 20.0,
        **changes,
    }
    task = Measured.model_validate({key: one for key, one in keys.items() if one is not None})
    return Measurement(table, "m.csv", task, 50.0, 100.0, (150.0, 250.0))


def samples(n: int = 1001) -> pd.DataFrame:
    x = np.linspace(100.0, 300.0, n)
    return pd.DataFrame({"x": x, "t": (x - 100.0) / 50.0, "F": 100.0 + np.sin(x)})


def test_samples_are_half_a_period_of_the_filter_apart() -> None:
    found = measurement(samples())
    # 0.2 m at 50 m/s are 4 ms: every sixth, 24 ms of 25.
    assert np.diff(found.place) == pytest.approx(1.2)
    assert found.place[0] == pytest.approx(150.0) and found.place[-1] <= 250.0
    (signal,) = found.signals
    assert signal.values == pytest.approx(100.0 + np.sin(found.place))
    by_time = measurement(samples(), place=None, time={"column": "t"})
    assert by_time.place == pytest.approx(found.place)


@pytest.mark.parametrize(("is_filtered", "filter_hz"), [(False, 62.5), (True, 124.0)])
def test_the_fewest_samples_of_a_filter_have_noise_of_full_rank(
    is_filtered: bool, filter_hz: float
) -> None:
    found = measurement(samples(), is_filtered=is_filtered, filter_Hz=filter_hz)
    (signal,) = found.signals
    assert np.isfinite(signal.whitening.of(signal.values)).all()


def test_units_of_columns_are_converted() -> None:
    table = samples()
    table["kN"], table["km"] = table.F / 1e3, table.x / 1e3
    found = measurement(
        table,
        place={"column": "km", "unit": "km"},
        force={"column": "kN", "unit": "kN", "noise": 0.005, "bias": 0.001},
    )
    (signal,) = found.signals
    assert signal.values == pytest.approx(100.0 + np.sin(found.place))
    assert (signal.deviation, signal.bias) == (pytest.approx(5.0), pytest.approx(1.0))


def test_raw_samples_that_are_stated_as_filtered_are_told() -> None:
    """A wave of 30 Hz in raw samples, of which the filter leaves 0.8 %, and noise of 5 N."""
    t = samples().t.to_numpy()
    wave = 8.0 * np.sin(4.0 * np.pi * t), 10.0 * np.sin(80.0 * np.pi * t)
    noise = 5.0 * np.random.default_rng(1).normal(size=t.size)
    raw = samples().assign(F=100.0 + wave[0] + wave[1] + noise)
    (told,) = measurement(raw).signals
    # All of the wave, and the part of white noise at 250 Hz that is above 30 Hz.
    expected = np.sqrt(50.0 + 25.0 * (1.0 - 30.0 / 125.0))
    said = re.fullmatch(
        r"The measured force varies by (\S+) N faster than 30 Hz, more than the filter of 20 Hz "
        "leaves: if the values are raw, measured.is_filtered is false.",
        told.hint,
    )
    # Of 800 samples the deviation is known to 2.5 %; a tenth is rounding and the filter's slope.
    assert said and float(said[1]) == pytest.approx(expected, rel=0.1)
    filtered = raw.assign(F=filters.low_pass(raw.F.to_numpy(), 0.004))
    for quiet in (measurement(filtered), measurement(raw, is_filtered=False)):
        assert [one.hint for one in quiet.signals] == [""]


def test_raw_samples_and_the_march_pass_the_same_filter() -> None:
    """A wave of 30 Hz and one of 2 Hz, 250 samples a second: both as the filter leaves them."""
    table = samples()
    t = table.t.to_numpy()
    table["F"] = 100.0 + 10.0 * np.sin(4.0 * np.pi * t) + 10.0 * np.sin(60.0 * np.pi * t)
    found = measurement(table, is_filtered=False)
    (signal,) = found.signals
    times = (found.place - 100.0) / 50.0
    gain = 1.0 / (1.0 + (np.tan(30.0 * np.pi * 0.004) / np.tan(20.0 * np.pi * 0.004)) ** 12)
    expected = 100.0 + 10.0 * np.sin(4.0 * np.pi * times)
    expected += gain * 10.0 * np.sin(60.0 * np.pi * times)
    # The record's ends have left 1e-4 of 20 N.
    check("filtered", signal.values, expected, within=5e-3)
    dense = np.arange(0.0, 4.0 + 1e-9, 1e-3)
    values = 100.0 + 10.0 * np.sin(4.0 * np.pi * dense) + 10.0 * np.sin(60.0 * np.pi * dense)
    # Cubic splines through 33 samples a wave of 10 N: (2 pi/33)^4/384, 3e-5 N, times some.
    modelled = found.of_march(100.0 + 50.0 * dense, values, 1e-3)
    check("as the march", modelled, signal.values, within=1e-3)
    place, filtered = found.curve_of_march(100.0 + 50.0 * dense, values, 1e-3)
    assert (place[0], place[-1]) == pytest.approx((found.place[0], found.place[-1]), abs=0.05)
    assert np.diff(place) == pytest.approx(0.05)
    # Of the wave of 30 Hz the filter leaves 0.075 N in steps of 1 ms, 0.055 N in those of 4 ms.
    at_samples = np.interp(found.place, place, filtered)
    assert np.abs(at_samples - signal.values).max() < 0.025
    # Of 5 N white noise at 250 Hz the filter leaves the root of 0.148.
    assert signal.deviation == pytest.approx(5.0 * np.sqrt(filters.kept_variance(20.0, 0.004)))


def test_innovations_of_hardly_any_noise_are_those_of_its_limit() -> None:
    """Of noise that goes to zero two samples fix two parameters, and the third tells what is left:
    1, 2 and 3.5 lie 0.5 off a straight line, whose prediction has a deviation of root 6."""
    jacobian = 1e12 * np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    values = 1e12 * np.array([1.0, 2.0, 3.5])
    found = innovations_of(values, jacobian, np.zeros(2))
    # Parameters are of order one in deviations of their priors, off by round-off times 1e12.
    check("first", found[0], 1.0, within=1e-12)
    check("last", found[2], 0.5e12 / np.sqrt(6.0), within=1e-3 * 0.5e12)


def test_tables_with_semicolons_and_decimal_commas_are_read(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    file.write_text("# a passage\nx;F\n0,5;100,25\n1,0;99,75\n", encoding="utf-8")
    table = read_table(file)
    assert table.x.tolist() == [0.5, 1.0] and table.F.tolist() == [100.25, 99.75]
    file.write_text("# a, passage\nx\tF\n0,5\t100,25\n1,0\t99,75\n", encoding="utf-8")
    assert read_table(file).equals(table)


def test_a_file_that_is_no_table_is_told_in_one_sentence(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    file.write_text("x,F\n1,2\n1,2,3\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_table(file)
    assert str(raised.value) == f"{file} is no table of CSV: Expected 2 fields in line 3, saw 3"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is no table of CSV: it is empty"),
        ("# nothing\n", "is no table of CSV: it is empty"),
        ("x,F\n0,5,100,25\n1,0,99,75\n", "more values in a row than the names of columns, x, F: "),
        ("x,F,F\n0,5,7\n", 'has several columns "F"'),
    ],
)
def test_columns_that_are_not_clear_are_told(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "m.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        column_of(read_table(file), str(file), "F")
    assert str(raised.value).startswith(str(file)) and told in str(raised.value)


def test_separators_at_the_end_of_lines_make_no_column(tmp_path: Path) -> None:
    file = tmp_path / "m.csv"
    for text in ("x,F\n0.5,100.25,\n1.0,99.75,\n,,\n", "x;F;\n0,5;100,25;\n1,0;99,75; # last\n"):
        file.write_text(text, encoding="utf-8")
        table = read_table(file)
        assert table.x.tolist() == [0.5, 1.0] and table.F.tolist() == [100.25, 99.75]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"force": {"column": "Q", "noise": 1.0}}, 'm.csv has no column "Q": it has x, t, F'),
        ({"from_m": 290.0, "to_m": 300.0}, "reaches from 100.0 to 300.0 m .* takes 20 to 8000"),
        ({"is_filtered": False, "filter_Hz": 200.0}, "has 250 samples .* takes at least 800 of v"),
        ({"is_filtered": False, "filter_Hz": 63.0}, "takes at least 252 of values that are not fi"),
        ({"is_filtered": True, "filter_Hz": 200.0}, "has 250 samples .* takes more than 400"),
    ],
)
def test_a_measurement_that_does_not_do_is_told(change: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        measurement(samples(), **change)


def test_gaps_and_holes_are_told() -> None:
    with pytest.raises(InputError, match="row 500 to row 501 .* by 0.6 m, between others by 0.2 m"):
        measurement(samples().drop(index=[500, 501]))
    with pytest.raises(InputError, match=r"places that fall along the line, from 300.0 to 100.0 m"):
        measurement(samples()[::-1])
    still = samples()
    still.loc[500, "x"] = still.x[499]
    with pytest.raises(InputError, match="from row 500 to row 501 .* goes on by 0 m"):
        measurement(still)
    # Each step is within 1.6 % of the usual one, and samples are up to 0.5 m from even steps.
    varying = samples()
    varying["x"] += 0.5 * np.sin(2.0 * np.pi * np.arange(len(varying)) / len(varying))
    with pytest.raises(InputError, match="even steps from the first row to the last lead to"):
        measurement(varying)
    # Whole centimetres are even steps: of 0.2003 m some are 0.20 m and some 0.21 m.
    rounded = samples()
    rounded["x"] = 100.0 + 1.0015 * (rounded.x - 100.0)
    exact = measurement(rounded, to_m=250.0).place
    cut = measurement(rounded.round({"x": 2}), to_m=250.0).place
    np.testing.assert_allclose(cut, exact, atol=0.01)
    holed = samples().astype({"F": object})
    for cell, said in ((np.nan, "no number"), ("n/a", '"n/a"')):
        holed.loc[7, "F"] = cell
        with pytest.raises(InputError, match=f'has {said} in column "F", row 8 below its names'):
            measurement(holed)
    found = measurement(samples())
    with pytest.raises(InputError, match=r"compared from 150.0 to 249.6 m, and the pantograph"):
        found.of_march(np.linspace(160.0, 260.0, 2001), np.zeros(2001), 1e-3)


# --- the task -----------------------------------------------------------------------------------

MEASURED = {"place": {"column": "x_m"}, "force": {"column": "force_N", "noise": 5.0}}
SOUGHT = [{"key": FORCE, "deviation": 4.0}]


@pytest.mark.parametrize(
    ("task", "told"),
    [
        ({"measured": MEASURED}, "parameters"),
        ({"parameters": SOUGHT}, "measured"),
        ({"measured": {**MEASURED, "time": {"column": "t"}}, "parameters": SOUGHT},
         "must name the column of one of place and time"),
        ({"measured": {"place": {"column": "x"}}, "parameters": SOUGHT},
         "must name the column of force, of head_height, or of both"),
        ({"measured": {**MEASURED, "filter_hz": 20.0}, "parameters": SOUGHT},
         "measured.filter_hz in t.toml is unknown; did you mean measured.filter_Hz?"),
        ({"measured": MEASURED, "parameters": [{"key": FORCE, "sigma": 4.0}]},
         "parameters.0.sigma in t.toml is unknown"),
        ({"measured": MEASURED, "parameters": [{"key": FORCE, "deviation": 0.0}]},
         "parameters.0.deviation is 0.0 in t.toml; it must be greater than 0"),
        ({"measured": MEASURED, "droppers": {"spans": [], "deviation_mm": 2.0}}, "droppers.spans"),
        ({"measured": MEASURED, "droppers": {"spans": [5, 5], "deviation_mm": 2.0}},
         "must name each span once"),
        ({"measured": {**MEASURED, "filter_Hz": 1e-308}, "parameters": SOUGHT},
         "measured.filter_Hz is 1e-308 in t.toml; it must be at least 0.001"),
        ({"measured": {**MEASURED, "from_m": 300.0, "to_m": 200.0}, "parameters": SOUGHT},
         "must have to_m greater than from_m, but they are 200 and 300"),
        ({"measured": {**MEASURED, "force": {"column": "F", "noise": 1.0, "unit": "kg"}},
          "parameters": SOUGHT}, "measured.force.unit"),
    ],
)  # fmt: skip
def test_a_wrong_task_is_told_in_one_sentence(task: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as raised:
        checked_table(task, Task, "t.toml")
    assert told in str(raised.value) and "\n" not in str(raised.value)
    assert "t.toml" in str(raised.value)


# --- the verb -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a task and the passage of the tiny scene itself, with noise."""
    folder = tmp_path_factory.mktemp("identification")
    (folder / "task.toml").write_text(TASK, encoding="utf-8")
    rng = np.random.default_rng(11)
    write_measurement(folder / "measured.csv", load_scene(CASE, TINY), rng, 5.0, 5e-3)
    return folder


def invoke(files: Path, *words: str) -> Any:
    given = [CASE, str(files / "measured.csv"), str(files / "task.toml")]
    return verb_runner.invoke("identify", *given, *words, "--set", *TINY)


def test_the_verb_finds_a_force_and_writes_its_tables_once(files: Path) -> None:
    out = files / "out"
    result = invoke(files, "-o", str(out))
    assert result.exit_code == 0, result.output
    assert "The model fits" in result.output and "One search was made, to" in result.output
    words = result.output.splitlines()
    assert (
        words[0].startswith("march 1: sum of squares ") and words[1] == "derivatives by 1 parameter"
    )
    table = pd.read_csv(out / "parameters.csv").set_index("parameter")
    assert table.index.tolist() == [FORCE, "bias of head height"]
    row = table.loc[FORCE]
    assert (row.prior, row.prior_deviation, row.unit) == (117.0, 4.0, "N")
    # The scene has 120 N; four posterior deviations, and these are far below the prior's.
    assert abs(row.found - 120.0) < 4.0 * row.deviation < 4.0
    bias = table.loc["bias of head height"]
    # In the file's unit, in which the task gives 20 mm; the file has none of its own.
    assert (bias.unit, bias.prior_deviation) == ("mm", 20.0) and abs(bias.found) < 4.0 * 2.0
    names = {path.name for path in out.iterdir()}
    assert names == {"parameters.csv", "correlation.csv", "directions.csv", "residuals.csv",
                     "identification.json", "passage.png", "parameters.png"}  # fmt: skip
    summary = json.loads((out / "identification.json").read_text())
    assert summary["converged"] and set(summary["residuals"]) == {"force", "head height", "all"}
    residuals = pd.read_csv(out / "residuals.csv")
    left = residuals.measured_force_N - residuals.modelled_force_N
    # Two hundred samples, of which noise is 5 N.
    assert left.std() == pytest.approx(5.0, rel=0.3)
    again = invoke(files, "-o", str(out))
    assert again.exit_code == 2 and "is there already" in again.output


def test_pictures_show_signals_residuals_and_distances_from_priors() -> None:
    place, steps = np.linspace(100.0, 120.0, 5), np.linspace(100.0, 120.0, 21)
    force, height = (
        Signal("force", place, None, 2.0, 0.0, "N", 1.0),
        Signal("head height", 5.0 + 0.0 * place, None, 0.003, 0.01, "mm", 1e-3),
    )  # type: ignore[arg-type]
    found = Identification(
        [Unknown("tension", "N", 20e3, 1e3), Unknown("bias of head height", "mm", 0.0, 10.0)],
        np.array([21.5e3, 2.0]),
        posterior_of(np.array([[3.0, 0.0], [0.0, 0.0]])),
        place,
        [force, height],
        [place - 1.0, 4.99 + 0.0 * place],
        [np.stack([steps, steps - 3.0]), np.stack([steps, 4.9 + 0.0 * steps])],
        [np.stack([steps, steps - 1.0]), np.stack([steps, 4.99 + 0.0 * steps])],
        {},
        1,
        1,
        [1.0],
        True,
    )
    panels = draw_passage(found).axes
    measured, by_priors, marched = panels[0].lines
    assert [line.get_label() for line in panels[0].lines] == ["measured", "priors' means", "found"]
    # Dots of samples, and lines in steps of the marches.
    assert measured.get_linestyle() == panels[1].lines[0].get_linestyle() == "None"
    assert np.allclose(measured.get_xydata(), np.stack([place, place], axis=1))
    assert np.allclose(by_priors.get_xydata(), np.stack([steps, steps - 3.0], axis=1))
    assert np.allclose(marched.get_xydata(), np.stack([steps, steps - 1.0], axis=1))
    # The bias of 2 mm belongs to what was found.
    assert np.allclose(panels[2].lines[2].get_ydata(), 4.992)
    # Residuals: of force 1 N, of heights 5 - (4.99 + 0.002) m in millimetres.
    assert np.allclose(panels[1].lines[0].get_ydata(), 1.0)
    assert np.allclose(panels[3].lines[0].get_ydata(), 8.0)
    shaded = [
        panel.patches[0].get_extents().transformed(panel.transData.inverted())
        for panel in panels[1::2]
    ]
    assert [one.ymax for one in shaded] == pytest.approx([2.0, 3.0])
    (axes,) = draw_parameters(found).axes
    assert axes.lines[0].get_xdata() == pytest.approx([1.5, 0.2])
    assert [text.get_text() for text in axes.get_yticklabels()] == [
        "tension",
        "bias of head height",
    ]
    # Three times as much information as the prior's leaves 1 / sqrt(1 + 9) of its deviation.
    (bars,) = axes.collections
    ends = bars.get_segments()[0][:, 0]
    assert ends == pytest.approx([1.5 - 0.1**0.5, 1.5 + 0.1**0.5])


def test_python_gives_the_same(files: Path) -> None:
    scene = catenary.load(CASE).replace(
        dict(
            pair for word in TINY for pair in [(word.split("=")[0], json.loads(word.split("=")[1]))]
        )
    )
    found = catenary.identify(scene, files / "measured.csv", files / "task.toml")
    assert found.summary["verdict"].startswith("The model fits")
    assert found.parameters.loc[FORCE, "deviation"] < 1.0
    assert found.correlation.loc[FORCE, FORCE] == pytest.approx(1.0)
    assert len(found.directions) == 2 and "chi-square" in str(found)


@pytest.mark.parametrize(
    ("task", "told"),
    [
        (
            TASK.replace("static_force_N", "statik_force_N"),
            "in parameters.0.key of the task is unknown; did you mean",
        ),
        (TASK.replace(FORCE, "line.n_spans").replace("117.0", "6.0"), "is a whole number"),
        (TASK.replace(FORCE, "train.speed_km_h").replace("117.0", "250.0"), "moves the pantograph"),
        (TASK.replace("[measured]", "[measured]\npantograph = 2"), "it must be from 1 to 1"),
        (TASK + f'\n[[parameters]]\nkey = "{FORCE}"\ndeviation = 1.0', "twice; name it once"),
        (TASK + "\n[droppers]\nspans = [9]\ndeviation_mm = 2.0", "names span 9: the line has 6"),
        (TASK.replace("117.0", "-1e7"), "comes to a value that the scene refuses"),
        (
            TASK.replace('"force_N", noise', '"force_N", unit = "kN", noise'),
            "check column, unit and zero of measured.force",
        ),
        (
            TASK.replace('unit = "mm", noise', 'unit = "cm", noise'),
            "check column, unit and zero of measured.head_height",
        ),
        (
            TASK.replace(FORCE, "pantographs.reference.masses_kg"),
            "parameters.0.mean must be left out",
        ),
    ],
)
def test_a_task_that_does_not_fit_is_told(
    files: Path, tmp_path: Path, task: str, told: str
) -> None:
    wrong = tmp_path / "task.toml"
    wrong.write_text(task, encoding="utf-8")
    given = [CASE, str(files / "measured.csv"), str(wrong), "-o", str(tmp_path / "out")]
    result = verb_runner.invoke("identify", *given, "--set", *TINY)
    assert result.exit_code == 2, result.output
    *progress, sentence = result.output.splitlines()
    assert told in sentence and sentence.startswith("catenary: ")
    assert all(line.startswith(("march ", "derivatives by ")) for line in progress)
    assert not (tmp_path / "out").exists()
