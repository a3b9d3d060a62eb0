"""Scene tables of fittings on wires: section insulators, neutral sections, splices, anchors."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from catenary.cases.scene.tables.table import Table


class FittingTable(Table):
    """A fitting as a lumped mass, which droppers are cut for."""

    kind: Literal["section_insulator", "neutral_section", "splice", "mid_point_anchor"] = Field(
        description="what it is, for reports"
    )
    wire: str = Field(
        "contact_wire",
        min_length=1,
        max_length=100,
        description="name of a wire of the line, such as contact_wire, messenger_wire",
    )
    at_m: float = Field(ge=0, le=1e7, description="its place, or its begin, along the line")
    length_m: float = Field(
        0.0, ge=0, le=200, description="its length; half of its mass is at either end"
    )
    mass_kg: float = Field(gt=0, le=200, description="its mass")
