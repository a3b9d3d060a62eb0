"""Contact between head and wire: table, and conversion to SI."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from catenary.cases.scene.keys.table import Table, not_with, take_away
from catenary.solver.problem.contact_laws import (
    HYSTERESIS,
    ContactLaw,
    HertzLaw,
    KinematicLaw,
    LinearLaw,
)

Law = Literal[
    "linear", "hertz", "lankarani_nikravesh", "hunt_crossley", "flores", "gonthier", "kinematic"
]
WITH_RESTITUTION = ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")
HERTZ = ("hertz", *WITH_RESTITUTION)
# Keys by the laws with which they act; the law itself acts always.
_ACTS_WITH: dict[str, tuple[str, ...]] = {
    "stiffness_N_per_m": ("linear", *HERTZ),
    "damping_N_s_per_m": ("linear",),
    "hertz_stiffness_N_per_m1_5": HERTZ,
    "restitution": WITH_RESTITUTION,
    "least_impact_speed_m_per_s": WITH_RESTITUTION,
}


class ContactTable(Table):
    """Contact between head and wire: penalty laws, or none that gives way."""

    law: Law = Field(
        "linear",
        description="a spring (and damper); Hertz's spring of power 1.5, alone or with the "
        "hysteresis of a law of impact; or kinematic: no gap and no depth",
    )
    stiffness_N_per_m: float = Field(
        5e4,
        gt=0,
        le=1e9,
        description="penalty stiffness; with Hertz's spring its secant at the leading "
        "pantograph's static force",
    )
    damping_N_s_per_m: float = Field(
        0.0, ge=0, le=1e6, description="damping, acts with effects.contact_damping"
    )
    hertz_stiffness_N_per_m1_5: float | None = Field(
        None, gt=0, le=1e15, description="Hertz's K itself, in place of stiffness_N_per_m"
    )
    restitution: float | None = Field(
        None,
        ge=0.05,
        le=1,
        description="coefficient of restitution, acts with effects.contact_damping",
    )
    least_impact_speed_m_per_s: float = Field(
        0.1,
        ge=1e-3,
        le=10,
        description="least speed of impact that the law uses, where contact is made more slowly",
    )

    @model_validator(mode="after")
    def _consistent(self) -> ContactTable:
        for key, laws in _ACTS_WITH.items():
            if key in self.model_fields_set and self.law not in laws:
                raise not_with(key, f"with law {self.law}, with which it does not act")
        if self.law in WITH_RESTITUTION and self.restitution is None:
            raise ValueError(f"must give restitution, which law {self.law} is made of")
        both = {"stiffness_N_per_m", "hertz_stiffness_N_per_m1_5"} & self.model_fields_set
        if len(both) == 2 and self.hertz_stiffness_N_per_m1_5 is not None:
            raise ValueError(
                "must give stiffness_N_per_m or hertz_stiffness_N_per_m1_5, not both" + take_away()
            )
        return self

    @model_serializer(mode="wrap")
    def _acting(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """All keys that act; a table made of them is the same again."""
        plain: dict[str, Any] = handler(self)
        idle = {key for key, laws in _ACTS_WITH.items() if self.law not in laws}
        if self.hertz_stiffness_N_per_m1_5 is not None:
            idle.add("stiffness_N_per_m")
        return {key: value for key, value in plain.items() if key not in idle}


# Hertz's power for two bodies that touch in a point [-].
_EXPONENT = 1.5


def contact_law_of(table: ContactTable, static_force: float) -> ContactLaw:
    """The law of a table.

    ``static_force`` [N] is the force at which Hertz's spring has the secant ``stiffness_N_per_m``.
    """
    if table.law == "kinematic":
        return KinematicLaw()
    if table.law not in HERTZ:
        return LinearLaw(table.stiffness_N_per_m, table.damping_N_s_per_m)
    stiffness = table.hertz_stiffness_N_per_m1_5
    if stiffness is None:
        depth = static_force / table.stiffness_N_per_m
        stiffness = static_force / depth**_EXPONENT
    hysteresis = 0.0
    if table.restitution is not None:
        hysteresis = HYSTERESIS[table.law](table.restitution)
    return HertzLaw(stiffness, _EXPONENT, hysteresis, table.least_impact_speed_m_per_s)
