"""Output of a study of tolerances: the table of an installer, and that of all criteria."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from catenary.cases.studies.tolerance.pictures import draw_shares, draw_values
from catenary.cases.studies.tolerance.study import ALL, EACH, Plan, Tolerance, at_least
from catenary.postproc.report.study_table import Column, Content, StudyTable

TABLE, RECORD, PAGE = "tolerance.csv", "tolerance.json", "tolerance.md"
SHARES, VALUES = "tolerance_shares.png", "tolerance_values.png"


def files_of(plan: Plan, found: Sequence[Tolerance]) -> dict[str, Content]:
    """All tables and pictures of a study. Not collective."""
    record = {
        "case": plan.name,
        "task": plan.task.model_dump(exclude_none=True),
        "tolerances": [
            _fields(one) | {"levels": one.samples.records() if one.samples else []} for one in found
        ],
    }
    return {
        TABLE: table_of(found),
        RECORD: record,
        PAGE: markdown(plan, found),
        SHARES: partial(draw_shares, plan, found),
        VALUES: partial(draw_values, found),
    }


def _fields(one: Tolerance) -> dict[str, Any]:
    found = {name: value for name, value in vars(one).items() if name not in ("samples", "bound")}
    return found | {"at_most": one.at_most}


def table_of(found: Sequence[Tolerance]) -> StudyTable:
    """A row for each error and criterion."""
    rows = [
        _fields(one)
        | {
            "shown": one.text,
            "samples": f"{one.kept} of {one.n_samples}" if one.level else "",
            "least_share": one.least_share if one.level else None,
            "linear": one.linear if np.isfinite(one.linear or 0.0) else None,
            "as_run": None if one.checked is None else at_least(one.checked, one.most),
        }
        for one in found
    ]
    # Heads of people's tables; without a worst case these columns stand in files alone.
    has_worst = any(one.linear is not None for one in found)
    slopes, as_run = ("worst case by slopes +-", "as run +-") if has_worst else ("", "")
    columns = (
        Column("error", "error"),
        Column("criterion", "criterion"),
        Column("level"),
        Column("shown", "tolerance +-", ">", in_files=False),
        Column("unit", "unit"),
        Column("at_most"),
        Column("kept"),
        Column("n_samples"),
        Column("samples", "samples keep it", ">", in_files=False),
        Column("least_share", "share at least", ".3f"),
        Column("linear", slopes, ".3g"),
        Column("checked"),
        Column("as_run", as_run, ">", in_files=False),
        Column("lost_at", "a line loses it at +-", ".3g"),
    )
    return StudyTable(columns, rows, "Tolerances by criterion")


def installer_table(plan: Plan, found: Sequence[Tolerance]) -> StudyTable:
    """Tolerance of each error for all criteria at once that the line keeps without errors."""
    rows = []
    together = _of_each([one for one in found if one.error == ALL])
    for group in plan.groups:
        own = [one for one in found if one.error == group.table.name]
        each = _of_each(own)
        row = {"error": group.table.name, "unit": group.unit, "n": len(group.names)}
        row |= {"alone": "none", "lost_at": None, "by": "", "together": ""}
        row["worst"] = None
        if each is not None:
            row |= {"alone": each.text, "lost_at": each.lost_at, "by": _first_to_fail(own)}
            row["worst"] = each.linear if np.isfinite(each.linear or 0.0) else None
        if together is not None:
            level = group.table.level
            row["together"] = at_least(together.level * level, together.most * level)
        rows.append(row)
    columns = [
        Column("error", "error"),
        Column("n", "number", "d"),
        Column("alone", "alone +-", ">"),
        Column("worst", "worst case by slopes +-", ".3g"),
        Column("lost_at", "a line fails at +-", ".3g"),
        Column("together", "all together +-", ">"),
        Column("unit", "unit"),
        Column("by", "first criterion to fail alone"),
    ]
    absent = {"worst"} if not plan.task.samples.worst_case else set()
    absent |= {"together"} if together is None else set()
    columns = [column for column in columns if column.name not in absent]
    title, lost = "Installation tolerances", _lost(found)
    if lost:
        n = len({one.criterion for one in found if one.criterion != EACH})
        title += f" for {n - len(lost)} of {n} criteria: others fail without errors"
    return StudyTable(columns, rows, title)


def _lost(found: Sequence[Tolerance]) -> list[str]:
    """The criteria that the line does not keep without errors."""
    return list(dict.fromkeys(one.criterion for one in found if not one.is_kept))


def _of_each(found: Sequence[Tolerance]) -> Tolerance | None:
    """The tolerance for all criteria at once that the line keeps without errors, None for none."""
    kept = [one for one in found if one.is_kept]
    return next((one for one in kept if one.criterion == EACH), kept[0] if kept else None)


def _first_to_fail(found: Sequence[Tolerance]) -> str:
    """The criterion with the least tolerance of those that the line keeps without errors."""
    kept = [one for one in found if one.criterion != EACH and one.is_kept]
    first = min(kept, key=lambda one: (one.level, one.at_most))
    return "none up to there" if first.at_most else first.criterion


def remarks(plan: Plan, found: Sequence[Tolerance]) -> list[str]:
    """Sentences on what the tables cannot say."""
    sentences = []
    if lost := _lost(found):
        sentences.append(
            f"not kept without errors, and left out of all tolerances: {', '.join(lost)}"
        )
    if all(not one.is_kept for one in found):
        return sentences
    samples = plan.task.samples
    fail = f"at most {samples.allowed} of them fail" if samples.allowed else "none of them fails"
    sentences.append(
        f"at least {100 * samples.probability:g} % of all lines keep the criteria within their "
        f"tolerance, with {100 * samples.confidence:g} % confidence: {samples.n} samples show this "
        f"if {fail}; tolerances are found to {100 * samples.resolution:g} % of the greatest that "
        "was tried"
    )
    if samples.worst_case:
        sentences.append(
            "`by slopes` is linear in the errors, `as run` is a run of the line with these errors: "
            "where both differ much, the linear estimate fails, and other lines may be worse"
        )
    if any(one.lost_at is not None for one in found):
        sentences.append(
            "`a line fails at` is the smallest tolerance at which a run fails, of a sample or of "
            "the worst case by slopes. If it is not above the tolerance, that line is one of the "
            "few that may fail: a tolerance that all lines keep is smaller"
        )
    return sentences


def as_text(plan: Plan, found: Sequence[Tolerance]) -> str:
    """The results for a terminal."""
    tables = (installer_table(plan, found), table_of(found))
    parts = [f"{table.title}\n{table.text()}\n" for table in tables]
    return "\n".join([*parts, *(f"REMARK      {text}" for text in remarks(plan, found))])


def markdown(plan: Plan, found: Sequence[Tolerance]) -> str:
    """The results as a page."""
    tables = (installer_table(plan, found), table_of(found))
    parts = [f"# Tolerances of {plan.name}"]
    parts += [f"## {table.title}\n\n{table.markdown()}" for table in tables]
    parts.append("\n".join(f"- {text}" for text in remarks(plan, found)))
    return "\n\n".join(parts) + "\n"
