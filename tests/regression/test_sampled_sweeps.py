"""A sweep of samples end to end: command line and Python, parts merged, bad input."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import pytest
import verb_runner
from scenes import TINY, TINY_WORDS

import catenary

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
SAMPLE = """
n = 6
seed = 3
[keys.train.speed_km_h]
type = "normal"
standard_deviation = 5.0
[keys.pantographs.reference.masses_kg.0]
type = "uniform"
least = 6.0
most = 8.0
[[correlations]]
keys = ["train.speed_km_h", "pantographs.reference.masses_kg.0"]
rank = 0.4
[fields.irregularities.dropper_lengths.by_dropper]
type = "normal"
standard_deviation = 5.0
correlation_length_m = 20.0
"""


def invoke(*words: object) -> Any:
    return verb_runner.invoke(*(str(word) for word in words))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sampling") / "tolerances.toml"
    path.write_text(SAMPLE)
    return path


@pytest.fixture(scope="module")
def swept(file: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a sweep of six samples and what the command line said."""
    out = tmp_path_factory.mktemp("swept") / "out"
    hook = sys.excepthook
    done = invoke("sweep", CASE, "-o", out, "--sample", file, "--set", *TINY_WORDS)
    sys.excepthook = hook
    assert done.exit_code == 0, done.output
    return out, done.stdout


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "sweep.csv").open() as table:
        return list(csv.DictReader(table))


def test_samples_have_a_table_and_its_evaluation(swept: tuple[Path, str]) -> None:
    out, said = swept
    names = [f"sample_{i:06d}" for i in range(1, 7)]
    assert [row["variant"] for row in rows_of(out)] == names
    files = {path.name for path in out.iterdir()} - {*names, "sweep.parquet"}
    assert files == {
        "sweep.csv", "sweep.json", "sampling.json", "uncertainty.json", "uncertainty_scatter.png",
        "uncertainty_parallel.png", "uncertainty_histogram.png",
    }  # fmt: skip
    found = json.loads((out / "uncertainty.json").read_text())
    std = [float(row["std_N"]) for row in rows_of(out)]
    (row,) = (one for one in found["statistics"] if one["statistic"] == "std_N")
    assert row["mean"] == pytest.approx(sum(std) / 6) and row["n"] == 6
    assert row["minimum"] == min(std) < max(std) == row["maximum"]
    assert found["probabilities"][-1]["criterion"] == "any of them"
    assert "Probability that a criterion fails" in said
    assert "first-order indices need at least 100 runs" in said


def test_a_sample_runs_alone_by_its_own_assignments(
    swept: tuple[Path, str], tmp_path: Path
) -> None:
    out, _ = swept
    record = json.loads((out / "sweep.json").read_text())
    assignments = record["variants"][4]["assignments"]
    assert len(assignments) == 3
    done = invoke("run", CASE, "-o", tmp_path / "alone", "--set", *TINY_WORDS, *assignments)
    assert done.exit_code == 0, done.output
    summary = json.loads((tmp_path / "alone" / "summary.json").read_text())
    row = record["rows"][4]
    assert summary["pantographs"][0]["std_N"] == row["std_N"]
    assert summary["pantographs"][0]["max_N"] == row["max_N"]


def test_the_same_command_continues_and_more_samples_join(
    swept: tuple[Path, str], file: Path, tmp_path: Path
) -> None:
    out, _ = swept
    more = tmp_path / "more.toml"
    more.write_text(SAMPLE.replace("n = 6", "n = 7"))
    before = rows_of(out)
    done = invoke("sweep", CASE, "-o", out, "--sample", more, "--set", *TINY_WORDS)
    assert done.exit_code == 0, done.output
    assert done.stdout.count("done already") == 6
    assert rows_of(out)[:6] == before and len(rows_of(out)) == 7
    again = invoke("sweep", CASE, "-o", out, "--sample", file, "--set", *TINY_WORDS)
    assert again.exit_code == 2
    assert "a sweep with other variants (sample_000007)" in again.stderr


def test_parts_of_two_machines_merge_into_the_same_table(
    swept: tuple[Path, str], file: Path, tmp_path: Path
) -> None:
    out, _ = swept
    parts = [tmp_path / "one", tmp_path / "two"]
    for number, folder in enumerate(parts, start=1):
        done = invoke(
            "sweep",
            CASE,
            "-o",
            folder,
            "--sample",
            file,
            "--part",
            f"{number}/2",
            "--set",
            *TINY_WORDS,
        )
        assert done.exit_code == 0, done.output
    parts = [folder / f"part_{number}_of_2" for number, folder in enumerate(parts, start=1)]
    merged = tmp_path / "merged"
    done = invoke("merge", *parts, "-o", merged)
    assert done.exit_code == 0, done.output
    assert "6 variants of en50318_2002" in done.stdout
    # In the order of the design, with the evaluation of all.
    known, found = ([(row["variant"], row["std_N"]) for row in rows_of(of)] for of in (out, merged))
    assert found == known[:6] and len(found) == 6
    assert (merged / "sampling.json").read_text() == (parts[0] / "sampling.json").read_text()
    evaluated = json.loads((merged / "uncertainty.json").read_text())
    assert {row["n"] for row in evaluated["quantiles"]} == {6}
    twice = invoke("merge", *parts, "-o", merged)
    assert twice.exit_code == 2 and "is there already" in twice.stderr
    assert invoke("merge", *parts, "-o", merged, "--force").exit_code == 0


def test_a_table_is_evaluated_again(swept: tuple[Path, str], tmp_path: Path) -> None:
    out, _ = swept
    done = invoke("uncertainty", out / "sweep.csv", "-o", tmp_path)
    assert done.exit_code == 0, done.output
    assert "std_N" in done.stdout
    first, again = (json.loads((path / "uncertainty.json").read_text()) for path in (out, tmp_path))
    assert again["quantiles"] == first["quantiles"]
    assert done.stdout.startswith(f"{catenary.uncertainty(out / 'sweep.csv')}\n")


def test_python_samples_and_evaluates_too(file: Path) -> None:
    scene = catenary.load(CASE).replace(TINY)
    table = catenary.sweep(scene, sample=file)
    found = catenary.uncertainty(table, sample=file)
    assert len(table) == 6 and set(found.statistics["n"]) == {6}
    row = found.quantiles.set_index(["statistic", "probability"]).loc[("std_N", 0.5)]
    assert row["value"] == pytest.approx(table["std_N"].median())
    # Six values have no lower bound of their median's interval but the least: 2/64 lie outside.
    assert (row["value_low"], row["value_high"]) == (table["std_N"].min(), table["std_N"].max())
    with pytest.raises(catenary.InputError, match="give vary or sample, not both"):
        catenary.sweep(scene, {"train.speed_km_h": [250]}, sample=file)
    with pytest.raises(catenary.InputError, match="in the table given as sample"):
        catenary.sweep(scene, sample={"n": 1, "keys": {}})


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--vary", "train.speed_km_h=250"], "give neither --vary nor --variants"),
        (["--part", "3/2"], "it must be I/N with I from 1 to N"),
        (["--plot", "sdt_N"], "did you mean std_N?"),
        (["--set", "train.speed_km_h=-3"], "train.speed_km_h is -3"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(
    words: list[str], sentence: str, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    done = invoke("sweep", CASE, "-o", out, "--sample", file, *words)
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
    assert not out.exists()


def test_verbs_about_tables_refuse_in_one_sentence(tmp_path: Path) -> None:
    for words, sentence in (
        (["uncertainty", tmp_path / "nowhere"], "neither a folder of a sweep nor a table of runs"),
        (["merge", tmp_path, "-o", tmp_path / "a"], "name at least two folders"),
        (["merge", tmp_path, tmp_path, "-o", tmp_path / "a"], "holds no sweep"),
    ):
        done = invoke(*words)
        assert done.exit_code == 2
        assert sentence in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "a").exists()
