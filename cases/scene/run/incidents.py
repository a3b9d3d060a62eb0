"""Incidents during a run: tables, and conversion to SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from catenary.cases.scene.keys.table import Table, WireName
from catenary.meshgen.line import Line
from catenary.solver.problem.defects import DropperBreak, LineIncident, TensionLoss

if TYPE_CHECKING:
    from catenary.mbs.head.stepping import Lowering


# With less a wire sags by more than a hundred times as much: as much as a span is long, which is
# no small displacement of a stretched wire any longer.
LEAST_SHARE = 0.01


class IncidentTable(Table):
    """Keys of every incident."""

    at_s: float = Field(
        ge=0, le=1e5, description="time from the start of the run; rounded to the end of a step"
    )


class DropperBreakTable(IncidentTable):
    """A dropper that carries nothing from then on."""

    type: Literal["dropper_break"] = Field(description="kind of incident")
    span: int = Field(ge=1, le=20_000, description="number of its span, from 1")
    dropper: int = Field(ge=1, le=200, description="its number in the span, from 1")


class TensionLossTable(IncidentTable):
    """A wire that has only a share of its tension from then on."""

    type: Literal["tension_loss"] = Field(description="kind of incident")
    wire: WireName = Field(
        description="name of a wire of the line, such as contact_wire, messenger_wire"
    )
    share: float = Field(
        ge=LEAST_SHARE,
        lt=1,
        description="what is left of the tension that it had at the start, as a share",
    )


class LoweringTable(IncidentTable):
    """A pantograph that is lowered, at once and under way."""

    type: Literal["lowering"] = Field(description="kind of incident")
    pantograph: int = Field(1, ge=1, le=16, description="its number in running order, from 1")
    force_N: float = Field(
        -60.0, ge=-1000, lt=0, description="what the static force becomes: it pulls the head down"
    )
    within_s: float = Field(
        0.2, ge=0.01, le=10, description="time in which the static force goes over to that"
    )
    drop_m: float = Field(
        0.4, gt=0, le=5, description="how far below its height at that time the head is caught"
    )


Incident = Annotated[
    DropperBreakTable | TensionLossTable | LoweringTable, Field(discriminator="type")
]


def line_incidents(
    tables: Sequence[IncidentTable], line: Line, dt: float
) -> tuple[LineIncident, ...]:
    """Incidents of ``line`` from a scene's ``tables``, each at the end of a step of ``dt`` [s]."""
    found: list[LineIncident] = []
    for table in tables:
        time = at_step(table.at_s, dt)
        if isinstance(table, DropperBreakTable):
            found.append(DropperBreak(time, line.dropper_of_span(table.span, table.dropper)))
        elif isinstance(table, TensionLossTable):
            found.append(TensionLoss(time, table.wire, table.share))
    return tuple(found)


def lowering_of(tables: Sequence[IncidentTable], number: int, dt: float) -> Lowering | None:
    """Lowering of the pantograph ``number``, from 1; None if it is not lowered."""
    for table in tables:
        if isinstance(table, LoweringTable) and table.pantograph == number:
            from catenary.mbs.head.stepping import Lowering

            return Lowering(at_step(table.at_s, dt), table.force_N, table.within_s, table.drop_m)
    return None


def at_step(time: float, dt: float) -> float:
    """The end of a step that is nearest to ``time`` [s]."""
    return round(time / dt) * dt
