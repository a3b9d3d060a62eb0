"""Aerodynamic uplift of a pantograph: tables, and conversion to SI."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table, ascending, exactly_one
from catenary.cases.scene.keys.units import speed_from_km_h
from catenary.mbs.air import Polynomial, Uplift
from catenary.mbs.air import Table as SpeedTable

_Coefficient = Annotated[float, Field(ge=-1e4, le=1e4)]
# More than any pantograph is lifted by [N], and faster than any train meets air [km/h].
MOST_UPLIFT, FASTEST = 2000.0, 1500.0


class UpliftTable(Table):
    """Aerodynamic uplift in one running direction."""

    uplift_polynomial: list[_Coefficient] | None = Field(
        None,
        min_length=1,
        max_length=6,
        description="uplift [N] as a polynomial of the air's speed [km/h], its constant first",
    )
    uplift_by_speed: list[Annotated[list[float], Field(min_length=2, max_length=2)]] | None = Field(
        None,
        min_length=2,
        max_length=1000,
        description="pairs of the air's speed [km/h] and uplift [N], linear in between; beyond the "
        "ends it goes on with the square of the speed",
    )
    head_share: float = Field(
        1.0, ge=0, le=1, description="part of the uplift on the head; the rest is on its carrier"
    )

    @model_validator(mode="after")
    def _one_uplift(self) -> UpliftTable:
        exactly_one(self, "uplift_polynomial", "uplift_by_speed")
        pairs = self.uplift_by_speed or []
        ascending([pair[0] for pair in pairs], "the speeds of uplift_by_speed")
        for speed, force in pairs:
            if not 0 <= speed <= FASTEST:
                raise ValueError(
                    f"must have speeds between 0 and {FASTEST:g} km/h in uplift_by_speed, but one "
                    f"is {speed:g}"
                )
            if abs(force) > MOST_UPLIFT:
                raise ValueError(
                    f"must have forces within {MOST_UPLIFT:g} N in uplift_by_speed, but one is "
                    f"{force:g}"
                )
        return self


class AerodynamicsTable(UpliftTable):
    """Aerodynamic uplift of a pantograph on top of its static force."""

    reversed: UpliftTable | None = Field(
        None, description="the same for one that runs the other way round"
    )


def uplift_of(table: AerodynamicsTable | None, reversed: bool) -> Uplift | None:
    """Uplift of a pantograph that runs as it is described, or the other way round."""
    if table is None:
        return None
    own: UpliftTable = table
    if reversed and table.reversed is not None:
        own = table.reversed
    return Uplift(_force(own), own.head_share)


def _force(table: UpliftTable) -> Polynomial | SpeedTable:
    if table.uplift_polynomial is not None:
        unit = speed_from_km_h(1.0)
        return Polynomial(tuple(c / unit**k for k, c in enumerate(table.uplift_polynomial)))
    assert table.uplift_by_speed is not None
    speeds, forces = zip(*table.uplift_by_speed, strict=True)
    return SpeedTable(tuple(speed_from_km_h(speed) for speed in speeds), forces)
