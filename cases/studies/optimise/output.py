"""Output of an optimisation: tables for installers and of checks, the scene's keys, a page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from catenary.cases.scene.keys.units import unit_of
from catenary.cases.studies.optimise.search import Point, of_middle_span
from catenary.cases.studies.optimise.study import AS_IS, COMPARED, Optimum, Plan, Row, change
from catenary.cases.studies.sweep.variants import text_of
from catenary.postproc.files.disk import plain
from catenary.postproc.report.study_table import (
    Column,
    Content,
    StudyTable,
    file_table,
)

RECORD, PAGE, KEYS = "optimise.json", "optimise.md", "optimum.toml"
DROPPERS, CHECKS, HISTORY = "droppers", "checks", "history"
# Columns that say to which scene a row of checks belongs, with heads for people.
_PLACES = {"check": "check", "scene": "scene", "pantograph": "pantograph", "searched": "",
           "outcome": ""}  # fmt: skip


def files_of(plan: Plan, found: Sequence[Optimum]) -> dict[str, Content]:
    """All tables of an optimisation. Not collective."""
    content: dict[str, Content] = {
        RECORD: record(plan, found),
        PAGE: markdown(plan, found),
        KEYS: keys_text(found),
    }
    for one in found:
        content[f"{DROPPERS}_{one.method}.csv"] = one.droppers
        content[f"{CHECKS}_{one.method}.csv"] = checks_table(one.rows)
        content[f"{HISTORY}_{one.method}.csv"] = history_table(plan, one.history)
    return content


def record(plan: Plan, found: Sequence[Optimum]) -> dict[str, Any]:
    """All results as plain values."""
    return {
        "case": plan.name,
        "task": plan.task.model_dump(exclude_none=True),
        "warnings": list(plan.warnings),
        "optima": [
            {
                "method": one.method,
                "objective_shipped": one.shipped.value,
                "objective": one.found.value,
                "violation_shipped": one.shipped.violation,
                "violation": one.found.violation,
                "n_runs": one.n_runs,
                "values": dict(one.values),
                "not_improved": one.remarks,
                "checks": checks_table(one.rows).records(),
                "droppers": one.droppers.records(),
            }
            for one in found
        ],
    }


def keys_text(found: Sequence[Optimum]) -> str:
    """The optima as named variants, which ``catenary sweep --variants`` reads."""
    lines = []
    for one in found:
        texts = [json.dumps(f"{key}={text_of(value)}") for key, value in one.values.items()]
        lines.append(f"{one.method} = [{', '.join(texts)}]")
    return "\n".join(["# Keys of the optima, for `catenary sweep CASE --variants`.", *lines, ""])


def history_table(plan: Plan, history: Sequence[Point]) -> StudyTable:
    """All points of a search in their order, ``history``: objective, violation, changes of the
    variables."""
    names = [one.name for one in plan.variables.components]
    heads = ("objective", "violation", *names, "broke")
    return file_table(
        heads,
        (
            (plain(one.value), plain(one.violation), *one.change.tolist(), one.broke)
            for one in history
        ),
    )


def variables_table(plan: Plan, one: Optimum) -> StudyTable:
    """Values of the variables as shipped and at an optimum, ``one``."""
    rows: list[Mapping[str, Any]] = []
    for part, by in zip(plan.variables.components, one.found.change.tolist(), strict=True):
        entry = part.entries[0] if part.entries else None
        before, after = (
            values[part.key] if entry is None else values[part.key][entry]
            for values in (plan.variables.shipped, one.values)
        )
        at = " (at a bound)" if by in (part.low, part.high) else ""
        unit = unit_of(part.key)
        rows.append(
            {
                "variable": f"{part.name}{f' [{unit}]' if unit else ''}{at}",
                "shipped": before,
                "optimum": after,
                "change": after - before,
            }
        )
    columns = (
        Column("variable", "variable"),
        Column("shipped", "as shipped", ".5g"),
        Column("optimum", "optimum", ".5g"),
        Column("change", "change", "+.4g"),
    )
    return StudyTable(columns, rows, "Variables")


def _compared(heads: Mapping[str, str]) -> list[Column]:
    """Two columns for each figure that is compared, under its head and an arrow."""
    return [
        Column(f"{design}_{name}", head if design == "shipped" else "->", ".4g")
        for name, head in heads.items()
        for design in ("shipped", "optimum")
    ]


def checks_table(rows: Sequence[Row]) -> StudyTable:
    """A row for each pantograph of each scene under each check."""
    table: list[dict[str, Any]] = []
    for row in rows:
        cells = {name: getattr(row, name) for name in _PLACES}
        for name in COMPARED:
            cells[f"shipped_{name}"] = row.shipped.get(name)
            cells[f"optimum_{name}"] = row.optimum.get(name)
        done = row.outcome == "done"
        cells["std_change_percent"] = 100.0 * change(row, "std_N") if done else None
        table.append(cells)
    columns = [Column(name, head) for name, head in _PLACES.items()]
    columns += _compared({name: name for name in COMPARED})
    return StudyTable([*columns, Column("std_change_percent", "std [%]", "+.1f")], table, "Checks")


def checks_in_short(rows: Sequence[Row]) -> StudyTable:
    """A row for each check and direction: the worst figures of their scenes and pantographs."""
    worst = {name: max if sign > 0 else min for name, sign in COMPARED.items()}
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row.outcome == "done":
            groups.setdefault((row.check, row.direction), []).append(row)
    table: list[dict[str, Any]] = []
    for (check, direction), own in groups.items():
        cells: dict[str, Any] = {"check": check, "n": len(own)}
        cells["direction"] = direction if own[0].searched else f"{direction} (not searched)"
        for name, of in worst.items():
            for design in ("shipped", "optimum"):
                values = [getattr(row, design).get(name) for row in own]
                given = [value for value in values if value is not None]
                cells[f"{design}_{name}"] = of(given, default=None)
        by = [100.0 * change(row, "std_N") for row in own]
        table.append(cells | {"least": min(by), "most": max(by)})
    columns = [
        *(Column("check", "check"), Column("direction", "direction"), Column("n", "rows", "d")),
        *_compared({name: f"{of.__name__} {name}" for name, of in worst.items()}),
        *(Column("least", "std by [%]", "+.1f"), Column("most", "to", "+.1f")),
    ]
    return StudyTable(columns, table, "Checks")


def sentence(one: Optimum, plan: Plan) -> str:
    """The result of a method in one sentence."""
    objective = plan.task.objective
    kept = "all constraints kept" if plan.task.constraints else "no constraints"
    if one.found.violation:
        kept = "constraints NOT kept"
    share = one.found.value / one.shipped.value - 1.0 if one.shipped.value else 0.0
    return (
        f"{plan.name}, {one.method}: {objective.over} {objective.statistic} of the set "
        f"{one.shipped.value:.4g} to {one.found.value:.4g} ({100 * share:+.1f} %), {kept}, "
        f"{one.n_runs} runs of the search"
    )


def tables_of(plan: Plan, one: Optimum) -> list[StudyTable]:
    """The tables that people read: variables, droppers of one span, checks in short."""
    tables = [variables_table(plan, one)]
    # In tenths of a millimetre, which people read.
    rows = one.droppers.rows
    if any(max(abs(row["change_mm"]), abs(row["moved_mm"])) >= 0.05 for row in rows):
        tables.append(of_middle_span(one.droppers))
    return [*tables, checks_in_short(one.rows)]


def as_text(plan: Plan, found: Sequence[Optimum]) -> str:
    """The results for a terminal."""
    parts = []
    for one in found:
        parts.append(sentence(one, plan))
        parts += [f"\n{table.title}\n{table.text()}" for table in tables_of(plan, one)]
        worse = one.remarks or [
            f"none of {', '.join(COMPARED)} gets worse in any row of the checks"
        ]
        parts.append("\n" + "\n".join(f"REMARK      {text}" for text in worse) + "\n")
    return "\n".join(parts).rstrip()


def markdown(plan: Plan, found: Sequence[Optimum]) -> str:
    """The results as a page."""
    parts = [f"# Optimisation of {plan.name}"]
    parts += [f"**Warning:** {text}" for text in plan.warnings]
    for one in found:
        parts += [f"## {one.method}", sentence(one, plan)]
        parts += [f"### {table.title}\n\n{table.markdown()}" for table in tables_of(plan, one)]
        worse = one.remarks or [
            f"None of {', '.join(COMPARED)} gets worse in any row of the checks."
        ]
        parts.append("### Not improved\n\n" + "\n".join(f"- {text}" for text in worse))
    parts.append(
        f"A row of checks is a pantograph of a scene; `{AS_IS}` is the case's whole stretch with "
        "its own mesh and step. CSV files beside this page have all rows."
    )
    return "\n\n".join(parts) + "\n"
