"""Tables of runs: read from files, what counts as an input and as judged, pictures, merging."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catenary import InputError
from catenary.cases.studies import sweeps
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.output import files_of, table_of
from catenary.cases.studies.sweep.variants import Variant
from catenary.cases.studies.uncertainty import output
from catenary.cases.studies.uncertainty.evaluation import evaluate, failing, indices
from catenary.cases.studies.uncertainty.run_table import (
    SAMPLING,
    read_run_table,
    run_table,
)
from catenary.cases.studies.uncertainty.sampling import sampling_of
from catenary.postproc.report.study_table import write_files

pytestmark = pytest.mark.usefixtures("quick_reports")

SPEED = "train.speed_km_h"
SAMPLE = {"n": 30, "keys": {SPEED: {"type": "normal", "standard_deviation": 5.0}}}
CRITERIA = ("maximum contact force", "arcing NQ")


def ended(number: int, speed: float = 250.0, failed: tuple[str, ...] = ()) -> Ended:
    """A run of two pantographs as a sweep keeps it."""
    name = f"sample_{number:06d}"
    summary = {
        "pantographs": [
            {"name": who, "mean_N": 120.0 + number / 3, "std_N": 0.1 * speed + shift}
            for who, shift in (("first", 0.0), ("second", 5.0))
        ],
        "supports": {"max_uplift_mm": 50.0 + number / 7},
        "droppers": {"n_slackened": number},
        "acceptance": [
            *({"criterion": one, "passed": one not in failed} for one in CRITERIA),
            {"criterion": "uplift", "passed": None},
        ],
        "passed": not failed,
        "remarks": ["a remark"] if number % 2 else [],
    }
    assignments = (f"{SPEED}={speed!r}",)
    return Ended(Variant(name, assignments, {SPEED: repr(speed)}), "done", summary, wall=1.5)


def some(numbers: range) -> list[Ended]:
    rng = np.random.default_rng(1)
    speeds = rng.normal(250.0, 5.0, 100)
    return [ended(i, float(speeds[i]), ("arcing NQ",) if i % 10 == 0 else ()) for i in numbers]


def folder(path: Path, runs: list[Ended], sample: dict[str, Any] | None = None) -> Path:
    write_files(path, files_of("a_case", runs, None))
    if sample is not None:
        (path / SAMPLING).write_text(
            json.dumps(sampling_of(sample, "s.toml").model_dump(exclude_none=True))
        )
    return path


def test_what_has_no_estimates_says_so() -> None:
    """A run alone, runs that broke, and an input with the same value in all runs."""
    rows = [
        {"variant": i, "a": [1.0, 2.0], "b": i, "outcome": "done", "std_N": 2.0 + i} for i in (1, 2)
    ]
    none = "there are no estimates, which take figures of at least two runs"
    assert none in evaluate(run_table(rows[:1])).notes
    broken = evaluate(run_table([row | {"outcome": "broke", "std_N": None} for row in rows]))
    assert broken.notes[:2] == [none, "2 runs of 2 did not end"]
    notes = evaluate(run_table(rows)).notes
    assert notes[0] == "a without an index: no two runs differ in it" and none not in notes


def test_chosen_values_have_shares_and_no_probabilities() -> None:
    runs = table_of(some(range(1, 31))).records()
    sampled = output.as_text(evaluate(run_table(runs, sampling_of(SAMPLE, "s.toml"))))
    chosen = output.as_text(evaluate(run_table(runs)))
    assert "Probability that a criterion fails, with" in sampled and "no sampling" not in sampled
    assert "Share of the runs in which a criterion fails, with" in chosen
    assert "robability" not in chosen and "NOTE        no sampling is known: means, " in chosen


def test_a_run_that_broke_is_told_to_be_left_out_of_probabilities() -> None:
    rows = table_of(some(range(1, 31))).records()
    for row in rows[:2]:  # both pantographs of the first run
        row |= {"outcome": "the line fell", "std_N": None}
    found = evaluate(run_table(rows, sampling_of(SAMPLE, "s.toml")))
    assert {row["n"] for row in found.probabilities} == {29}
    assert found.notes[0] == (
        "1 run of 30 did not end; estimates are of the others, and no probability counts a run "
        "that broke as failed"
    )


def test_what_any_pantograph_fails_is_failed() -> None:
    """Tables from elsewhere may give each pantograph its own criteria: of four runs the leading one
    fails in one, the trailing one in three, of which one is the same."""
    failed = {"leading": (1,), "trailing": (1, 2, 3)}
    rows = [
        {"variant": i, "pantograph": one, "std_N": 20.0 + i, "judged": "least force",
         "failed": "least force" if i in own else ""}
        for i in range(1, 5) for one, own in failed.items()
    ]  # fmt: skip
    for columns in (("failed", "judged"), ("failed",)):
        left = {"failed", "judged"} - {*columns}
        table = run_table([{k: v for k, v in row.items() if k not in left} for row in rows])
        of_one, of_any = evaluate(table).probabilities
        assert (of_one["failed"], of_one["n"]) == (of_any["failed"], of_any["n"]) == (3, 4)


def test_files_of_all_kinds_give_the_same_table(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    runs = some(range(1, 31))
    out = folder(tmp_path / "out", runs, SAMPLE)
    rows = run_table(table_of(runs).records(), sampling_of(SAMPLE, "s.toml"))
    first = evaluate(rows)
    for path in (out, out / "sweep.csv", out / "sweep.parquet"):
        found = read_run_table(path)
        assert found.sampling == rows.sampling
        assert found.inputs == (SPEED,)
        # Not within a tolerance: all digits are kept.
        assert evaluate(found) == first
    parquet = pd.read_parquet(out / "sweep.parquet")
    assert parquet["std_N"].tolist() == [row["std_N"] for row in table_of(runs).rows]
    assert parquet["judged"].map(list).tolist() == [list(CRITERIA)] * 60


def test_statistics_are_of_a_pantograph_or_of_the_line() -> None:
    found = evaluate(run_table(table_of(some(range(1, 31))).records()))
    n = {(row["statistic"], row["pantograph"]): row["n"] for row in found.statistics}
    assert n[("std_N", "first")] == n[("std_N", "second")] == n[("max_uplift_mm", "")] == 30
    mean = {(row["statistic"], row["pantograph"]): row["mean"] for row in found.statistics}
    assert mean[("std_N", "second")] - mean[("std_N", "first")] == pytest.approx(5.0)
    assert found.remarks == [{"remark": "a remark", "n": 15}]


def test_probabilities_count_runs_that_were_judged() -> None:
    rows = failing(run_table(table_of(some(range(1, 31))).records()))
    found = {row["criterion"]: (row["failed"], row["n"]) for row in rows}
    # Every tenth run failed; the uplift was judged in none.
    assert found == {"maximum contact force": (0, 30), "arcing NQ": (3, 30), "any of them": (3, 30)}


def test_a_table_without_judged_criteria_takes_them_from_its_verdicts() -> None:
    table = pd.DataFrame(
        {
            "variant": ["a", "b", "c", "d"],
            "outcome": ["done", "done", "done", "broke"],
            "passed": [True, False, None, None],
            "failed": ["", "x; y", "", ""],
        }
    )
    found = {row["criterion"]: (row["failed"], row["n"]) for row in failing(run_table(table))}
    assert found == {"x": (1, 2), "y": (1, 2), "any of them": (1, 2)}


def test_a_table_without_any_run_that_ended_is_evaluated_too() -> None:
    found = evaluate(run_table([{"variant": "a", SPEED: 1.0, "outcome": "broke", "std_N": None}]))
    assert (found.n_runs, found.n_done) == (1, 0)
    assert not found.statistics and not found.probabilities and not found.sensitivity
    assert "1 run of 1 did not end" in output.as_text(found)


@pytest.mark.parametrize("sample", [None, SAMPLE])
def test_pictures_show_their_runs(sample: dict[str, Any] | None) -> None:
    sampling = None if sample is None else sampling_of(sample, "s.toml")
    table = run_table(table_of(some(range(1, 31))).records(), sampling)
    scatter = output.scatter(table)
    assert scatter is not None
    std = next(axes for axes in scatter.axes if "standard" in axes.get_ylabel())
    assert [len(line.get_xdata()) for line in std.lines] == [30, 30]
    assert [line.get_marker() for line in std.lines] == ["o", "s"]
    assert std.lines[0].get_xdata() == pytest.approx(table.of("std_N")["first"][SPEED])
    parallel = output.parallel_coordinates(table, ["std_N"])
    assert parallel is not None
    (lines,) = parallel.axes[0].collections
    assert len(lines.get_segments()) == 30
    convergence = output.convergence(table, ["std_N"])
    assert convergence is not None
    mean, _, _, quantile, *_ = convergence.axes[0].lines
    assert mean.get_marker() != quantile.get_marker()
    worst = table.of("std_N")["second"]["std_N"]  # by 5 N
    assert mean.get_ydata()[-1] == pytest.approx(worst.mean())
    assert convergence.axes[0].get_title(loc="left") == "second, the worst one"
    histogram = output.histograms(table, ["std_N"])
    assert histogram is not None
    assert sum(bar.get_height() for bar in histogram.axes[0].patches) == 60


def test_the_quantile_of_a_minimum_is_the_low_one() -> None:
    """Of least forces 1 to 40 N one in twenty is below 2.95 N, of deviations one above 38.05 N."""
    rows = [
        {"variant": f"v{i}", SPEED: float(i), "outcome": "done", "pantograph": name,
         "std_N": float(i), "min_N": float(i) + shift}
        for i in range(1, 41)
        for name, shift in (("first", 5.0), ("second", 0.0))
    ]  # fmt: skip
    table = run_table(rows)
    for statistic, expected in (("min_N", 2.95), ("std_N", 38.05)):
        drawn = output.convergence(table, [statistic])
        assert drawn is not None
        ends = [line.get_ydata()[-1] for line in drawn.axes[0].lines]
        assert ends[3] == pytest.approx(expected)  # after the mean and its bounds
    histogram = output.histograms(table, ["min_N"])
    assert histogram is not None
    uprights = [line.get_xdata()[0] for line in histogram.axes[0].lines]
    assert uprights == pytest.approx([25.5, 7.95, 20.5, 2.95])


def test_rows_that_are_drawn_of_many_lie_in_all_of_the_space() -> None:
    """Every fourth point of a Sobol sequence lies in one half of an interval."""
    from scipy.stats import qmc

    speeds = qmc.Sobol(1, seed=1).random_base2(12)[:4000, 0]
    assert np.ptp(speeds[::4]) < 0.51
    rows = [
        {"variant": f"v{i}", SPEED: own, "outcome": "done", "std_N": own}
        for i, own in enumerate(speeds.tolist())
    ]
    drawn = output.parallel_coordinates(run_table(rows))
    assert drawn is not None
    (lines,) = drawn.axes[0].collections
    starts = np.array([own[0, 1] for own in lines.get_segments()])
    assert starts.size == 1000
    # Binomial of 1000: 4 deviations are 63.
    assert (starts < 0.5).sum() == pytest.approx(500, abs=63)


def test_few_samples_of_two_pantographs_have_no_curve_of_convergence() -> None:
    few, enough = (run_table(table_of(some(range(1, n + 1))).records()) for n in (9, 10))
    assert len(few.done) == 18 and output.convergence(few, ["std_N"]) is None
    assert output.convergence(enough, ["std_N"]) is not None


def test_what_is_no_table_of_runs_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "other.csv").write_text("x,y\n1,2\n")
    (tmp_path / "semicolons.csv").write_text("variant;std_N\na;2\n")
    (tmp_path / "wrong.parquet").write_text("x,y\n1,2\n")
    (tmp_path / "notes.txt").write_text("x")
    for name, sentence in (
        ("empty.csv", "cannot be read as a table of runs"),
        ("other.csv", "is no table of runs: it needs a column variant"),
        ("semicolons.csv", "it needs a column variant, and rows; its first line has variant;std_N"),
        ("wrong.parquet", "cannot be read as a table of runs|needs the package pyarrow"),
        ("notes.txt", "must end in .csv or .parquet"),
        ("nowhere", "is neither a folder of a sweep nor a table"),
        (".", "holds no table of a sweep"),
    ):
        with pytest.raises(InputError, match=sentence) as error:
            read_run_table(tmp_path / name)
        assert "\n" not in str(error.value)
    rows = read_run_table(folder(tmp_path / "c", some(range(1, 4)))).frame
    with pytest.raises(InputError, match="has sample_000002 twice of second: a run may count once"):
        run_table(pd.concat([rows, rows.iloc[[3]]]))
    rows = rows.astype({SPEED: object})
    rows.loc[2, SPEED] = "fast"
    with pytest.raises(InputError, match=f'has "fast" in column {SPEED} of sample_000002; each'):
        run_table(rows, sampling_of(SAMPLE, "s"))
    # A run that did not end needs none.
    rows.loc[rows.variant == "sample_000002", "outcome"] = "broke"
    run_table(rows, sampling_of(SAMPLE, "s"))
    out = folder(tmp_path / "out", some(range(1, 4)))
    (out / SAMPLING).write_text("{")
    with pytest.raises(InputError, match="is damaged"):
        read_run_table(out)
    with pytest.raises(InputError, match="has no column x, which its sampling varies"):
        keys = {"x": {"type": "seed"}}
        table = sampling_of({"n": 2, "keys": {SPEED: {"type": "seed"}}}, "s")
        run_table(read_run_table(folder(tmp_path / "b", some(range(1, 4)))).frame,
                  table.model_copy(update={"keys": keys}))  # fmt: skip


def merged(*folders: Path) -> dict[str, Any]:
    record = sweeps.merge(folders).record
    return record


def test_disjoint_and_common_samples_merge_into_the_table_of_all(tmp_path: Path) -> None:
    runs = some(range(1, 31))
    whole = folder(tmp_path / "whole", runs, SAMPLE)
    odd = folder(tmp_path / "odd", runs[::2], SAMPLE)
    rest = folder(tmp_path / "rest", [runs[0], *runs[1::2]], SAMPLE)
    record = merged(rest, odd)
    assert record["rows"] == json.loads((whole / "sweep.json").read_text())["rows"]
    assert len(record["variants"]) == 30
    files, found, _ = sweeps.write_merged(tmp_path / "all", sweeps.merge([odd, rest]))
    assert found == evaluate(read_run_table(whole))
    assert (tmp_path / "all" / "sweep.csv").read_text() == (whole / "sweep.csv").read_text()
    assert {path.name for path in files} >= {"sweep.csv", "sweep.json", "uncertainty.json"}
    # In place of parts their folder can be named.
    folder(tmp_path / "parts" / "part_1_of_2", runs[::2], SAMPLE)
    folder(tmp_path / "parts" / "part_2_of_2", runs[1::2], SAMPLE)
    assert merged(tmp_path / "parts")["rows"] == record["rows"]
    # The merged folder is a sweep's folder again.
    assert merged(tmp_path / "all", odd)["rows"] == record["rows"]


def test_a_run_that_ended_elsewhere_stands_for_one_that_broke(tmp_path: Path) -> None:
    broke = Ended(ended(1).variant, "no room on the disk")
    for order in ((broke, ended(1)), (ended(1), broke)):
        names = [tmp_path / f"{order[0].done}_{i}" for i in (0, 1)]
        for name, one in zip(names, order, strict=True):
            folder(name, [one, ended(2)])
        assert [row["outcome"] for row in merged(*names)["rows"]] == ["done"] * 4


def test_sweeps_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    runs = some(range(1, 5))
    first = folder(tmp_path / "first", runs, SAMPLE)
    summary = dict(ended(1).summary, droppers={"n_slackened": 99})
    other_figures = Ended(runs[0].variant, "done", summary)
    other_values = Ended(Variant(runs[0].variant.name, (f"{SPEED}=1.0",), {SPEED: "1.0"}), "done",
                         runs[0].summary)  # fmt: skip
    other_key = Ended(Variant("sample_000009", ("x.y=1.0",), {"x.y": "1.0"}), "done")
    longer = {**SAMPLE, "n": 40}
    for name, one, sample, sentence in (
        ("a", other_figures, SAMPLE, "variant sample_000001 has other figures"),
        ("b", other_values, SAMPLE, "variant sample_000001 has other assignments"),
        ("c", other_key, SAMPLE, "they differ in the varied keys"),
        ("d", runs[1], {**SAMPLE, "seed": 5}, "they differ in the sampling"),
        ("e", runs[1], None, "they differ in the sampling"),
        ("f", runs[1], {**longer, "method": "latin_hypercube"}, "they differ in the sampling"),
    ):
        with pytest.raises(InputError, match=sentence) as error:
            merged(first, folder(tmp_path / name, [one], sample))
        assert "\n" not in str(error.value)
    tables: dict[str, Any] = {
        "mesh": {"file": "/a/m.msh"},
        "case": {"title": "A"},
        "train": {"speed_km_h": 250.0, "start_m": 1},
    }
    write_files(tmp_path / "base", files_of("", runs[:2], None, scene=tables))
    # A varied key, a title and the folder of a file may differ, where the train starts may not.
    for number, (start, speed) in enumerate(((1, 250.0), (1, 300.0), (2, 250.0))):
        other = {
            "mesh": {"file": "/b/m.msh"},
            "case": {"title": "B"},
            "train": {"speed_km_h": speed, "start_m": start},
        }
        write_files(tmp_path / f"other{number}", files_of("", runs[2:], None, scene=other))
        if start == 1:
            assert len(merged(tmp_path / "base", tmp_path / f"other{number}")["variants"]) == 4
            continue
        with pytest.raises(
            InputError, match=r"other2 cannot join .*: train.start_m is 2 there, and 1"
        ):
            merged(tmp_path / "base", tmp_path / f"other{number}")
        assert "\n" not in str(error.value)
    # More samples of the same sequence are no contradiction.
    assert len(merged(first, folder(tmp_path / "g", [ended(9)], longer))["variants"]) == 5
    write_files(tmp_path / "h", files_of("another_case", runs, None))
    with pytest.raises(InputError, match="they differ in the case"):
        merged(first, tmp_path / "h")
    with pytest.raises(InputError, match="holds no sweep"):
        merged(first, tmp_path)
    (tmp_path / "h" / "sweep.json").write_text('{"case": 1}')
    with pytest.raises(InputError, match="is damaged"):
        merged(first, tmp_path / "h")


def test_a_statistic_that_is_zero_in_most_runs_is_evaluated_without_warnings() -> None:
    """Half of the runs, of which bounds are made, may then be alike."""
    rng = np.random.default_rng(1)
    rows = [
        {"variant": f"v{i}", "key": x, "outcome": "done", "loss_percent": float(i == 7)}
        for i, x in enumerate(rng.random(120))
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, found, _ = indices(run_table(rows))
    assert [row["key"] for row in found] == ["key"]
