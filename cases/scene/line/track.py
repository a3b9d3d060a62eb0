"""The track beneath a line, curve and tunnels: tables, and conversion to SI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table
from catenary.mbs.air import Tunnel
from catenary.meshgen.track import Curve


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


class TunnelTable(Table):
    """A tunnel: aerodynamic forces on pantographs are larger in it, and there is no wind."""

    from_m: float = Field(ge=0, le=1e6, description="place of its first portal")
    to_m: float = Field(ge=0, le=1e6, description="place of its second portal")
    force_factor: float = Field(
        1.0, ge=0.1, le=10, description="aerodynamic forces in it over those on the open line"
    )
    portal_m: float = Field(
        20.0, ge=0, le=1000, description="length behind each portal in which they change"
    )

    @model_validator(mode="after")
    def _has_length(self) -> TunnelTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end behind its start, but to_m is {self.to_m:g} and from_m {self.from_m:g}"
            )
        return self


def curve_of(table: CurveTable) -> Curve:
    """The curve of the track."""
    to_left = 1.0 if table.side == "left" else -1.0
    first = -np.inf if table.from_m is None else table.from_m
    last = np.inf if table.to_m is None else table.to_m
    tilt = math.asin(table.cant_mm / table.rail_distance_mm)
    return Curve(to_left / table.radius_m, tilt, (first, last), table.transition_m)


def tunnels_of(tables: Sequence[TunnelTable]) -> tuple[Tunnel, ...]:
    """Tunnels of a line."""
    return tuple(Tunnel(t.from_m, t.to_m, t.force_factor, t.portal_m) for t in tables)
