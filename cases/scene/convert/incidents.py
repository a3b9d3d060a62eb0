"""From a scene's incidents to those of the line and of the pantographs, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from catenary.cases.scene.tables.run.incidents import (
    DropperBreakTable,
    IncidentTable,
    LoweringTable,
    TensionLossTable,
)
from catenary.meshgen.line import Line
from catenary.solver.problem.incidents import DropperBreak, LineIncident, TensionLoss

if TYPE_CHECKING:
    from catenary.mbs.lowering import Lowering


def line_incidents(
    tables: Sequence[IncidentTable], line: Line, dt: float
) -> tuple[LineIncident, ...]:
    """What happens to a line; times [s] at ends of steps of ``dt`` [s]."""
    found: list[LineIncident] = []
    for table in tables:
        time = at_step(table.at_s, dt)
        if isinstance(table, DropperBreakTable):
            found.append(DropperBreak(time, dropper_place(table, line)))
        elif isinstance(table, TensionLossTable):
            found.append(TensionLoss(time, table.wire, table.share))
    return tuple(found)


def lowering_of(tables: Sequence[IncidentTable], number: int, dt: float) -> Lowering | None:
    """How the pantograph ``number``, from 1, is lowered; None if it is not."""
    for table in tables:
        if isinstance(table, LoweringTable) and table.pantograph == number:
            from catenary.mbs.lowering import Lowering

            return Lowering(at_step(table.at_s, dt), table.force_N, table.within_s, table.drop_m)
    return None


def dropper_place(table: DropperBreakTable, line: Line) -> float:
    """Where a dropper of the line stands [m]."""
    return float(line.droppers_of_span(table.span - 1)[table.dropper - 1])


def at_step(time: float, dt: float) -> float:
    """The end of a step that is nearest to ``time`` [s]."""
    return round(time / dt) * dt
