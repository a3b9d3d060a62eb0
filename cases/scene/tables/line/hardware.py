"""Scene tables of supports and steady arms."""

from __future__ import annotations

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import TAKE_AWAY, Table


class SupportTable(Table):
    """What carries the topmost wire at a mast."""

    stiffness_N_per_m: float = Field(5e5, gt=0, le=1e10, description="vertical stiffness")


class SteadyArmTable(Table):
    """The arm that holds the contact wire sideways at a mast."""

    length_m: float = Field(0.0, ge=0, le=10, description="length from hinge to clamp")
    mass_kg_per_m: float = Field(0.0, ge=0, le=100, description="mass per length")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="clamp on the contact wire")
    stiffness_N_per_m: float = Field(
        0.0, ge=0, le=1e8, description="vertical stiffness at the contact wire"
    )
    stiffness_by_radial_force: bool = Field(
        False,
        description="whether the vertical stiffness is the radial force of the stagger over "
        "length_m, as with lateral motion, in place of stiffness_N_per_m",
    )
    holds_height: bool = Field(
        False,
        description="whether the arm holds the contact wire at its height at rest; otherwise the "
        "wire hangs freely between the droppers next to it",
    )
    inclination_deg: float | None = Field(
        None,
        ge=0,
        le=30,
        description="by how much it rises from the wire to its hinge at rest, with lateral motion; "
        "if absent, what the weight that hangs at the arm makes of it",
    )

    registration_stiffness_N_per_m: float | None = Field(
        None,
        ge=1e3,
        le=1e8,
        description="of the registration arm that holds its hinge, along the steady arm, with "
        "lateral motion; if absent, it does not give",
    )

    uplift_stop_m: float | None = Field(
        None,
        gt=0,
        le=1,
        description="by how much the contact wire may be lifted at the arm before that meets a "
        "stop; if absent, there is none",
    )
    uplift_stop_stiffness_N_per_m: float | None = Field(
        None, ge=1e3, le=1e8, description="stiffness of the stop; if absent, 1e5 N/m"
    )

    @model_validator(mode="after")
    def _one_stop(self) -> SteadyArmTable:
        if self.uplift_stop_stiffness_N_per_m is not None and self.uplift_stop_m is None:
            raise ValueError(
                "has an uplift_stop_stiffness_N_per_m, but no uplift_stop_m; give both, or neither"
            )
        return self

    @model_validator(mode="after")
    def _one_height(self) -> SteadyArmTable:
        if self.holds_height and self.inclination_deg is not None:
            raise ValueError(
                f"takes holds_height or inclination_deg, but both are given{TAKE_AWAY}"
            )
        return self

    @model_validator(mode="after")
    def _has_a_bar(self) -> SteadyArmTable:
        for key in ("inclination_deg", "registration_stiffness_N_per_m"):
            if getattr(self, key) is not None and not self.length_m:
                raise ValueError(f"needs length_m above 0 for {key}")
        return self

    @model_validator(mode="after")
    def _one_stiffness(self) -> SteadyArmTable:
        if self.stiffness_by_radial_force and self.stiffness_N_per_m:
            raise ValueError(
                "takes stiffness_N_per_m or stiffness_by_radial_force, but both are given"
                f"{TAKE_AWAY}"
            )
        if self.stiffness_by_radial_force and not self.length_m:
            raise ValueError("needs length_m above 0 for stiffness_by_radial_force = true")
        return self
