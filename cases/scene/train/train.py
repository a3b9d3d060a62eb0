"""The train and the vehicle that moves its pantographs' bases: tables, and conversion to SI."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.keys.table import (
    PAIR,
    Table,
    band,
    given,
    not_with,
    take_away,
    together,
    within,
)
from catenary.cases.scene.keys.units import angle_from_deg
from catenary.mbs.vehicle import (
    GRAVITY,
    Harmonic,
    Irregularity,
    Sideways,
    Source,
    Spline,
    Vehicle,
    VehicleMotion,
)


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


# Farther than this no vehicle moves [m].
MOST = 1.0
Course = Annotated[
    list[PAIR], Field(min_length=4, max_length=100_000), AfterValidator(within(MOST))
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
        description="pairs of position along the track [m] and deviation [m], joined by a cubic "
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
        together(self, "amplitude_m", "frequency_hz")
        if self.phase_deg and self.amplitude_m is None:
            raise not_with("phase_deg", "without amplitude_m")
        if not given(self, "amplitude_m", "by_time", "by_place"):
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
        band(self.shortest_m, self.longest_m)
        return self


_BOGIE = ("bogie_mass_kg", "primary_stiffness_N_per_m", "primary_damping_N_s_per_m")


class SidewaysTable(Table):
    """Sway and roll of a car body on its secondary suspension."""

    roll_inertia_kg_m2: float = Field(ge=10, le=1e7, description="of the car body")
    stiffness_N_per_m: float = Field(gt=0, le=1e8, description="of one bogie, sideways")
    damping_N_s_per_m: float = Field(gt=0, le=1e8, description="of one bogie, sideways")
    spring_distance_m: float = Field(gt=0, le=4, description="between left and right springs")
    centre_above_m: float = Field(ge=0, le=4, description="centre of mass above the springs")
    roof_above_m: float = Field(ge=0, le=6, description="roof above the centre of mass")


class SuspensionTable(Table):
    """A car body on two bogies, between the track and the roof; each pantograph has a car."""

    body_mass_kg: float = Field(ge=100, le=1e6, description="of the car body")
    pitch_inertia_kg_m2: float = Field(
        ge=100, le=1e8, description="of the car body, which yaws with the same"
    )
    stiffness_N_per_m: float = Field(
        gt=0, le=1e9, description="secondary suspension of one bogie, upward"
    )
    damping_N_s_per_m: float = Field(
        gt=0, le=1e8, description="secondary damping of one bogie, upward"
    )
    bogie_distance_m: float = Field(gt=0, le=40, description="between the bogies' middles")
    wheelbase_m: float = Field(gt=0, le=10, description="between the two wheelsets of a bogie")
    pantograph_ahead_m: float = Field(
        0.0, ge=-30, le=30, description="place of a pantograph ahead of the middle of its car"
    )
    bogie_mass_kg: float | None = Field(
        None, ge=10, le=1e5, description="of one bogie; bogies follow the track if absent"
    )
    primary_stiffness_N_per_m: float | None = Field(
        None, gt=0, le=1e9, description="primary suspension of one bogie, upward"
    )
    primary_damping_N_s_per_m: float | None = Field(
        None, gt=0, le=1e8, description="primary damping of one bogie, upward"
    )
    lateral: SidewaysTable | None = Field(
        None, description="sway and roll; the roof follows the track sideways if absent"
    )

    @model_validator(mode="after")
    def _consistent(self) -> SuspensionTable:
        together(self, *_BOGIE)
        if self.wheelbase_m >= self.bogie_distance_m:
            raise ValueError(
                f"must have bogies apart, but bogie_distance_m is {self.bogie_distance_m:g} and "
                f"wheelbase_m {self.wheelbase_m:g}"
            )
        side = self.lateral
        if side is not None:
            weight = self.body_mass_kg * GRAVITY * side.centre_above_m
            if 0.5 * self.stiffness_N_per_m * side.spring_distance_m**2 <= weight:
                raise ValueError(
                    "must hold the car body upright, but its weight turns it over on springs of "
                    f"{self.stiffness_N_per_m:g} N/m that are {side.spring_distance_m:g} m apart"
                )
        return self


class VehicleTable(Table):
    """Motion of the pantographs' bases by the vehicle; acts with effects.vehicle_motion."""

    vertical: MotionTable | None = Field(None, description="motion upward")
    lateral: MotionTable | None = Field(
        None, description="motion to the left of a head that rolls, or whose strips bend"
    )
    irregularity: IrregularityTable | None = Field(
        None, description="track irregularity, which the base follows where there is no suspension"
    )
    suspension: SuspensionTable | None = Field(
        None, description="what stands between the track, as a function of place, and the base"
    )

    @model_validator(mode="after")
    def _moves(self) -> VehicleTable:
        if self.vertical is None and self.lateral is None and self.irregularity is None:
            raise ValueError("needs vertical, lateral or irregularity, but none is given")
        if self.suspension is not None and not self._has_track():
            raise ValueError(
                "must have irregularity or a course by_place with suspension, because what depends "
                f"on time is the base's own motion{take_away()}"
            )
        return self

    def _has_track(self) -> bool:
        """Whether something depends on the place along the track."""
        courses = (self.vertical, self.lateral)
        return self.irregularity is not None or any(
            one is not None and one.by_place is not None for one in courses
        )


def vehicle_of(table: VehicleTable) -> VehicleMotion:
    """Sources of motion of the pantographs' bases, in both directions."""
    track = table.irregularity
    both: tuple[Source, ...] = ()
    if track is not None:
        both = (Irregularity(track.spectrum, track.shortest_m, track.longest_m, track.seed),)
    suspension = None if table.suspension is None else _suspension(table.suspension)
    vertical, lateral = _sources(table.vertical) + both, _sources(table.lateral) + both
    return VehicleMotion(vertical, lateral, suspension)


def _suspension(table: SuspensionTable) -> Vehicle:
    return Vehicle(
        mass=table.body_mass_kg,
        pitch_inertia=table.pitch_inertia_kg_m2,
        stiffness=table.stiffness_N_per_m,
        damping=table.damping_N_s_per_m,
        bogie_distance=table.bogie_distance_m,
        wheelbase=table.wheelbase_m,
        bogie_mass=table.bogie_mass_kg or 0.0,
        primary_stiffness=table.primary_stiffness_N_per_m or 0.0,
        primary_damping=table.primary_damping_N_s_per_m or 0.0,
        pantograph_ahead=table.pantograph_ahead_m,
        sideways=None if table.lateral is None else _sideways(table.lateral),
    )


def _sideways(table: SidewaysTable) -> Sideways:
    return Sideways(
        table.roll_inertia_kg_m2,
        table.stiffness_N_per_m,
        table.damping_N_s_per_m,
        table.spring_distance_m,
        table.centre_above_m,
        table.roof_above_m,
    )


def _sources(table: MotionTable | None) -> tuple[Source, ...]:
    if table is None:
        return ()
    found: list[Source] = []
    if table.by_time is not None:
        found.append(_table(table.by_time, along_track=False))
    if table.by_place is not None:
        found.append(_table(table.by_place, along_track=True))
    if table.amplitude_m is not None and table.frequency_hz is not None:
        phase = angle_from_deg(table.phase_deg)
        found.append(Harmonic(table.amplitude_m, table.frequency_hz, phase))
    return tuple(found)


def _table(pairs: Course, along_track: bool) -> Spline:
    points, values = zip(*pairs, strict=True)
    return Spline(points, values, along_track)
