"""The page of an accuracy study: names as words, no empty columns, times that are the least."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from catenary.cases.studies.accuracy import output, runs
from catenary.cases.studies.accuracy.analysis import QUANTITIES, Row
from catenary.cases.studies.accuracy.axes import AXES, mesh
from catenary.cases.studies.accuracy.runs import Measured, Plan, PlannedAxis
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.variants import Variant

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
