"""Scene tables of the train and of the pantographs on it."""

from __future__ import annotations

from pydantic import (
    Field,
)

from catenary.cases.scene.tables.table import Table


class PlacementTable(Table):
    """A pantograph on the train."""

    name: str = Field(min_length=1, description="which table of [pantographs] it is")
    behind_m: float = Field(
        0.0, ge=0, le=1000, description="distance behind the leading pantograph"
    )
    reversed: bool = Field(
        False,
        description="whether a multibody pantograph runs the other way round: its x points back",
    )


class TrainTable(Table):
    """The train: one speed, one or more pantographs."""

    speed_km_h: float = Field(ge=1, le=1000, description="train speed")
    start_m: float = Field(
        ge=0, le=1e6, description="position of the leading pantograph at the start"
    )
    end_m: float | None = Field(
        None,
        ge=0,
        le=1e6,
        description="position of the leading pantograph at the end; one span after the trailing "
        "one has left the evaluated stretch if absent",
    )
    raise_time_s: float = Field(
        0.5, ge=0, le=60, description="time in which the static force grows from zero"
    )
    start_below_m: float = Field(
        0.0,
        ge=0,
        le=5,
        description="how far below the wire at rest all heads start, so that they are raised",
    )
    pantographs: list[PlacementTable] = Field(
        min_length=1, max_length=16, description="pantographs in running order, leading one first"
    )
