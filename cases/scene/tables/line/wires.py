"""Scene tables of the wires of a line."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from catenary.cases.scene.tables.line.droppers import AuxiliaryDropperTable
from catenary.cases.scene.tables.table import Table


class WireTable(Table):
    """A tensioned wire."""

    tension_N: float = Field(gt=0, le=1e6, description="tension")
    mass_kg_per_m: float = Field(gt=0, le=100, description="mass per length")
    bending_stiffness_N_m2: float = Field(ge=0, le=1e6, description="bending stiffness EI")


class AuxiliaryWireTable(WireTable):
    """A wire between messenger and contact wire."""

    height_m: float = Field(
        gt=0, le=10, description="height above the contact wire at the supports"
    )
    dropper: AuxiliaryDropperTable = Field(
        description="droppers from the messenger wire to the auxiliary wire"
    )


class StitchWireTable(WireTable):
    """A wire clamped to the messenger wire on both sides of each inner support."""

    length_m: float = Field(gt=0, le=100, description="length from clamp to clamp")
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


class BridleTable(WireTable):
    """A wire over each inner support, whose ends are clamped to a single contact wire."""

    length_m: float = Field(gt=0, le=100, description="length from clamp to clamp")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each of its two clamps")
    clamp_stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each clamp, in tension and compression"
    )
