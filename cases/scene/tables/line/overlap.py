"""Scene table of the overlaps of tension sections."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from catenary.cases.scene.tables.line.along import Along
from catenary.cases.scene.tables.table import OneOrMore, Table, ascending

FirstSpan = Annotated[int, Field(ge=2, le=20_000)]


class OverlapTable(Table):
    """Spans in which one tension section ends and the next one begins: one overlap or several."""

    first_span: Annotated[list[FirstSpan], OneOrMore, Field(min_length=1, max_length=1000)] = Field(
        description="number of its first span, from 1, or a list of those of several overlaps"
    )
    repeat_every_spans: int | None = Field(
        None,
        ge=4,
        le=20_000,
        description="further overlaps so far apart, from the last one named to the line's end",
    )
    n_spans: int = Field(4, ge=3, le=5, description="number of its spans")
    rise_m: float = Field(
        gt=0,
        le=5,
        description="height that a contact wire gains from the middle to the end of its section",
    )
    distance_m: float = Field(
        0.4, gt=0, le=2, description="distance of the wires of both sections from each other"
    )
    along: Along = Field(
        "tensioner",
        description="what wires end at inside the overlap; acts with effects.axial_motion",
    )

    @model_validator(mode="after")
    def _in_order(self) -> OverlapTable:
        ascending(self.first_span, "first_span")
        return self
