"""Scene tables of the vehicle under the pantographs: how it moves their bases."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.tables.table import TAKE_AWAY, Table, ascending

_PAIR = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=2, max_length=2)]
# Farther than this no vehicle moves [m].
MOST = 1.0


def _course(pairs: list[list[float]]) -> list[list[float]]:
    ascending([pair[0] for pair in pairs], "its first numbers")
    for at, value in pairs:
        if abs(value) > MOST:
            raise ValueError(f"must stay within {MOST:g} m, but is {value:g} m at {at:g}")
    return pairs


Course = Annotated[
    list[_PAIR], Field(min_length=4, max_length=100_000), AfterValidator(_course)
]  # fmt: skip


class MotionTable(Table):
    """Motion in one direction, the sum of what is given; up and to the left are positive."""

    by_time: Course | None = Field(
        None, description="pairs of time [s] and place [m], joined by a cubic spline"
    )
    by_time_file: str | None = Field(
        None, min_length=1, description="the same pairs as a CSV file, taken in when it is read"
    )
    by_place: Course | None = Field(
        None,
        description="pairs of place along the track [m] and deviation [m], joined by a cubic "
        "spline: the track as a curve",
    )
    by_place_file: str | None = Field(
        None, min_length=1, description="the same pairs as a CSV file, taken in when it is read"
    )
    amplitude_m: float | None = Field(
        None, gt=0, le=MOST, description="of a sine over time, the same for all pantographs"
    )
    frequency_hz: float | None = Field(None, gt=0, le=20, description="of the sine")
    phase_deg: float = Field(0.0, ge=-360, le=360, description="of the sine at the start")

    @model_validator(mode="after")
    def _consistent(self) -> MotionTable:
        sine = [n for n in ("amplitude_m", "frequency_hz") if getattr(self, n) is not None]
        if len(sine) == 1:
            raise ValueError(f"needs amplitude_m and frequency_hz together, but only has {sine[0]}")
        if self.phase_deg and not sine:
            raise ValueError(f"must not have phase_deg without amplitude_m{TAKE_AWAY}")
        if not sine and self.by_time is None and self.by_place is None:
            raise ValueError(
                "needs by_time, by_place (or files of these) or amplitude_m, but none is given"
            )
        return self


class IrregularityTable(Table):
    """An irregular track that follows a published spectrum, upward and sideways."""

    spectrum: Literal["fra_4", "fra_5", "fra_6", "german_low", "german_high"] = Field(
        description="American classes (FRA) 4 to 6, German low or high disturbance"
    )
    shortest_m: float = Field(3.0, ge=1, le=1000, description="shortest wavelength")
    longest_m: float = Field(100.0, ge=1, le=1000, description="longest wavelength")
    seed: int = Field(1, ge=0, le=2**31 - 1, description="another seed is another track")

    @model_validator(mode="after")
    def _consistent(self) -> IrregularityTable:
        if self.longest_m <= self.shortest_m:
            raise ValueError(
                f"must have waves, but longest_m is {self.longest_m:g} and shortest_m "
                f"{self.shortest_m:g}"
            )
        return self


class VehicleTable(Table):
    """How the vehicle moves the bases of its pantographs; acts with effects.vehicle_motion."""

    vertical: MotionTable | None = Field(None, description="motion upward")
    lateral: MotionTable | None = Field(
        None, description="motion to the left; acts with effects.head_roll"
    )
    irregularity: IrregularityTable | None = Field(
        None, description="track irregularity, which the base follows without a suspension"
    )

    @model_validator(mode="after")
    def _moves(self) -> VehicleTable:
        if self.vertical is None and self.lateral is None and self.irregularity is None:
            raise ValueError("needs vertical, lateral or irregularity, but none is given")
        return self
