"""What a study of tolerances leaves: the table of an installer, and that of all criteria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from catenary.cases.studies.tolerance.study import ALL, CONFIDENCE, Plan, Tolerance
from catenary.postproc.report.study_table import Column, Content, StudyTable, write_files

TABLE, RECORD, PAGE = "tolerance.csv", "tolerance.json", "tolerance.md"


def write(out_dir: Path, plan: Plan, found: Sequence[Tolerance]) -> list[Path]:
    """Write all tables of a study; returns the files. Not collective."""
    record = {
        "case": plan.name,
        "task": plan.task.model_dump(exclude_none=True),
        "tolerances": [asdict(one) | {"least_share": one.least_share} for one in found],
    }
    content: dict[str, Content] = {TABLE: table_of(found), RECORD: record}
    return write_files(out_dir, content | {PAGE: markdown(plan, found)})


def table_of(found: Sequence[Tolerance]) -> StudyTable:
    """A row for each error and criterion."""
    rows = [
        asdict(one)
        | {
            "shown": _level(one),
            "samples": f"{one.kept} of {one.n_samples}" if one.level else "",
            "least_share": one.least_share if one.level else None,
            "linear": one.linear if np.isfinite(one.linear or 0.0) else None,
        }
        for one in found
    ]
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
        Column("linear", "worst case by slopes +-", ".3g"),
        Column("checked", "as run +-", ".3g"),
    )
    return StudyTable(columns, rows, "Tolerances by criterion")


def _level(one: Tolerance) -> str:
    if not one.level:
        return "not kept without errors" if not one.kept else "none"
    return f"{'at least ' if one.at_most else ''}{one.level:.3g}"


def installer_table(plan: Plan, found: Sequence[Tolerance]) -> StudyTable:
    """How far each error may go for all criteria that the line keeps without errors."""
    rows = []
    together = _tightest([one for one in found if one.error == ALL])
    for group in plan.groups:
        own = _tightest([one for one in found if one.error == group.table.name])
        row = {"error": group.table.name, "unit": group.unit, "n": len(group.names)}
        row |= {"alone": "none", "by": "", "together": ""}
        if own is not None:
            row |= {"alone": _level(own), "by": own.criterion}
        if together is not None:
            level = together.level * group.table.level
            row["together"] = f"{'at least ' if together.at_most else ''}{level:.3g}"
        rows.append(row)
    columns = [
        Column("error", "error"),
        Column("n", "number", "d"),
        Column("alone", "alone +-", ">"),
        Column("together", "all together +-", ">"),
        Column("unit", "unit"),
        Column("by", "first criterion to fail alone"),
    ]
    if together is None:
        del columns[3]
    return StudyTable(columns, rows, "What an installer may have")


def _tightest(found: Sequence[Tolerance]) -> Tolerance | None:
    """The least tolerance of criteria that the line keeps without errors, None if it keeps none."""
    kept = [one for one in found if one.level or one.kept]
    return min(kept, key=lambda one: (one.level, one.at_most), default=None)


def remarks(plan: Plan, found: Sequence[Tolerance]) -> list[str]:
    """Sentences on what the tables cannot say."""
    said = []
    lost = list(dict.fromkeys(one.criterion for one in found if not one.level and not one.kept))
    for name in lost:
        said.append(f"{name} is not kept without errors, and no tolerance counts for it")
    samples = plan.task.samples
    said.append(
        f"tolerances are for {100 * samples.probability:g} % of the lines by {samples.number} "
        f"samples, to {100 * samples.resolution:g} % of the greatest that was looked at; `share at "
        f"least` is the lower bound at {100 * CONFIDENCE:g} % confidence"
    )
    if samples.worst_case:
        said.append(
            "`by slopes` is linear in the errors, `as run` the line with just these errors: where "
            "both differ much, slopes do not hold so far"
        )
    return said


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
