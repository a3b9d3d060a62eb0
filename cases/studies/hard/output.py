"""What the hard cases leave: all criteria as a table, and a page with a line for each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from catenary.cases.studies.hard.cases import HardCase
from catenary.cases.studies.hard.checks import Criterion
from catenary.postproc.report.study_table import Column, StudyTable, remark_lines

# By case and run of it, sentences about what decides the run's results.
Told = Mapping[str, Mapping[str, Sequence[str]]]
# Criteria that nearly all cases have, and the heads of their columns.
_COLUMNS = {
    "largest contact force [N]": "force [N]",
    "largest lift [m]": "lift [m]",
    "energy from nothing": "energy made",
    "the same at half the step": "at half the step",
    "difference after halving the step twice to once": "refinement",
    "fixed-point correction, head height [m]": "schemes [m]",
}
# Criteria without a figure.
_PLAIN = ("runs to its end", "everything is finite", "the fixed-point correction breaks")


def criteria(found: Sequence[Criterion], told: Told) -> StudyTable:
    """All that was measured, a row each, and a row with the remarks on each case that has any."""
    names = ("case", "criterion", "value", "limit", "kept", "note")
    rows: list[tuple[str, ...]] = [
        (row.case, row.name, f"{row.value:.3g}", f"{row.limit:.3g}", "yes" if row.passed else "no",
         row.note)
        for row in found
    ]  # fmt: skip
    for case, remarks in told.items():
        texts = [f"{run}: {text}" for run, own in remarks.items() for text in own]
        if texts:
            rows.append((case, "remarks", str(len(texts)), "", "", "; ".join(texts)))
    return StudyTable(
        [Column(name) for name in names], [dict(zip(names, row, strict=True)) for row in rows]
    )


def page(cases: Sequence[HardCase], found: Sequence[Criterion], told: Told) -> str:
    """A table of Markdown with a line for each case, and below it the remarks."""
    columns = [
        Column("case", "case"),
        Column("words", "what is hard; *a right answer*"),
        *(Column(name, head, ".2g") for name, head in _COLUMNS.items()),
        *(Column(name, name) for name in ("others", "remarks", "kept")),
    ]
    rows = []
    for case in cases:
        own = {row.name: row for row in found if row.case == case.name}
        others = "; ".join(
            f"{row.name} {row.value:.3g}"
            for name, row in own.items()
            if name not in _COLUMNS and (name not in _PLAIN or not row.passed)
        )
        rows.append(
            {name: row.value for name, row in own.items() if name in _COLUMNS}
            | {
                "case": f"`{case.name}`",
                "words": f"{case.what}; *{case.right}*",
                "others": others,
                "remarks": sum(map(len, told.get(case.name, {}).values())) or None,
                "kept": "yes" if all(row.passed for row in own.values()) else "**no**",
            }
        )
    lines = [StudyTable(columns, rows).markdown()]
    below = remark_lines(run for remarks in told.values() for run in remarks.items())
    if below:
        lines += ["", *(f"- {line.split(maxsplit=1)[1]}" for line in below)]
    return "\n".join(lines) + "\n"


def line(row: Criterion) -> str:
    """A criterion for a terminal."""
    mark = "kept  " if row.passed else "BROKEN"
    note = f"  ({row.note})" if row.note else ""
    return f"    {mark}  {row.name:48} {row.value:10.3g}  limit {row.limit:9.3g}{note}"
