"""A short accuracy study of the reference model: true errors, estimates, files, continuation."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from measuring import check
from program import catenary

pytestmark = pytest.mark.study

CASE = "en50318_2002"
AXES = "dt,grid,scheme,dropper"
# Six spans less than the case's short form has; two are evaluated.
SHORTER = ("line.n_spans=10", "train.start_m=90", "evaluation.from_m=240", "evaluation.to_m=360")


def words(out: Path, axes: str = AXES) -> list[str]:
    options = ["--axes", axes, "--quick", "--repeats", "2", "--target", "3%"]
    return ["accuracy", CASE, "-o", str(out), *options, "--set", *SHORTER]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a study with two levels of each setting and what was said."""
    out = tmp_path_factory.mktemp("accuracy") / "out"
    ran = catenary(*words(out), cwd=out.parent, pictures=True)
    assert ran.code == 0, ran.stderr
    return out, ran.stdout


def rows(out: Path) -> dict[tuple[str, str], dict[str, str]]:
    with (out / "accuracy.csv").open() as file:
        return {(row["axis"], row["level"]): row for row in csv.DictReader(file)}


def test_every_axis_has_two_levels_and_what_they_cost(done: tuple[Path, str]) -> None:
    table = rows(done[0])
    for axis in AXES.split(","):
        own = [row for (name, _), row in table.items() if name == axis]
        assert len(own) == (4 if axis == "grid" else 2)
        assert all(row["outcome"] == "done" for row in own)
        assert all(float(row["march_s_per_s"]) > 0 and int(row["n_timed"]) == 2 for row in own)


def test_the_error_of_the_step_is_of_second_order(done: tuple[Path, str]) -> None:
    """Newmark's average acceleration; the reference of 0.125 ms takes 1/64 from the error of 1 ms
    and 1/256 from that of 2 ms: log2(4 (1 - 1/256) / (1 - 1/64)) = 2.02. Droppers that slacken
    between two steps take up to a fifth of an order."""
    record = json.loads((done[0] / "accuracy.json").read_text())
    axis = next(axis for axis in record["axes"] if axis["name"] == "dt")
    ((size, order),) = axis["orders"]["history"]
    assert size == 2e-3
    check("order", order, 2.02, within=0.25)
    # (dt / 8)^2: the reference is 64 times as exact as the finer level, and told to be 5/4 of that.
    own = rows(done[0])["dt", "1_ms"]
    told = axis["reference_uncertainty_percent"]["history"]
    check("reference", told / float(own["error_history_percent"]), 1 / 50, within=1 / 100)


def test_no_error_of_the_mesh_hides_behind_one_of_the_step(done: tuple[Path, str]) -> None:
    """The reference is good enough for 3 %; five elements leave more than that in the history."""
    out, _ = done
    record = json.loads((out / "accuracy.json").read_text())
    axis = next(axis for axis in record["axes"] if axis["name"] == "grid")
    assert axis["reference_uncertainty_percent"]["history"] < 1.0
    for level in ("1_ms_3_elements", "1_ms_5_elements"):
        row = rows(out)["grid", level]
        whole, step, mesh = (
            float(row[f"error_history_{name}percent"]) for name in ("", "by_step_", "by_mesh_")
        )
        print(f"{level}: {whole:.2f} %, step {step:.2f}, mesh {mesh:.2f}")
        assert 0.0 < step < mesh and whole <= step + mesh
        assert mesh > 3.0
    assert any("No setting tried" in line and "history" in line for line in record["advice"])


def test_the_estimate_is_right_within_a_factor_of_two(done: tuple[Path, str]) -> None:
    for level in ("1_ms", "2_ms"):
        row = rows(done[0])["dt", level]
        ratio = float(row["estimated_history_N"]) / float(row["error_history_N"])
        print(f"{level}: estimate / true error {ratio:.2f}")
        assert 0.5 < ratio < 2.0


def test_numerical_damping_costs_accuracy_and_linear_droppers_are_another_model(
    done: tuple[Path, str],
) -> None:
    out, said = done
    table = rows(out)
    plain, damped = (
        float(table["scheme", level]["error_history_percent"])
        for level in ("average_acceleration", "newmark_0.55")
    )
    assert damped > 1.3 * plain
    # The case as it is has droppers that slacken; linear ones differ by far more than any error.
    assert float(table["dropper", "slackening"]["error_history_percent"]) == 0.0
    assert float(table["dropper", "linear"]["error_history_percent"]) > 30.0
    assert "dropper model: difference of models from the case as it is" in said


def test_what_is_said_is_what_is_written(done: tuple[Path, str]) -> None:
    out, said = done
    record = json.loads((out / "accuracy.json").read_text())
    assert record["target_percent"] == 3.0
    for sentence in record["advice"]:
        assert sentence in said
    assert any(sentence.startswith("For 3 % in") for sentence in record["advice"])
    page = (out / "accuracy.md").read_text()
    assert all(sentence in page for sentence in record["advice"])
    assert "![work and precision](work_precision.png)" in page
    assert (out / "work_precision.png").read_bytes().startswith(b"\x89PNG")


def test_a_study_goes_on_where_it_was(done: tuple[Path, str]) -> None:
    out, _ = done
    before = rows(out)
    (out / "runs" / "dt__2_ms" / "variant.json").unlink()  # as a kill does
    again = catenary(*words(out), cwd=out.parent)
    assert again.code == 0, again.stderr
    assert "dt__2_ms: done already" not in again.stdout
    assert "dt__1_ms: done already" in again.stdout
    after = rows(out)
    assert after["dt", "2_ms"]["error_std_N"] == before["dt", "2_ms"]["error_std_N"]


def test_other_settings_in_the_same_folder_are_refused(done: tuple[Path, str]) -> None:
    other = catenary(*words(done[0], "dt"), "train.speed_km_h=300", cwd=done[0].parent)
    assert other.code == 2 and "another configuration" in other.stderr
