"""Wires of a line and their damping: tables, and conversion to SI."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import Table, either, together
from catenary.cases.scene.keys.units import area_from_mm2, length_from_mm, pressure_from_GPa
from catenary.cases.scene.line.droppers import AuxiliaryDropperTable
from catenary.meshgen.topologies.line_data import ClampedWire
from catenary.meshgen.wires import EXPANSION_OF_COPPER, Conductor


class ProportionalDamping(Table):
    """C = alpha K + beta M of one component."""

    alpha_s: float = Field(ge=0, le=10, description="factor on stiffness")
    beta_per_s: float = Field(ge=0, le=100, description="factor on mass")


def _given(value: Any) -> Any:
    """Without components of no damping of their own, which earlier result files name."""
    if not isinstance(value, dict):
        return value
    return {name: own for name, own in value.items() if own is not None}


class DampingTable(ProportionalDamping):
    """C = alpha K + beta M of the whole line."""

    per_component: Annotated[dict[str, ProportionalDamping], BeforeValidator(_given)] = Field(
        default_factory=dict,
        description="damping of single components by name, in place of the line's: a wire or a "
        "group, such as contact_wire, messenger_wire, droppers, steady_arms, supports, or what an "
        "effect adds: arm_stops, tensioners, tensioner_stops_down, tensioner_stops_up",
    )
    lateral: ProportionalDamping | None = Field(
        None,
        description="damping of the wires' motion across the track, in place of that of the line "
        "and of components; acts with effects.lateral_motion",
    )


class WireTable(Table):
    """A tensioned wire."""

    tension_N: float = Field(gt=0, le=1e6, description="tension")
    mass_kg_per_m: float = Field(gt=0, le=100, description="mass per length")
    bending_stiffness_N_m2: float = Field(ge=0, le=1e6, description="bending stiffness EI")
    axial_stiffness_N: float | None = Field(
        None, gt=0, le=1e10, description="axial stiffness EA; acts with effects.axial_motion"
    )
    section_mm2: float | None = Field(
        None, ge=1, le=1e4, description="cross-section, in place of axial_stiffness_N"
    )
    youngs_modulus_GPa: float | None = Field(
        None, ge=1, le=1000, description="Young's modulus, with section_mm2"
    )
    expansion_per_K: float = Field(
        EXPANSION_OF_COPPER,
        ge=0,
        le=1e-3,
        description="thermal expansion; acts with effects.temperature",
    )
    diameter_mm: float | None = Field(
        None, gt=0, le=200, description="diameter that the wind meets; acts with effects.wind"
    )
    drag_coefficient: float = Field(
        1.2, ge=0, le=3, description="drag coefficient; acts with effects.wind"
    )

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        together(self, "section_mm2", "youngs_modulus_GPa")
        either(self, "axial_stiffness_N", "section_mm2")
        return self

    def stiffness_along(self) -> float | None:
        """Axial stiffness EA [N], None where nothing says it."""
        if self.section_mm2 is None or self.youngs_modulus_GPa is None:
            return self.axial_stiffness_N
        return area_from_mm2(self.section_mm2) * pressure_from_GPa(self.youngs_modulus_GPa)


class AuxiliaryWireTable(WireTable):
    """A wire between messenger and contact wire."""

    height_m: float = Field(
        gt=0, le=10, description="height above the contact wire at the supports"
    )
    dropper: AuxiliaryDropperTable = Field(
        description="droppers from the messenger wire to the auxiliary wire"
    )


class ClampedWireTable(WireTable):
    """A wire over each inner support, clamped to another one on both sides of it."""

    length_m: float = Field(ge=0.1, le=100, description="length from clamp to clamp")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each of its two clamps")
    clamp_stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each clamp, in tension and compression"
    )


class TwinTable(Table):
    """Two contact wires in place of one."""

    spacing_m: float = Field(gt=0, le=1, description="distance between the two wires")
    droppers: Literal["pairs", "alternating"] = Field(
        "pairs", description="droppers hang both wires at each place, or the two by turns"
    )


def conductor(table: WireTable) -> Conductor:
    """The conductor of a wire."""
    return Conductor(
        table.tension_N,
        table.mass_kg_per_m,
        table.bending_stiffness_N_m2,
        axial_stiffness=table.stiffness_along(),
        expansion=table.expansion_per_K,
        diameter=None if table.diameter_mm is None else length_from_mm(table.diameter_mm),
        drag_coefficient=table.drag_coefficient,
    )


def clamped_wire_of(table: ClampedWireTable) -> ClampedWire:
    """Stitch wires or bridles."""
    return ClampedWire(
        conductor(table), table.length_m, table.clamp_kg, table.clamp_stiffness_N_per_m
    )
