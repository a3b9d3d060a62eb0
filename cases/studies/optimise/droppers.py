"""Droppers of an optimum: lengths before and after, as an installer needs them; forces at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from catenary.cases.run.at_rest.static_table import static_table
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.statics.line_at_rest import stable_form

_COLUMNS = (
    Column("span", "span", "d"),
    Column("dropper", "dropper", "d"),
    Column("wires", "wires", in_files=True),
    Column("in_span_m", "from the support [m]", ".3f"),
    Column("moved_mm", "moved [mm]", "+.1f"),
    Column("shipped_mm", "as shipped [mm]", ".1f"),
    Column("length_mm", "length [mm]", ".1f"),
    Column("change_mm", "change [mm]", "+.1f"),
)


def dropper_table(shipped: Scene, optimum: Scene) -> StudyTable:
    """A row for each dropper of the line: unstretched lengths, to which they are cut.

    Both scenes have as many droppers in each span. Not collective.
    """
    before, after = _droppers(shipped), _droppers(optimum)
    moved = 1e3 * (after["in_span"] - before["in_span"])
    cut = 1e3 * before["length"], 1e3 * after["length"], 1e3 * (after["length"] - before["length"])
    rows: list[Mapping[str, Any]] = []
    number: dict[int, int] = {}
    for i, span in enumerate(after["span"].tolist()):
        number[span] = number.get(span, 0) + 1
        figures = (after["in_span"][i], moved[i], *(own[i] for own in cut))
        cells = (span + 1, number[span], after["wires"][i], *map(float, figures))
        rows.append(dict(zip((column.name for column in _COLUMNS), cells, strict=True)))
    return StudyTable(_COLUMNS, rows, "Lengths of droppers")


def of_middle_span(table: StudyTable) -> StudyTable:
    """The rows of the span in the middle of those with droppers: those at the ends hang
    otherwise."""
    spans = sorted({int(row["span"]) for row in table.rows})
    span = spans[len(spans) // 2]
    rows = [row for row in table.rows if row["span"] == span]
    return StudyTable(table.columns, rows, f"Lengths of droppers in span {span}")


def _droppers(scene: Scene) -> dict[str, Any]:
    """Spans, places in them, lengths and wires of all droppers along the track."""
    table = static_table(scene)
    order = np.argsort(table["dropper_x"], kind="stable")
    span = table["dropper_span"].astype(int)[order]
    ends = (table[f"dropper_{end}"][order].astype(str) for end in ("upper", "lower"))
    return {
        "span": span,
        "in_span": table["dropper_x"][order] - table["support_x"][span],
        "length": table["dropper_length"][order],
        "wires": [f"{upper} to {lower}" for upper, lower in zip(*ends, strict=True)],
    }


def least_forces(scene: Scene) -> np.ndarray:
    """The least force at rest of the first, second, ... droppers of all spans [N].

    Forces are linear in pre-sag, so that a search which knows their slopes takes no step to a line
    that cannot hang. Not collective.

    Raises
    ------
    InputError
        If the line cannot hang.
    """
    problem, mesh = problem_of(scene), mesh_of(scene)
    form = stable_form(problem, mesh)[1]
    x, masts = mesh.x(mesh.droppers[:, 1]), problem.line.support_positions
    order = np.argsort(x, kind="stable")
    span = np.searchsorted(masts, x[order], side="right")
    first = np.searchsorted(span, span)  # where the droppers of each one's span begin
    number = np.arange(span.size) - first
    found = np.full(int(number.max(initial=-1)) + 1, np.inf)
    np.minimum.at(found, number, form.dropper_force[order])
    return found
