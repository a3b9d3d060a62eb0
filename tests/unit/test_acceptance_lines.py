"""Criteria of several rule books on the terminal and in the table of a sweep."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.output import table_of
from catenary.cases.studies.sweep.variants import Variant
from catenary.cases.terminal.terminal_text import _acceptance
from catenary.postproc.evaluate.compare import _judged
from catenary.postproc.evaluate.verdict import Criterion


def judged(book: str, passed: bool | None, compared: bool = False) -> dict[str, Any]:
    return {
        "criterion": "arcing NQ",
        "value": 0.15,
        "limit": 0.2 if passed else 0.1,
        "unit": "%",
        "passed": passed,
        "book": book,
        "compared": compared,
    }


LEFT = {"criterion": "tension of the contact wire", "book": "line", "because": "there is none"}


def test_one_book_needs_no_name() -> None:
    lines = _acceptance({"acceptance": [judged("en50367:2020", True)], "not_judged": []})
    assert lines == [
        "  passed      arcing NQ: 0.15, limit 0.20 % *",
        "  * limit not compared with the text of the standard",
    ]


def test_a_value_at_a_limit_that_it_must_not_reach() -> None:
    row = {**judged("own", False, compared=True), "value": 350.0, "limit": 350.0, "relation": "<"}
    told = _acceptance({"acceptance": [row], "not_judged": []})
    assert told == ["  FAILED      arcing NQ: 350.00, limit < 350.00 %"]


def test_runs_side_by_side_show_what_fails_by_little() -> None:
    one = Criterion("arcing NQ", 0.2046, 0.2, "%", "<=", False, "", compared=True)
    assert _judged(one) == "0.205 % FAILED"
    assert _judged(replace(one, value=0.5)) == "0.50 % FAILED"
    assert _judged(replace(one, value=math.nan, passed=None)) == "no value, not judged"


def test_books_are_named_and_limits_marked() -> None:
    rows = [judged("tsi_ene:2023", False), judged("line", True, compared=True)]
    summary = {"acceptance": rows, "not_judged": [LEFT], "judged_by": "TSI", "passed": False}
    assert _acceptance(summary) == [
        "  FAILED      arcing NQ (tsi_ene:2023): 0.15, limit 0.10 % *",
        "  passed      arcing NQ (line): 0.15, limit 0.20 %",
        "  not judged  tension of the contact wire (line), because there is none",
        "  NOT PASSED by TSI",
        "  * limit not compared with the text of the standard",
    ]
    rows[0] = judged("tsi_ene:2023", True, compared=True)
    assert _acceptance({**summary, "acceptance": rows, "passed": True})[-1] == "  PASSED by TSI"
    assert _acceptance({**summary, "acceptance": [], "passed": None})[-1] == "  NOT JUDGED by TSI"


def test_a_sweep_tells_books_and_what_they_did_not_judge() -> None:
    rows = [judged("tsi_ene:2023", False), judged("line", True)]
    summary = {"acceptance": rows, "not_judged": [LEFT], "passed": False, "pantographs": [{}]}
    (row,) = table_of([Ended(Variant("a", (), {}), "done", summary)]).records()
    assert row["rules"] == ["tsi_ene:2023", "line"]
    assert row["failed"] == ["arcing NQ (tsi_ene:2023)"]
    assert row["not_judged"] == ["tension of the contact wire (line)"]
    # A table of an earlier version has no books.
    old = {"acceptance": [{"criterion": "arcing NQ", "passed": False}], "passed": False}
    (row,) = table_of([Ended(Variant("a", (), {}), "done", old)]).records()
    assert (row["rules"], row["failed"], row["not_judged"]) == ([], ["arcing NQ"], [])
