"""Wires of a line and their damping, a free line's wires and links: tables, and conversion to SI.

A free line has tables of wires by name, and of links between them and to the ground.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import OneOrMore, Table, WireName, ascending, either, together
from catenary.cases.scene.keys.units import area_from_mm2, length_from_mm, pressure_from_GPa
from catenary.cases.scene.line.hardware import (
    AuxiliaryDropperTable,
    DropperTable,
    SteadyArmTable,
    SupportTable,
    one_pre_sag_each,
)
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


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def _is_name(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise ValueError("must be a name of letters, digits and _ that begins with a letter")
    return text


# Names are those of groups in a mesh file and of components in the damping.
PartName = Annotated[str, Field(min_length=1, max_length=60), AfterValidator(_is_name)]
Place = Annotated[float, Field(ge=0, le=1e7)]
Away = Annotated[float, Field(ge=-500, le=500)]
SupportNumber = Annotated[int, Field(ge=0, le=20_000)]
SpanNumber = Annotated[int, Field(ge=1, le=20_000)]
Height = Annotated[float, Field(gt=0, le=30)]
Sideways = Annotated[float, Field(ge=-5, le=5)]
Stretch = Annotated[list[Place], Field(min_length=2, max_length=2)]
Point = Annotated[list[Annotated[float, Field(ge=-1e7, le=1e7)]], Field(min_length=3, max_length=3)]


class FreeWireTable(WireTable):
    """A wire of a free line: where it runs, at what height, and how it ends."""

    name: PartName = Field(description="its name: letters, digits, _, beginning with a letter")
    role: Literal["contact", "messenger", "auxiliary", "stitch"] = Field(
        description="its role; heads run on all contact wires"
    )
    stretches_m: list[Stretch] | None = Field(
        None,
        min_length=1,
        max_length=20_000,
        description="from and to of each of its pieces along the line; all of the line if absent",
    )
    from_supports_m: Annotated[list[Away], Field(min_length=2, max_length=2)] | None = Field(
        None, description="in place of that, from and to of a piece, measured from each support"
    )
    supports: list[SupportNumber] | None = Field(
        None,
        min_length=1,
        max_length=20_001,
        description="support numbers; 0 is the first support; all inner ones if absent",
    )
    height_m: Annotated[list[Height], OneOrMore, Field(min_length=1, max_length=20_001)] | None = (
        Field(
            None,
            description="height above the rail at the supports, one number or one for each; of a "
            "contact wire line.contact_height_m if absent",
        )
    )
    stagger_m: (
        Annotated[list[Sideways], OneOrMore, Field(min_length=1, max_length=20_001)] | None
    ) = Field(
        None,
        description="lateral position at the supports, alternating, or one for each; if absent "
        "line.stagger_m of contact wires, that of the wire that it is clamped to, or "
        "line.messenger_stagger_m",
    )
    sideways_m: float = Field(0.0, ge=-5, le=5, description="added to all its lateral positions")
    course_m: list[Point] | None = Field(
        None,
        min_length=2,
        max_length=20_000,
        description="in place of height_m and stagger_m, points [along, to the left, height] that "
        "it passes, along the line or, with from_supports_m, from each support",
    )
    start: WireName | None = Field(
        None,
        description="where it starts: tensioner, fixed, or the name of the wire that it is clamped "
        "to; if absent as line.ends says, and fixed inside the line",
    )
    end: WireName | None = Field(None, description="the same of where it ends")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each clamp at its ends")
    clamp_stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each such clamp, in tension and compression"
    )

    @model_validator(mode="after")
    def _consistent(self) -> FreeWireTable:
        either(self, "stretches_m", "from_supports_m")
        if self.supports is not None and self.from_supports_m is None:
            raise ValueError("takes supports with from_supports_m, which is not given")
        either(self, "course_m", "height_m")
        either(self, "course_m", "stagger_m")
        ascending(self.supports or [], "supports")
        ascending([point[0] for point in self.course_m or []], "course_m along the line")
        ascending(self.from_supports_m or [], "from_supports_m")
        ascending([x for stretch in self.stretches_m or [] for x in stretch], "stretches_m")
        return self


class FreeDroppersTable(DropperTable):
    """Droppers from one wire down to another."""

    PLACED_BY: ClassVar[tuple[str, ...]] = ("positions_m", "count", "patterns", "at_m")

    type: Literal["droppers"] = Field(description="kind of link")
    name: PartName = Field(description="name of the group")
    upper: WireName = Field(description="name of the wire above")
    lower: WireName = Field(description="name of the wire below")
    spans: list[SpanNumber] | None = Field(
        None,
        min_length=1,
        max_length=20_000,
        description="numbers of the spans that have them, from 1; all if absent",
    )
    at_m: list[Place] | None = Field(
        None, min_length=1, max_length=100_000, description="places along the line"
    )

    @model_validator(mode="after")
    def _by_place(self) -> FreeDroppersTable:
        if self.at_m is not None:
            ascending(self.at_m, "at_m")
            if self.spans is not None:
                raise ValueError("takes spans with places in a span, not with at_m")
            if self.pre_sag_mid_mm is not None:
                raise ValueError("takes pre_sag_mid_mm with places in a span, not with at_m")
            one_pre_sag_each(self.pre_sag_mm, len(self.at_m))
        ascending(self.spans or [], "spans")
        return self


class FreeClampsTable(Table):
    """Clamps between two wires that meet."""

    type: Literal["clamps"] = Field(description="kind of link")
    name: PartName = Field(description="name of the group")
    upper: WireName = Field(description="name of the wire that carries")
    lower: WireName = Field(description="name of the wire that hangs")
    at_m: list[Place] = Field(min_length=1, max_length=100_000, description="places along the line")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each")
    stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each, in tension and compression"
    )

    @model_validator(mode="after")
    def _in_order(self) -> FreeClampsTable:
        ascending(self.at_m, "at_m")
        return self


class _AtSupports(Table):
    """Keys of supports and of steady arms of one wire."""

    name: PartName = Field(description="name of the group")
    wire: WireName = Field(description="name of the wire")
    supports: list[SupportNumber] | None = Field(
        None,
        min_length=1,
        max_length=20_001,
        description="support numbers; 0 is the first support; if absent all inner ones "
        "that the wire passes",
    )
    at_m: list[Place] | None = Field(
        None, min_length=1, max_length=100_000, description="in place of these, places of the line"
    )

    @model_validator(mode="after")
    def _one_way(self) -> _AtSupports:
        either(self, "supports", "at_m")
        for key in ("supports", "at_m"):
            ascending(getattr(self, key) or [], key)
        return self


class FreeSupportsTable(_AtSupports, SupportTable):
    """Supports of a wire at masts."""

    type: Literal["supports"] = Field(description="kind of link")
    holds: WireName | None = Field(
        None,
        description="name of a wire that is to have its height there at rest; each support is as "
        "high as that takes. If absent, the support is relaxed at the height of its own wire",
    )


class FreeArmsTable(_AtSupports, SteadyArmTable):
    """Steady arms of a wire."""

    type: Literal["steady_arms"] = Field(description="kind of link")


FreeLinkTable = Annotated[
    FreeDroppersTable | FreeClampsTable | FreeSupportsTable | FreeArmsTable,
    Field(discriminator="type"),
]
