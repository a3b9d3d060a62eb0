"""From a scene's irregularities and defects to those of the line, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from catenary.cases.scene.tables.line.imperfections.defects import (
    Defect,
    HardSpotTable,
    KinkTable,
    LooseClampTable,
    MissingDropperTable,
    WornWireTable,
    WrongTensionTable,
)
from catenary.cases.scene.tables.line.imperfections.irregularities import (
    HeightTable,
    IrregularitiesTable,
    LengthsTable,
)
from catenary.cases.scene.tables.units import angle_from_deg, length_from_mm
from catenary.meshgen.line import Line
from catenary.solver.problem import defects as solver
from catenary.solver.problem.irregularities import (
    Heights,
    HeightSpectrum,
    Irregularities,
    LengthErrors,
)

if TYPE_CHECKING:
    from catenary.solver.problem.defects import Defect as SolverDefect


def defects_of(tables: Sequence[Defect], line: Line) -> tuple[SolverDefect, ...]:
    """What is wrong with a line."""
    return tuple(_defect(table, line) for table in tables)


def _defect(table: Defect, line: Line) -> SolverDefect:
    match table:
        case MissingDropperTable():
            return solver.MissingDropper(place_of(line, table.span, table.dropper))
        case LooseClampTable():
            return solver.LooseClamp(place_of(line, table.span, table.dropper))
        case WornWireTable():
            return solver.WornWire(table.wire, table.from_m, table.to_m, table.lost_share)
        case WrongTensionTable():
            return solver.WrongTension(table.wire, table.factor)
        case HardSpotTable():
            return solver.HardSpot(table.wire, table.at_m, table.mass_kg, table.stiffness_N_per_m)
        case KinkTable():
            return solver.Kink(table.wire, table.at_m, angle_from_deg(table.angle_deg))


def place_of(line: Line, span: int, dropper: int) -> float:
    """Where a dropper stands, by the number of its span and its own there, from 1 [m]."""
    return float(line.droppers_of_span(span - 1)[dropper - 1])


def irregularities_of(table: IrregularitiesTable, line: Line) -> Irregularities:
    """What is irregular about a line."""
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
        (place_of(line, int(span), int(dropper)), length_from_mm(error))
        for span, dropper, error in table.by_dropper or ()
    )
    deviation = length_from_mm(table.standard_deviation_mm)
    return LengthErrors(deviation, table.cut_off, table.seed, given)
