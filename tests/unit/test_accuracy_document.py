"""Figures in tables of docs/accuracy.md are those of the pages that studies wrote beside them."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

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
