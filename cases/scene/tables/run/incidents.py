"""Scene tables of what happens during a run: droppers, tensions, pantographs."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from catenary.cases.scene.tables.table import Table

# With less a wire sags by more than a hundred times as much: as much as a span is long, which is
# no small displacement of a stretched wire any longer.
LEAST_SHARE = 0.01


class IncidentTable(Table):
    """What all incidents have in common."""

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
    wire: str = Field(
        min_length=1,
        max_length=100,
        description="name of a wire of the line, such as contact_wire, messenger_wire",
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
