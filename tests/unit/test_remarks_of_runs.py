"""What studies tell of their runs: each remark once, with the runs that it is of."""

from __future__ import annotations

import csv

from catenary.cases.studies.hard.cases import hard_cases
from catenary.cases.studies.hard.checks import Criterion, criteria, page
from catenary.postproc.report.study_table import remark_lines


def test_a_remark_of_several_runs_is_told_once() -> None:
    told = [("a", ["stiff", "lost"]), ("b", []), ("c", ["lost", "lost"])]
    assert remark_lines(told) == ["REMARK      a: stiff", "REMARK      a, c: lost"]
    assert remark_lines([("a", []), ("b", [])]) == []


def test_many_runs_are_counted_if_a_remark_is_of_them_all() -> None:
    names = "abcde"
    assert remark_lines((name, ["lost"]) for name in names) == ["REMARK      all 5 runs: lost"]
    (line,) = remark_lines((name, ["lost"] if name != "c" else []) for name in names)
    assert line == "REMARK      a, b, d, e: lost"
    assert remark_lines((name, ["lost"]) for name in "ab") == ["REMARK      a, b: lost"]


def test_many_remarks_with_other_numbers_are_one() -> None:
    told = [(f"v{speed}", [f"at {speed}.5 km/h a mesh is coarse"]) for speed in range(300, 306)]
    assert remark_lines([("v200", ["lost"]), *told]) == [
        "REMARK      v200: lost",
        "REMARK      6 of 7 runs, here the numbers of v300: at 300.5 km/h a mesh is coarse",
    ]
    assert len(remark_lines(told[:3])) == 3


def test_tables_of_hard_cases_have_the_remarks_on_them() -> None:
    cases = hard_cases(["undamped_line", "four"])
    found = [Criterion(case.name, "everything is finite", 1.0, 1.0, True) for case in cases]
    told = {"undamped_line": {}, "four": {"four": ["lost"], "four at half the step": ["lost"]}}
    rows = list(csv.DictReader(criteria(found, told).csv().splitlines()))
    assert [row["criterion"] for row in rows] == ["everything is finite"] * 2 + ["remarks"]
    assert rows[2]["case"] == "four" and rows[2]["value"] == "2" and rows[2]["kept"] == ""
    assert rows[2]["note"] == "four: lost; four at half the step: lost"
    lines = page(cases, found, told).splitlines()
    assert lines[-1] == "- four, four at half the step: lost"
    head, sound, lost = ([cell.strip() for cell in lines[n].split("|")] for n in (0, 2, 3))
    assert sound[head.index("remarks")] == "" and lost[head.index("remarks")] == "2"
