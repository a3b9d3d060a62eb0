"""The wind: tables, and conversion to SI."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import StretchTable, Table, either
from catenary.cases.scene.keys.units import angle_from_deg
from catenary.solver.problem.wind import Gusts, Profile, Stretch, Wind, friction_velocity_of

# Widest range of frequencies: so many waves take a second to make.
MOST_HZ = 20.0


class WindStretchTable(StretchTable):
    """A part of the line that is more exposed, such as a viaduct, or sheltered."""

    from_m: float = Field(ge=0, le=1e6, description="where it begins")
    to_m: float = Field(ge=0, le=1e6, description="where it ends")
    speed_factor: float = Field(
        1.0, ge=0, le=3, description="wind speeds there over those elsewhere, gusts included"
    )
    height_m: float | None = Field(
        None, ge=1, le=300, description="height of the wires above ground there, for the mean wind"
    )


class GustsTable(Table):
    """Turbulence about the mean wind; acts with effects.gusts."""

    spectrum: Literal["davenport", "von_karman"] = Field(
        "davenport", description="along the mean wind; upward it is Panofsky's, across Kaimal's"
    )
    turbulence_intensity: float | None = Field(
        None, gt=0, le=0.6, description="standard deviation along it over the mean at height_m"
    )
    friction_velocity_m_per_s: float | None = Field(
        None,
        gt=0,
        le=10,
        description="in place of the intensity; without both that of the logarithmic law",
    )
    length_scale_m: float | None = Field(
        None, gt=1, le=1000, description="of the spectrum of von Karman"
    )
    decay: float = Field(
        10.0, ge=0.5, le=100, description="C of the coherence exp(-C n d/U), along and across"
    )
    decay_upward: float = Field(10.0, ge=0.5, le=100, description="the same of upward gusts")
    lowest_hz: float = Field(0.005, ge=1e-4, le=1, description="lowest frequency")
    highest_hz: float = Field(5.0, ge=0.05, le=MOST_HZ, description="highest frequency")
    spacing_m: float = Field(
        5.0, ge=0.5, le=50, description="of the points between which gusts are linear"
    )
    growth_s: float = Field(2.0, ge=0, le=60, description="time in which gusts grow from zero")
    seed: int = Field(1, ge=0, le=2**31 - 1, description="another seed is another wind")

    @model_validator(mode="after")
    def _consistent(self) -> GustsTable:
        either(self, "turbulence_intensity", "friction_velocity_m_per_s")
        if self.highest_hz <= self.lowest_hz:
            raise ValueError(
                f"must have frequencies, but lowest_hz is {self.lowest_hz:g} and highest_hz "
                f"{self.highest_hz:g}"
            )
        if (self.length_scale_m is not None) != (self.spectrum == "von_karman"):
            raise ValueError(
                "must have length_scale_m with the spectrum von_karman, and with no other"
            )
        return self


class WindTable(Table):
    """Wind over the line; acts with effects.wind."""

    speed_m_per_s: float = Field(
        ge=0, le=80, description="mean speed at reference_height_m; 0 is a calm, without gusts"
    )
    direction_deg: float = Field(
        90.0,
        ge=-360,
        le=360,
        description="in which it blows: 0 with the train, 90 to the left of it, 180 against it",
    )
    height_m: float = Field(6.0, ge=1, le=300, description="height of the wires above ground")
    reference_height_m: float = Field(10.0, ge=1, le=300, description="height of the mean speed")
    profile: Literal["log", "power"] = Field(
        "log", description="how the mean grows with the height"
    )
    roughness_length_m: float = Field(
        0.05, ge=1e-5, le=0.9, description="of the ground: logarithmic law, friction velocity"
    )
    exponent: float | None = Field(None, ge=0, le=1, description="of the power law")
    air_density_kg_per_m3: float = Field(1.225, ge=0.5, le=2, description="density of the air")
    drag: Literal["linear", "quadratic"] = Field(
        "linear", description="gusts linearised about the mean, or with the square of the whole"
    )
    stretches: list[WindStretchTable] = Field(
        default_factory=list, max_length=1000, description="parts of other exposure, ascending"
    )
    gusts: GustsTable | None = Field(None, description="turbulence; without it the wind is steady")

    @model_validator(mode="after")
    def _one_profile(self) -> WindTable:
        if (self.exponent is not None) != (self.profile == "power"):
            raise ValueError("must have exponent with the profile power, and with no other")
        return self


def wind_of(table: WindTable | None) -> Wind | None:
    """The wind of a scene, None if there is none or a calm."""
    if table is None or table.speed_m_per_s == 0.0:
        return None
    wind = Wind(
        speed=table.speed_m_per_s,
        direction=angle_from_deg(table.direction_deg),
        height=table.height_m,
        reference_height=table.reference_height_m,
        profile=Profile(table.roughness_length_m, table.exponent),
        density=table.air_density_kg_per_m3,
        quadratic=table.drag == "quadratic",
        stretches=tuple(
            Stretch(own.from_m, own.to_m, own.speed_factor, own.height_m) for own in table.stretches
        ),
    )
    if table.gusts is None:
        return wind
    return wind.with_gusts(_gusts(wind, table.gusts))


def _gusts(wind: Wind, table: GustsTable) -> Gusts:
    velocity = table.friction_velocity_m_per_s
    if table.turbulence_intensity is not None:
        velocity = friction_velocity_of(table.turbulence_intensity, wind.mean)
    return Gusts(
        friction_velocity=wind.friction_velocity if velocity is None else velocity,
        spectrum=table.spectrum,
        length_scale=table.length_scale_m or 0.0,
        decay=(table.decay, table.decay, table.decay_upward),
        lowest=table.lowest_hz,
        highest=table.highest_hz,
        spacing=table.spacing_m,
        growth=table.growth_s,
        seed=table.seed,
    )
