"""Scene tables of defects: what is wrong with a line whose droppers have been cut."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import Table

Place = Annotated[float, Field(ge=0, le=1e7)]
WireName = Annotated[str, Field(min_length=1, max_length=100)]
_WIRE = "name of a wire of the line, such as contact_wire, messenger_wire"


class DropperDefectTable(Table):
    """Which dropper it is."""

    span: int = Field(ge=1, le=20_000, description="number of its span, from 1")
    dropper: int = Field(ge=1, le=200, description="its number in the span, from 1")


class MissingDropperTable(DropperDefectTable):
    """A dropper that is not there."""

    type: Literal["missing_dropper"] = Field(description="kind of defect")


class LooseClampTable(DropperDefectTable):
    """A dropper whose clamp slips: it carries nothing, and what it weighs stays."""

    type: Literal["loose_clamp"] = Field(description="kind of defect")


class WornWireTable(Table):
    """A wire that has lost a part of its section over a stretch, from below."""

    type: Literal["worn_wire"] = Field(description="kind of defect")
    wire: WireName = Field("contact_wire", description=_WIRE)
    from_m: Place = Field(description="where the stretch begins along the line")
    to_m: Place = Field(description="where it ends")
    lost_share: float = Field(gt=0, le=0.5, description="share of the section that is lost")

    @model_validator(mode="after")
    def _consistent(self) -> WornWireTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must have to_m greater than from_m, but they are {self.to_m:g} and "
                f"{self.from_m:g} m"
            )
        return self


class WrongTensionTable(Table):
    """A wire that hangs with another tension than the one that its droppers are cut for."""

    type: Literal["wrong_tension"] = Field(description="kind of defect")
    wire: WireName = Field(description=_WIRE)
    factor: float = Field(ge=0.5, le=2, description="times the tension that it should have")


class HardSpotTable(Table):
    """A lumped mass and a spring at a place of a wire."""

    type: Literal["hard_spot"] = Field(description="kind of defect")
    wire: WireName = Field("contact_wire", description=_WIRE)
    at_m: Place = Field(description="its place along the line")
    mass_kg: float = Field(0.0, ge=0, le=100, description="mass on the wire")
    stiffness_N_per_m: float = Field(
        0.0, ge=0, le=1e7, description="spring to the ground, without force at rest"
    )

    @model_validator(mode="after")
    def _consistent(self) -> HardSpotTable:
        if not self.mass_kg and not self.stiffness_N_per_m:
            raise ValueError("needs mass_kg or stiffness_N_per_m, but none is given")
        return self


class KinkTable(Table):
    """A contact wire that is bent for good, as at a splice."""

    type: Literal["kink"] = Field(description="kind of defect")
    wire: WireName = Field("contact_wire", description="name of a contact wire of the line")
    at_m: Place = Field(description="its place along the line")
    angle_deg: float = Field(
        ge=-10, le=10, description="by which the slope rises there; positive points down"
    )


Defect = Annotated[
    MissingDropperTable
    | LooseClampTable
    | WornWireTable
    | WrongTensionTable
    | HardSpotTable
    | KinkTable,
    Field(discriminator="type"),
]
