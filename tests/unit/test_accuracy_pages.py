"""Pages of accuracy studies, and the figures of docs/accuracy.md that come from them."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from catenary.cases.studies.accuracy import output, runs
from catenary.cases.studies.accuracy.analysis import QUANTITIES, Row
from catenary.cases.studies.accuracy.axes import AXES, mesh
from catenary.cases.studies.accuracy.runs import Measured, Plan, PlannedAxis
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.variants import Variant

# --- the page of an accuracy study ----------------------------------------------------------------


REFERENCE = "elements__0.2_ms_40_elements"


def planned(name: str = "elements") -> PlannedAxis:
    levels = [mesh(1), mesh(5)]
    chains = ((REFERENCE, "elements__20_elements", "elements__10_elements"),)
    made = {level.name: level.name for level in levels}
    return PlannedAxis(AXES[name], levels, made, {}, REFERENCE, chains)


def row(level: str, error: float) -> Row:
    errors = dict.fromkeys(QUANTITIES, error)
    sizes = {"h": 1.0 / int(level[0])}
    return Row("elements", level, "done", sizes, errors, errors, 0.05, 3, 1.0, 1.01)


def test_a_page_has_words_for_names_and_no_empty_column() -> None:
    rows = [row("1_elements", 4.0), row("5_elements", 1.0), Row("elements", "9_elements", "broke")]
    plan = Plan("a_case", [planned()], [], 2, True, ["a=[1, 2]"], ["elements"])
    found = Measured(plan, rows, {"elements": dict.fromkeys(QUANTITIES, 0.1)}, 60.0)
    lines = output.page(found, ["A sentence."], "").splitlines()
    assert any(
        line.startswith(
            "Reference: 0.2 ms 40 elements. Uncertainty of the reference, from 0.2 ms 40 "
        )
        for line in lines
    )
    again = "`catenary accuracy a_case --axes elements --quick --repeats 2 --set 'a=[1, 2]'`"
    assert again in lines[2]
    table = [line for line in lines if line.startswith("|")]
    assert table[0] == "| elements | " + " | ".join([*QUANTITIES, "solves", "s/s"]) + " |"
    assert {line.count("|") for line in table} == {table[0].count("|")}
    assert [line.split("|")[1].strip() for line in table[2:]] == [
        "1 element",
        "5 elements",
        "9 elements",
    ]
    assert "broke" in table[4]


def test_remarks_stand_below_the_tables_with_the_levels_that_they_are_of() -> None:
    finer = replace(row("5_elements", 1.0), sizes={"h": 0.2})
    rows = [replace(row("1_elements", 4.0), remarks=["lost"]), finer]
    runs_of = {"1_elements": ["lost"], "5_elements": [], REFERENCE: ["stiff"]}
    plan = Plan("a_case", [planned()], [], 2, True, [], ["elements"])
    percent = {"elements": dict.fromkeys(QUANTITIES, 0.1)}
    found = Measured(plan, rows, percent, 60.0, runs_of)
    lines = output.page(found, [], "").splitlines()
    table = [line for line in lines if line.startswith("|")]
    assert [line.split("|")[-2].strip() for line in table] == ["remarks", "---", "1", ""]
    told = ["elements 1 element: lost", "elements 0.2 ms 40 elements: stiff"]
    assert [line for line in lines if line.startswith("- ")] == [f"- {text}" for text in told]
    text = output.as_text(found, 1.0).splitlines()
    assert text[-2:] == [f"REMARK      {line}" for line in told]
    assert [line.split()[-1] for line in text[1:4]] == ["remarks", "1", "-"]
    assert output.table_of(rows).records()[0]["remarks"] == ["lost"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("1_ms_1_elements", "1 ms 1 element"),
        ("0.5_ms_16_elements", "0.5 ms 16 elements"),
        ("fitted_1_mass", "fitted 1 mass"),
        ("fitted_3_mass", "fitted 3 masses"),
        ("11_elements", "11 elements"),
    ],
)
def test_names_of_levels_as_words(name: str, words: str) -> None:
    assert output.in_words(name) == words


def test_the_least_time_is_told() -> None:
    def ended(name: str) -> Ended:
        summary: dict[str, Any] = {
            "simulated_s": 10.0,
            "inner_iterations": {"rounds": 11, "steps": 10},
            "pantographs": [
                {quantity.key: 1.0 for quantity in QUANTITIES.values() if quantity.key}
            ],
            "supports": {"max_uplift_mm": 50.0},
            "indicators": {"time_step": {"force_error_N": [0.5]}},
            "remarks": [f"of {name}"],
        }
        return Ended(Variant(name, ()), "done", summary, {"histories": [[1.0, 2.0]]})

    one = planned()
    names = ["1_elements", "5_elements", *one.chains[0]]
    times = {name: [0.9, 0.4, 0.6] for name in names}
    found = runs.evaluate(Plan("a_case", [one], [], 3), [ended(n) for n in names], times, 1.0)
    assert [each.cost for each in found.rows] == [0.04, 0.04]
    assert [each.timings for each in found.rows] == [3, 3]
    assert [each.remarks for each in found.rows] == [["of 1_elements"], ["of 5_elements"]]
    assert found.remarks[REFERENCE] == [f"of {REFERENCE}"]
    # Several runs at a time are timed again, one by one; of one that breaks then nothing is known.
    lost = runs.evaluate(
        Plan("a_case", [one], [], 3), [ended(n) for n in names], times | {"1_elements": []}, 1.0
    )
    assert [each.timings for each in lost.rows] == [0, 3]
    assert output.table_of(lost.rows).records()[0]["march_s_per_s"] is None


# --- figures in tables of docs/accuracy.md are those of the pages that studies wrote beside -------


PAGES = Path(__file__).parents[2] / "docs" / "accuracy"
DOCUMENT = PAGES.parent / "accuracy.md"
CASES = sorted(folder.name for folder in PAGES.iterdir())
STEPS = ("0.2_ms", "0.5_ms", "1_ms", "2_ms", "4_ms", "8_ms")
SIMPLE = ("en50318_2002", "ac_simple", "ambrosio2012")
FURTHER = ("re330_stitched", "ac_simple_3d", "shinkansen_compound", "dc_twin", "overlap")
SIGMA, HISTORY = "error_std_percent", "error_history_percent"

Page = dict[tuple[str, str], dict[str, str]]


def page(case: str) -> Page:
    with (PAGES / case / "accuracy.csv").open(encoding="utf-8") as file:
        return {(row["axis"], row["level"]): row for row in csv.DictReader(file)}


def table_after(words: str, beginning: str) -> list[str]:
    """Cells of the first row behind ``words`` that begins so, its first cell left out."""
    text = DOCUMENT.read_text(encoding="utf-8")
    assert text.count(words) == 1, words
    for line in text[text.index(words) :].splitlines():
        if line.startswith(f"| {beginning} |"):
            return [cell.strip() for cell in line.strip("|").split("|")[1:]]
    raise AssertionError(f"no row {beginning} behind {words}")


def same(cell: str, value: float, told: str) -> None:
    """A cell may be off by what its last digit leaves open, and half of that for rounding twice."""
    digits = re.fullmatch(r"(\d+)(?:\.(\d+))?", cell)
    assert digits, f"{told}: {cell}"
    last = 10.0 ** -len(digits[2] or "")
    assert abs(float(cell) - value) <= 0.75 * last, (
        f"{told}: {cell} in docs/accuracy.md, {value:g} on its page"
    )


@pytest.mark.parametrize("case", SIMPLE)
def test_errors_of_the_step_are_those_of_the_page(case: str) -> None:
    found = page(case)
    for level, cell in zip(STEPS, table_after("### Time step", f"{case} [%]"), strict=True):
        same(cell, float(found["dt", level][HISTORY]), f"{case}, {level}")


def test_errors_of_meshes_are_those_of_the_pages() -> None:
    for n in (3, 4, 5, 6, 8, 12, 16):
        cells = table_after("### Are four to six elements enough?", str(n))
        for case, both in zip(SIMPLE, cells, strict=True):
            row = page(case)["elements", f"{n}_elements"]
            for cell, name in zip(both.split(", "), (SIGMA, HISTORY), strict=True):
                same(cell, float(row[name]), f"{case}, {n} elements, {name}")


def test_errors_of_corrections_are_those_of_the_pages() -> None:
    for n in (1, 2, 4, 6, 10, 20):
        cells = table_after("### Are six or more corrections needed?", str(n))
        for case, cell in zip(SIMPLE, cells, strict=True):
            value = float(page(case)["scheme", f"corrected_{n}_times"][HISTORY])
            same(cell, value, f"{case}, {n} corrections")


@pytest.mark.parametrize("case", FURTHER)
def test_steps_of_further_lines_are_those_of_the_pages(case: str) -> None:
    rows = page(case)
    at = {
        "re330_stitched": ("`re330_stitched`, 300 km/h", ""),
        "ac_simple_3d": ("`ac_simple_3d`, 275 km/h", ""),
    }.get(case, ("`shinkansen_compound`, 270 km/h", f"`{case}`: "))
    text = DOCUMENT.read_text(encoding="utf-8")
    begin = text.index(at[0])
    lines = text[begin:].splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f"| {at[1]}standard dev"))
    wanted = {
        f"{at[1]}standard deviation": lambda row: float(row[SIGMA]),
        "maximum": lambda row: float(row["error_max_percent"]),
        "force history": lambda row: float(row[HISTORY]),
        "estimate / true": lambda row: (
            float(row["estimated_history_N"]) / float(row["error_history_N"])
        ),
        "times faster than real time": lambda row: 1.0 / float(row["march_s_per_s"]),
    }
    compared = 0
    for line in lines[first:]:
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        if name not in wanted or (compared and name.startswith("`")):
            break
        for level, cell in zip(STEPS, cells, strict=True):
            same(cell, wanted[name](rows["dt", level]), f"{case}, {name}, {level}")
        compared += 1
    assert compared >= 4


@pytest.mark.parametrize("case", ["re330_stitched", "shinkansen_compound", "dc_twin", "overlap"])
def test_meshes_of_further_lines_are_those_of_the_pages(case: str) -> None:
    cells = table_after("Errors of the mesh alone in the force history", f"`{case}`")
    for n, cell in zip((3, 4, 5, 6, 8, 12, 16), cells[:-1], strict=True):
        # At 0.5 ms the study has the errors of the mesh at 0.2 ms beside the whole ones.
        row = page(case)["grid", f"0.5_ms_{n}_elements"]
        same(cell, float(row["error_history_by_mesh_percent"]), f"{case}, {n} elements")


@pytest.mark.parametrize(
    ("case", "rows"),
    [
        ("re330_stitched", {
            "with lateral motion": ("planes", "lateral"),
            "without its stitch wires": ("parts", "without_stitch_wire"),
        }),
        ("shinkansen_compound", {
            "with lateral motion": ("planes", "lateral"),
            "without its auxiliary wire": ("parts", "without_auxiliary_wire"),
        }),
        ("dc_twin", {
            "with lateral motion": ("planes", "lateral"),
            "with one contact wire in place of two": ("parts", "without_twin"),
        }),
        ("overlap", {
            "with lateral motion": ("planes", "lateral"),
            "without the overlap": ("parts", "without_overlap"),
        }),
    ],
)  # fmt: skip
def test_planes_and_parts_are_those_of_the_pages(
    case: str, rows: dict[str, tuple[str, str]]
) -> None:
    columns = (SIGMA, "error_max_percent", "error_uplift_percent", HISTORY, "march_s_per_s")
    beginning = "| as it is, vertical |" if case == "re330_stitched" else f"| `{case}` as it is"
    text = DOCUMENT.read_text(encoding="utf-8")
    lines = text[text.index(beginning) :].splitlines()[1:3]
    for line, (name, key) in zip(lines, rows.items(), strict=True):
        said, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        assert said == name
        for cell, column in zip(cells, columns, strict=True):
            same(cell, float(page(case)[key][column]), f"{case}, {name}, {column}")


def test_every_page_is_spoken_of_and_has_its_picture() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    for case in CASES:
        assert f"(accuracy/{case}/accuracy.md)" in text, case
        assert (PAGES / case / "work_precision.png").stat().st_size > 10_000
        assert (
            (PAGES / case / "accuracy.md")
            .read_text(encoding="utf-8")
            .startswith(f"# Accuracy and cost: {case}\n")
        )
