"""Scene table of a curve of the track."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import Table


class CurveTable(Table):
    """A curve, over the whole line or a stretch of it."""

    radius_m: float = Field(ge=100, le=100_000, description="radius of the circle")
    side: Literal["left", "right"] = Field(
        "left", description="where its centre is, seen in running direction"
    )
    cant_mm: float = Field(
        0.0, ge=0, le=200, description="height of the outer rail above the inner one"
    )
    rail_distance_mm: float = Field(
        1500.0, ge=600, le=2000, description="distance of the rails' middles, over which cant is"
    )
    from_m: float | None = Field(
        None,
        ge=0,
        le=1e7,
        description="start of the curve, transition included; the whole line's if absent",
    )
    to_m: float | None = Field(None, gt=0, le=1e7, description="end of the curve, likewise")
    transition_m: float = Field(
        0.0,
        ge=0,
        le=2000,
        description="length at both ends over which curvature and cant grow evenly",
    )

    @model_validator(mode="after")
    def _consistent(self) -> CurveTable:
        if (self.from_m is None) != (self.to_m is None):
            raise ValueError("needs from_m and to_m together, but only one is given")
        if self.from_m is None or self.to_m is None:
            if self.transition_m:
                raise ValueError("takes transition_m with from_m and to_m, where the curve begins")
            return self
        if self.to_m <= self.from_m + 2.0 * self.transition_m:
            raise ValueError(
                f"must end behind both transitions: to_m ({self.to_m:g}) must be greater than "
                f"{self.from_m + 2.0 * self.transition_m:g} m"
            )
        return self
