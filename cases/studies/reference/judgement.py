"""Figures beside a reference solution: difference, error bar, tolerance, verdict."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from catenary.cases.studies.reference.convergence import QUANTITIES
from catenary.cases.studies.reference.solutions import Solution
from catenary.postproc.evaluate.wording import UNCOMPARED
from catenary.postproc.report.study_table import Column, StudyTable

PASSED, FAILED, NOT_JUDGED = "passed", "failed", "not judged"
COLUMNS = (
    Column("configuration", "configuration"),
    Column("of", "of"),
    Column("quantity"),
    Column("meaning", "quantity", in_files=False),
    Column("value", "value", ".3f"),
    Column("reference", "reference", ".3f"),
    Column("difference", "difference", "+.3f"),
    Column("error_bar", "error bar", ".4f"),
    Column("within_bar", "within bar"),
    Column("lower", "from", ".3f"),
    Column("upper", "to", ".3f"),
    Column("verdict", "verdict"),
    Column("mark", " ", in_files=False),
    Column("clause"),
    Column("compared"),
)


@functools.cache
def limits() -> dict[str, Any]:
    """Limits of EN 50318 as ``limits.toml`` has them. Not collective."""
    return tomllib.loads(Path(__file__).with_name("limits.toml").read_text(encoding="utf-8"))


def judged(
    solution: Solution,
    figures: Mapping[tuple[str, str], float],
    same_rule: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """A row of ``COLUMNS`` for each figure that the solution has, too.

    The tolerance is one of EN 50318; where there is none, the figure is not judged. A figure is
    within the bar if it differs by no more than the reference's own error bar.

    Parameters
    ----------
    figures : by place of the pantograph, or ``LINE``, and quantity, in its unit
    same_rule : the tolerance of all figures, in place of those of EN 50318
    """
    rows = []
    for key, value in figures.items():
        if key not in solution.figures:
            continue
        of, quantity = key
        reference, bar = solution.figures[key]
        tolerances = limits()["tolerances"]
        rule = same_rule or next((one for one in tolerances if one["quantity"] == quantity), None)
        bounds = None if rule is None else bounds_of(rule, reference)
        row = judged_row(solution.configuration.name, of, quantity, value, bounds, rule)
        row |= {"reference": reference, "difference": value - reference, "error_bar": bar}
        rows.append(row | {"within_bar": "yes" if abs(value - reference) <= bar else "no"})
    return rows


def bounds_of(rule: Mapping[str, Any], reference: float) -> tuple[float, float]:
    """Least and largest value of a figure by its ``reference``, in its unit; ``rule`` has
    ``absolute`` or ``percent``."""
    allowed = float(rule.get("absolute", 0.01 * rule.get("percent", 0.0) * abs(reference)))
    return reference - allowed, reference + allowed


def judged_row(
    where: str,
    of: str,
    quantity: str,
    value: float,
    bounds: tuple[float, float] | None,
    rule: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """A row of ``COLUMNS`` without a reference.

    Parameters
    ----------
    where : configuration or case
    of : place of the pantograph, or ``LINE``
    quantity : its name, or words
    value : in the quantity's unit
    bounds : least and largest value, None if there are none
    rule : has ``clause`` and ``compared``; None if there are no bounds
    """
    row: dict[str, Any] = dict.fromkeys(column.name for column in COLUMNS)
    row |= {"configuration": where, "of": of, "quantity": quantity, "value": value}
    row["verdict"] = NOT_JUDGED
    if bounds is not None and rule is not None:
        lower, upper = row["lower"], row["upper"] = bounds
        row["verdict"] = PASSED if lower <= value <= upper else FAILED
        row["clause"], row["compared"] = rule["clause"], rule["compared"]
    return row | _words(row)


def _words(row: Mapping[str, Any]) -> dict[str, str]:
    """Further cells of a row for readers: meaning of its quantity, mark if it is not compared."""
    known = QUANTITIES.get(row["quantity"])
    mark = UNCOMPARED if row["compared"] is False else ""
    return {"meaning": known.meaning if known else row["quantity"], "mark": mark}


def table_of(rows: Sequence[dict[str, Any]], title: str) -> StudyTable:
    """The rows as a table."""
    return StudyTable(COLUMNS, rows, title)


def read_table(rows: Sequence[Mapping[str, Any]], title: str) -> StudyTable:
    """The rows for readers, also those of a file, without columns that are empty throughout.

    Whether a figure is within the reference's bar is counted elsewhere, and seen from both.
    """
    rows = [{**row, **_words(row), "within_bar": None} for row in rows]
    filled = [one for one in COLUMNS if any(row[one.name] not in (None, "") for row in rows)]
    return StudyTable(filled, rows, title)


def any_failed(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a figure is beyond its tolerance."""
    return any(row["verdict"] == FAILED for row in rows)


def counts(rows: Sequence[Mapping[str, Any]]) -> str:
    """Numbers of figures within tolerances, within error bars, and not judged, in words."""
    kept = sum(row["verdict"] == PASSED for row in rows)
    open_ = sum(row["verdict"] == NOT_JUDGED for row in rows)
    barred = [row for row in rows if row["error_bar"] is not None]
    within = sum(row["within_bar"] == "yes" for row in barred)
    words = f"{kept} of {len(rows) - open_} judged figures are within their limits"
    if open_:
        words += f"; {open_} have no limit"
    if barred:
        words += f"; {within} of {len(barred)} are within the reference's error bar"
    return words + "."
