"""From a scene's tables to how the line ends."""

from __future__ import annotations

from catenary.cases.scene.tables.line.ends import EndsTable, EndTable
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Fixed, Periodic


def ends_of(table: EndsTable) -> tuple[EndCondition, EndCondition]:
    """How the line begins and how it ends."""
    return _end_of(table.start), _end_of(table.end)


def _end_of(table: EndTable) -> EndCondition:
    if table.kind == "absorbing_layer":
        assert table.spans is not None and table.damping_per_s is not None
        return AbsorbingLayer(table.spans, table.damping_per_s)
    return Periodic() if table.kind == "periodic" else Fixed()
