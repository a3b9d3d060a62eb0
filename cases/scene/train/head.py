"""Pan heads and their strips: tables, and conversion to SI."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import Table, given, not_with, together
from catenary.mbs.head.strips import Flexure, Strips, Suspension, Turning

# Keys that belong together: a strip's own suspension, a head's pitch.
_SUSPENSION = ("mass_kg", "stiffness_N_per_m")
_PITCH = ("pitch_inertia_kg_m2", "pitch_spring_distance_m")
# Least mass and inertia of a pantograph's part [kg], [kg m2]; accelerations
# of far less are beyond a computer's numbers.
LEAST_MASS, LEAST_INERTIA = 1e-3, 1e-6


def _no_switch(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be 1 or 2")
    return value


class FlexureTable(Table):
    """Bending of strips on springs of their own, as beams whose ends are free."""

    bending_stiffness_N_m2: float = Field(gt=0, le=1e9, description="EI of a strip")
    spring_distance_m: float = Field(
        gt=0, le=5, description="across the track, between the two springs below a strip"
    )
    modes: int = Field(3, ge=1, le=6, description="of bending that are followed")
    damping_ratio: float = Field(0.01, ge=0, lt=1, description="of each mode")


class StripsTable(Table):
    """Collector strips, fixed to the head or on springs of their own."""

    number: Annotated[Literal[1, 2], BeforeValidator(_no_switch)] = Field(
        1, description="strips of the head, one or two"
    )
    spacing_m: float | None = Field(
        None, gt=0, le=3, description="between two strips, along the track"
    )
    length_m: float | None = Field(
        None, gt=0, le=5, description="of a strip, across the track; unchecked if absent"
    )
    mass_kg: float | None = Field(
        None,
        ge=LEAST_MASS,
        le=100,
        description="of each strip on springs of its own, part of the head's",
    )
    stiffness_N_per_m: float | None = Field(
        None, gt=0, le=1e8, description="between each strip and the head"
    )
    damping_N_s_per_m: float = Field(0.0, ge=0, le=1e6, description="between each strip and head")
    pitch_inertia_kg_m2: float | None = Field(
        None,
        ge=LEAST_INERTIA,
        le=1000,
        description="of a lumped head that pitches between two strips",
    )
    pitch_spring_distance_m: float | None = Field(
        None, gt=0, le=3, description="along the track, between the springs below such a head"
    )

    rake_deg: float = Field(
        0.0,
        ge=-45,
        le=45,
        description="angle between a strip and the cross-section, above 0 if its left end is ahead",
    )
    flexure: FlexureTable | None = Field(
        None, description="how strips on springs of their own bend"
    )

    @model_validator(mode="after")
    def _bends(self) -> StripsTable:
        if self.flexure is None:
            return self
        if self.length_m is None or self.mass_kg is None:
            raise ValueError(
                "needs length_m, mass_kg and stiffness_N_per_m for strips with flexure"
            )
        if self.flexure.spring_distance_m > self.length_m:
            raise ValueError(
                f"must have springs below its strips, but flexure.spring_distance_m is "
                f"{self.flexure.spring_distance_m:g} and length_m {self.length_m:g}"
            )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> StripsTable:
        if self.number == 2 and self.spacing_m is None:
            raise ValueError("needs spacing_m for number = 2")
        if self.number == 1:
            for name in given(self, "spacing_m", *_PITCH):
                raise not_with(name, "with number = 1")
        if self.rake_deg and self.length_m is None:
            raise ValueError("needs length_m for strips with rake_deg")
        if self.rake_deg and self.pitch_inertia_kg_m2 is not None:
            raise not_with(
                "rake_deg",
                "with pitch_inertia_kg_m2, whose lever arms are those of strips that are square to "
                "the track",
            )
        together(self, *_SUSPENSION)
        together(self, *_PITCH)
        if self.damping_N_s_per_m > 0 and self.mass_kg is None:
            raise not_with(
                "damping_N_s_per_m",
                "without mass_kg and stiffness_N_per_m, because it acts between a strip and the "
                "head",
            )
        return self

    @property
    def mass(self) -> float:
        """Mass of all strips that have springs of their own [kg]."""
        return 0.0 if self.mass_kg is None else self.number * self.mass_kg

    @property
    def ahead(self) -> float:
        """Largest distance of strips from the head's middle, along the track [m]."""
        raked = math.tan(math.radians(abs(self.rake_deg))) * (self.length_m or 0.0)
        return 0.5 * ((self.spacing_m or 0.0) + raked)


class RollTable(Table):
    """A lumped head that rolls on two springs beside each other."""

    inertia_kg_m2: float = Field(
        ge=LEAST_INERTIA, le=1000, description="of the head, about the track"
    )
    spring_distance_m: float = Field(
        gt=0, le=3, description="across the track, between the springs below the head"
    )


def strips_of(table: StripsTable, spring: float = 0.0, damper: float = 0.0) -> Strips:
    """Strips of a head whose own spring [N/m] and damper [N s/m] also hold its pitch."""
    suspension = pitch = None
    if table.mass_kg is not None and table.stiffness_N_per_m is not None:
        suspension = Suspension(table.mass_kg, table.stiffness_N_per_m, table.damping_N_s_per_m)
    inertia, distance = table.pitch_inertia_kg_m2, table.pitch_spring_distance_m
    if inertia is not None and distance is not None:
        pitch = turning_of(inertia, distance, spring, damper)
    flexure = None
    if table.flexure is not None:
        own = table.flexure
        flexure = Flexure(
            own.bending_stiffness_N_m2, own.spring_distance_m, own.modes, own.damping_ratio
        )
    spacing = table.spacing_m or 0.0
    rake = math.radians(table.rake_deg)
    length = table.length_m
    return Strips(table.number, spacing, length, suspension, pitch, flexure=flexure, rake=rake)


def turning_of(inertia: float, distance: float, spring: float, damper: float) -> Turning:
    """Roll of a head whose spring and damper act in two halves at a lateral ``distance`` [m].

    ``inertia`` about the roll axis [kg m2], ``spring`` [N/m] and ``damper`` [N s/m] of both halves
    together.
    """
    square = (0.5 * distance) ** 2
    return Turning(inertia, spring * square, damper * square)
