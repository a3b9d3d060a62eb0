"""Lengths of droppers before and after a change of a scene, as an installer needs them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from catenary.cases.run.at_rest.static_table import static_table
from catenary.cases.scene.scene import Scene
from catenary.postproc.report.study_table import Column, StudyTable

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
    rows: list[Mapping[str, Any]] = []
    number: dict[int, int] = {}
    for i, (x, span) in enumerate(zip(after["in_span"], after["span"], strict=True)):
        number[span] = number.get(span, 0) + 1
        rows.append(
            {
                "span": int(span) + 1,
                "dropper": number[span],
                "wires": after["wires"][i],
                "in_span_m": float(x),
                "moved_mm": 1e3 * float(x - before["in_span"][i]),
                "shipped_mm": 1e3 * float(before["length"][i]),
                "length_mm": 1e3 * float(after["length"][i]),
                "change_mm": 1e3 * float(after["length"][i] - before["length"][i]),
            }
        )
    return StudyTable(_COLUMNS, rows, "Lengths of droppers")


def of_one_span(table: StudyTable, span: int) -> StudyTable:
    """The rows of a span, by its number from 1."""
    rows = [row for row in table.rows if row["span"] == span]
    return StudyTable(table.columns, rows, f"Lengths of droppers in span {span}")


def _droppers(scene: Scene) -> dict[str, Any]:
    """Spans, places in them, lengths and wires of all droppers along the track."""
    table = static_table(scene)
    order = np.argsort(table["dropper_x"], kind="stable")
    span = table["dropper_span"].astype(int)[order]
    wires = zip(table["dropper_upper"][order], table["dropper_lower"][order], strict=True)
    return {
        "span": span,
        "in_span": table["dropper_x"][order] - table["support_x"][span],
        "length": table["dropper_length"][order],
        "wires": [f"{_text(upper)} to {_text(lower)}" for upper, lower in wires],
    }


def _text(name: Any) -> str:
    return name.decode() if isinstance(name, bytes) else str(name)
