"""Irregularities and defects of a line: tables, and conversion to SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.keys.table import (
    PAIR,
    StretchTable,
    Table,
    WireName,
    band,
    given,
    not_with,
    within,
)
from catenary.cases.scene.keys.units import angle_from_deg, length_from_mm
from catenary.meshgen.line import Line
from catenary.solver.problem import defects as solver
from catenary.solver.problem.defects import Heights, HeightSpectrum, Irregularities, LengthErrors

if TYPE_CHECKING:
    from catenary.solver.problem.defects import Defect as SolverDefect


# Higher or lower than this no contact wire is hung by mistake [m].
MOST = 0.5
_Course = Annotated[
    list[PAIR], Field(min_length=2, max_length=100_000), AfterValidator(within(MOST))
]  # fmt: skip
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]


class HeightTable(Table):
    """Heights along the track, random, as given, or the sum of both."""

    standard_deviation_mm: float | None = Field(
        None, gt=0, le=100, description="of random heights, those of all wavelengths together"
    )
    exponent: float = Field(
        2.0, ge=0, le=6, description="their spectrum falls with this power of the wave number"
    )
    shortest_m: float = Field(ge=0.05, le=1000, description="shortest wavelength")
    longest_m: float = Field(ge=0.05, le=1000, description="longest wavelength")
    seed: Seed = Field(1, description="another seed gives other heights")
    from_m: float | None = Field(
        None, ge=0, le=1e7, description="where random heights begin; with the running range"
    )
    to_m: float | None = Field(
        None, ge=0, le=1e7, description="where random heights end; with the running range"
    )
    by_place: _Course | None = Field(
        None,
        description="pairs of position along the track [m] and height [m], joined by a cubic "
        "spline; beyond them the height stays",
    )
    by_place_file: str | None = Field(
        None,
        min_length=1,
        description="by_place as a CSV file with columns place_m and height_mm, taken in when it "
        "is read",
    )

    @model_validator(mode="after")
    def _consistent(self) -> HeightTable:
        if self.standard_deviation_mm is None and self.by_place is None:
            raise ValueError("needs standard_deviation_mm or by_place, but none is given")
        band(self.shortest_m, self.longest_m)
        if self.standard_deviation_mm is None:
            for name in given(self, "from_m", "to_m"):
                raise not_with(name, "without standard_deviation_mm")
        return self


class WireHeightTable(HeightTable):
    """Heights of the contact wires where they are held: droppers are cut for them."""

    shortest_m: float = Field(12.0, ge=1, le=1000, description="shortest wavelength")
    longest_m: float = Field(120.0, ge=1, le=1000, description="longest wavelength")


class SurfaceTable(HeightTable):
    """Heights of what the strips run on above the wires' axes, which no dropper sees."""

    shortest_m: float = Field(0.5, ge=0.05, le=1000, description="shortest wavelength")
    longest_m: float = Field(5.0, ge=0.05, le=1000, description="longest wavelength")


class LengthsTable(Table):
    """Errors of the droppers' lengths, positive for droppers that are cut too long."""

    standard_deviation_mm: float = Field(
        0.0, ge=0, le=200, description="of random errors, before they are cut off"
    )
    cut_off: float = Field(
        2.5, ge=0.1, le=6, description="at how many standard deviations errors are cut off"
    )
    seed: Seed = Field(1, description="another seed gives other errors")
    by_dropper: (
        Annotated[
            list[Annotated[list[float], Field(min_length=3, max_length=3)]],
            Field(min_length=1, max_length=100_000),
        ]
        | None
    ) = Field(
        None,
        description="entries [span, number of the dropper in it, error in mm], both counted from "
        "1; on top of random errors",
    )
    by_dropper_file: str | None = Field(
        None,
        min_length=1,
        description="by_dropper as a CSV file with columns span, dropper and error_mm, taken in "
        "when it is read",
    )

    @model_validator(mode="after")
    def _consistent(self) -> LengthsTable:
        if not self.standard_deviation_mm and self.by_dropper is None:
            raise ValueError("needs standard_deviation_mm or by_dropper, but none is given")
        for span, dropper, error in self.by_dropper or []:
            if span != int(span) or dropper != int(dropper) or span < 1 or dropper < 1:
                raise ValueError(
                    "must have entries [span, dropper, error in mm] with whole numbers from 1 on, "
                    f"but has [{span:g}, {dropper:g}, {error:g}]"
                )
            if abs(error) > 1000.0 * MOST:
                raise ValueError(f"must have errors within {1000 * MOST:g} mm, but has {error:g}")
        return self


class IrregularitiesTable(Table):
    """Irregularities of the line from the start; each entry is an effect of its name."""

    contact_wire_height: WireHeightTable | None = Field(
        None, description="heights that droppers are cut for"
    )
    running_surface: SurfaceTable | None = Field(
        None, description="waviness and wear of what the strips run on"
    )
    dropper_lengths: LengthsTable | None = Field(
        None, description="errors of the droppers' lengths"
    )

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the entries that there are."""
        return tuple(name for name in type(self).model_fields if getattr(self, name) is not None)


Place = Annotated[float, Field(ge=0, le=1e7)]
_WIRE = "name of a wire of the line, such as contact_wire, messenger_wire"


class DropperDefectTable(Table):
    """Defect of a dropper, with its place."""

    span: int = Field(ge=1, le=20_000, description="number of its span, from 1")
    dropper: int = Field(ge=1, le=200, description="its number in the span, from 1")


class MissingDropperTable(DropperDefectTable):
    """A dropper that is not there."""

    type: Literal["missing_dropper"] = Field(description="kind of defect")


class LooseClampTable(DropperDefectTable):
    """A dropper whose clamp slips: it carries nothing, and what it weighs stays."""

    type: Literal["loose_clamp"] = Field(description="kind of defect")


class WornWireTable(StretchTable):
    """A wire that has lost a part of its section over a stretch, from below."""

    type: Literal["worn_wire"] = Field(description="kind of defect")
    wire: WireName = Field("contact_wire", description=_WIRE)
    from_m: Place = Field(description="where the stretch begins along the line")
    to_m: Place = Field(description="where it ends")
    lost_share: float = Field(gt=0, le=0.5, description="share of the section that is lost")


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


def defects_of(tables: Sequence[Defect], line: Line) -> tuple[SolverDefect, ...]:
    """Defects of a line."""
    return tuple(_defect(table, line) for table in tables)


def _defect(table: Defect, line: Line) -> SolverDefect:
    match table:
        case MissingDropperTable():
            return solver.MissingDropper(line.dropper_of_span(table.span, table.dropper))
        case LooseClampTable():
            return solver.LooseClamp(line.dropper_of_span(table.span, table.dropper))
        case WornWireTable():
            return solver.WornWire(table.wire, table.from_m, table.to_m, table.lost_share)
        case WrongTensionTable():
            return solver.WrongTension(table.wire, table.factor)
        case HardSpotTable():
            return solver.HardSpot(table.wire, table.at_m, table.mass_kg, table.stiffness_N_per_m)
        case KinkTable():
            return solver.Kink(table.wire, table.at_m, angle_from_deg(table.angle_deg))


def irregularities_of(table: IrregularitiesTable, line: Line) -> Irregularities:
    """Irregularities of a line."""
    heights, surface = table.contact_wire_height, table.running_surface
    lengths = table.dropper_lengths
    return Irregularities(
        None if heights is None else _heights(heights, line),
        None if surface is None else _heights(surface, line),
        None if lengths is None else _lengths(lengths, line),
    )


def stretch_of(table: HeightTable, line: Line) -> tuple[float, float]:
    """From and to of random heights [m]."""
    first, last = line.running_range
    start = first if table.from_m is None else table.from_m
    return start, last if table.to_m is None else table.to_m


def _heights(table: HeightTable, line: Line) -> Heights:
    spectrum = None
    if table.standard_deviation_mm is not None:
        deviation = length_from_mm(table.standard_deviation_mm)
        band = table.shortest_m, table.longest_m
        spectrum = HeightSpectrum(deviation, table.exponent, *band, table.seed)
    pairs = tuple((at, height) for at, height in table.by_place or ())
    return Heights(stretch_of(table, line), spectrum, pairs)


def _lengths(table: LengthsTable, line: Line) -> LengthErrors:
    given = tuple(
        (line.dropper_of_span(int(span), int(dropper)), length_from_mm(error))
        for span, dropper, error in table.by_dropper or ()
    )
    deviation = length_from_mm(table.standard_deviation_mm)
    return LengthErrors(deviation, table.cut_off, table.seed, given)
