"""Supports, steady arms and fittings: tables, and conversion to SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table, WireName, either
from catenary.cases.scene.keys.units import angle_from_deg
from catenary.meshgen.hardware import Fittings, SteadyArm


class SupportTable(Table):
    """Support of the topmost wire at a mast."""

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
        description="inclination from the wire up to its hinge at rest, with lateral motion; if "
        "absent, it follows from the weight that the arm carries",
    )

    registration_stiffness_N_per_m: float | None = Field(
        None,
        ge=1e3,
        le=1e8,
        description="stiffness along the steady arm of the registration arm that holds its hinge, "
        "with lateral motion; rigid if absent",
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
    def _consistent(self) -> SteadyArmTable:
        if self.uplift_stop_stiffness_N_per_m is not None and self.uplift_stop_m is None:
            raise ValueError(
                "has an uplift_stop_stiffness_N_per_m, but no uplift_stop_m; give both, or neither"
            )
        either(self, "holds_height", "inclination_deg")
        either(self, "stiffness_N_per_m", "stiffness_by_radial_force")
        bar = {
            "inclination_deg": self.inclination_deg is not None,
            "registration_stiffness_N_per_m": self.registration_stiffness_N_per_m is not None,
            "stiffness_by_radial_force = true": self.stiffness_by_radial_force,
        }
        for key, given in bar.items():
            if given and not self.length_m:
                raise ValueError(f"needs length_m above 0 for {key}")
        return self


class FittingTable(Table):
    """A fitting as a lumped mass, which droppers are cut for."""

    kind: Literal["section_insulator", "neutral_section", "splice", "mid_point_anchor"] = Field(
        description="its kind, for reports"
    )
    wire: WireName = Field(
        "contact_wire",
        description="name of a wire of the line, such as contact_wire, messenger_wire",
    )
    at_m: float = Field(ge=0, le=1e7, description="its place, or its begin, along the line")
    length_m: float = Field(
        0.0, ge=0, le=200, description="its length; half of its mass is at either end"
    )
    mass_kg: float = Field(gt=0, le=200, description="its mass")


# Of a stop above a steady arm whose stiffness no scene gives [N/m].
_STOP_STIFFNESS = 1e5


def steady_arm(table: SteadyArmTable) -> SteadyArm:
    """A steady arm."""
    tilt = table.inclination_deg
    return SteadyArm(
        length=table.length_m,
        mass_per_length=table.mass_kg_per_m,
        clamp_mass=table.clamp_kg,
        stiffness=table.stiffness_N_per_m,
        holds_height=table.holds_height,
        inclination=None if tilt is None else angle_from_deg(tilt),
        uplift_stop=table.uplift_stop_m,
        stop_stiffness=table.uplift_stop_stiffness_N_per_m or _STOP_STIFFNESS,
        by_radial_force=table.stiffness_by_radial_force,
        registration_stiffness=table.registration_stiffness_N_per_m,
    )


def fittings_of(tables: Sequence[FittingTable]) -> tuple[Fittings, ...]:
    """Fittings by kind and wire; what has a length is two masses."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for one in tables:
        ends = (one.at_m, one.at_m + one.length_m) if one.length_m else (one.at_m,)
        group = found.setdefault((one.kind, one.wire), [])
        group += [(x, one.mass_kg / len(ends)) for x in ends]
    return tuple(
        Fittings(kind, wire, *zip(*sorted(group), strict=True))
        for (kind, wire), group in found.items()
    )
