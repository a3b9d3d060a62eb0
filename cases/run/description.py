"""Sentences on what a run simulates: pantographs, irregularities, defects, incidents.

Plan, check, result file, summary and report have them. Of a pantograph they say model, static
force, actuator force and assembly.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from catenary.cases.scene.line.imperfections import (
    Defect,
    HardSpotTable,
    HeightTable,
    KinkTable,
    LengthsTable,
    LooseClampTable,
    MissingDropperTable,
    WornWireTable,
    WrongTensionTable,
    stretch_of,
)
from catenary.cases.scene.run.incidents import (
    DropperBreakTable,
    Incident,
    LoweringTable,
    TensionLossTable,
    at_step,
)
from catenary.cases.scene.scene import Scene
from catenary.mbs.head.strips import Strips
from catenary.mbs.lumped import LumpedData
from catenary.meshgen.line import Line
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.wording import counted, wire_words
from catenary.solver.effects.all_effects import simulated
from catenary.solver.problem.problem import Placement, Problem

if TYPE_CHECKING:
    from catenary.mbs.build import PantographData

_IRREGULARITIES = {
    "contact_wire_height": "droppers are cut for irregular heights of the contact wire",
    "running_surface": "running surface of the contact wire",
    "dropper_lengths": "errors of the droppers' lengths",
}


def description_of(data: PantographData, static_force: float) -> str:
    """A line about a pantograph."""
    if not isinstance(data, LumpedData):
        from catenary.mbs.mechanism.multibody_pantograph import describe

        return describe(data) + _strips_of(data.strips)
    masses = ", ".join(f"{mass:g}" for mass in data.masses)
    noun = "mass" if len(data.masses) == 1 else "masses"
    text = f"lumped: {len(data.masses)} {noun} of {masses} kg; static force {static_force:.1f} N"
    text += _strips_of(data.strips)
    if data.tied:
        change = f"{1e-3 * data.height_stiffness:.3g} N with each mm that its head rises"
        text += f"; tied to its base: its force falls by {change}"
    return text


def _strips_of(strips: Strips) -> str:
    """Words on strips unless there is one, fixed to the head."""
    if strips.number == 1 and strips.suspension is None:
        return ""
    text = "; 1 strip" if strips.number == 1 else f"; 2 strips {strips.spacing:g} m apart"
    if strips.suspension is None:
        return text
    own, flexure = strips.suspension, strips.flexure
    text += f" of {own.mass:g} kg on {own.stiffness:g} N/m"
    if flexure is None:
        return text
    bends = "bends" if strips.number == 1 else "bend"
    return f"{text}, which {bends} in {counted(flexure.n_modes, 'mode')}"


def _description(placement: Placement, problem: Problem) -> str:
    """A line about a pantograph under way."""
    data, acts = placement.data, simulated(problem)
    if not acts.flexible_strips:
        data = replace(data, strips=replace(data.strips, flexure=None))
    if not acts.pantograph_laws:
        data = replace(data, laws=())
    text = description_of(data, placement.static_force)
    if acts.raked_strips and placement.data.strips.rake:
        text += f"; strips raked by {math.degrees(placement.data.strips.rake):.3g} degrees"
    if acts.pantograph_laws and placement.data.laws:
        n = len(placement.data.laws)
        text += f"; {counted(n, 'law')} not linear"
    if acts.regulated_lift and placement.regulator is not None:
        text += "; regulated lift"
    if not (acts.meets_air and placement.data.meets_air):
        return text
    from catenary.mbs.build import steady_forces

    lifted = steady_forces(placement.data, problem.train.speed).whole
    text += f"; {lifted:+.1f} N by the air at {3.6 * problem.train.speed:.4g} km/h"
    if acts.wind is None:
        return text
    factor = placement.data.crosswind_factor
    if factor == 0.0:
        return f"{text}; a cross wind does not change it (crosswind_factor 0)"
    return (
        f"{text}; {factor:g} of the square of a cross wind adds to that of the air's speed "
        "(crosswind_factor)"
    )


def header_words(scene: Scene, problem: Problem) -> list[dict[str, str]]:
    """Facts on each pantograph for a result file, in running order. Not collective."""
    return [
        {
            "kind": place.name,
            "model": "lumped" if isinstance(placement.data, LumpedData) else "multibody",
            "description": _description(placement, problem),
        }
        for place, placement in zip(scene.train.pantographs, problem.train.placements, strict=True)
    ]


def kind_lines(scene: Scene, problem: Problem) -> dict[str, list[str]]:
    """Lines about each kind of pantograph on the train, by its name. Not collective."""
    lines: dict[str, list[str]] = {}
    for place, placement in zip(scene.train.pantographs, problem.train.placements, strict=True):
        lines[place.name] = [_description(placement, problem)]
        if not isinstance(placement.data, LumpedData):
            from catenary.mbs.mechanism.multibody_pantograph import describe_assembly, stand

            lines[place.name].append(describe_assembly(stand(placement.data).missed))
    return lines


def defect_facts(scene: Scene, problem: Problem) -> list[dict[str, Any]]:
    """Type, place [m] and wire if it has one, and a sentence of each irregularity and so on.

    Of all that is simulated, in the order of irregularities, fittings, defects. Not collective.
    """
    line = problem.line
    found: list[dict[str, Any]] = []
    for name in scene.irregularities.given:
        if name in problem.effects:
            table = getattr(scene.irregularities, name)
            sentence = _lengths(table) if isinstance(table, LengthsTable) else _heights(table, line)
            found.append({"type": name, "says": f"{_IRREGULARITIES[name]}: {sentence}"})
    for fitting in scene.line.fittings if "fittings" in problem.effects else []:
        over = f" over {fitting.length_m:g} m" if fitting.length_m else ""
        sentence = f"{fitting.kind.replace('_', ' ')} of {fitting.mass_kg:g} kg{over} on the "
        sentence += f"{wire_words(fitting.wire)} at {fitting.at_m:g} m"
        place = {"at_m": fitting.at_m, "wire": fitting.wire}
        found.append({"type": fitting.kind, **place, "says": sentence})
    for defect in scene.defects:
        if defect.type in problem.effects:
            found.append({"type": defect.type, **_defect(defect, line)})
    return found


def _heights(table: HeightTable, line: Line) -> str:
    parts = []
    if table.standard_deviation_mm is not None:
        start, end = stretch_of(table, line)
        parts.append(
            f"standard deviation {table.standard_deviation_mm:g} mm, waves of {table.shortest_m:g} "
            f"to {table.longest_m:g} m, spectrum falling with the power {table.exponent:g} of the "
            f"wave number, from {start:g} to {end:g} m, seed {table.seed}"
        )
    if table.by_place is not None:
        heights = [1e3 * height for _, height in table.by_place]
        at = counted(len(heights), "place")
        parts.append(f"{min(heights):g} to {max(heights):g} mm at {at} of a table")
    return "; ".join(parts)


def _lengths(table: LengthsTable) -> str:
    parts = []
    if table.standard_deviation_mm:
        parts.append(
            f"standard deviation {table.standard_deviation_mm:g} mm, cut off at {table.cut_off:g} "
            f"times that, seed {table.seed}"
        )
    if table.by_dropper is not None:
        parts.append(f"given for {counted(len(table.by_dropper), 'dropper')}")
    return "; ".join(parts)


def _defect(table: Defect, line: Line) -> dict[str, Any]:
    match table:
        case MissingDropperTable() | LooseClampTable():
            at, which = _dropper_of_span(line, table.span, table.dropper)
            missing = isinstance(table, MissingDropperTable)
            what = "is missing" if missing else "has a loose clamp and carries nothing"
            wire = line.wires_of(Role.CONTACT)[0].name
            return {**at, "wire": wire, "says": f"{which}, {what}"}
        case WornWireTable():
            lost = f"has lost {100 * table.lost_share:g} % of its section"
            where = f"from {table.from_m:g} to {table.to_m:g} m"
            place = {"at_m": table.from_m, "wire": table.wire}
            return {**place, "says": f"the {wire_words(table.wire)} {lost} {where}"}
        case WrongTensionTable():
            tension = table.factor * line.wire(table.wire).tension / 1e3
            hangs = (
                f"hangs with {tension:.4g} kN, {table.factor:g} of what its droppers are cut for"
            )
            return {"says": f"the {wire_words(table.wire)} {hangs}"}
        case HardSpotTable():
            parts = [f"{table.mass_kg:g} kg"] * bool(table.mass_kg)
            parts += [f"{table.stiffness_N_per_m:g} N/m"] * bool(table.stiffness_N_per_m)
            where = f"on the {wire_words(table.wire)} at {table.at_m:g} m"
            place = {"at_m": table.at_m, "wire": table.wire}
            return {**place, "says": f"hard spot of {' and '.join(parts)} {where}"}
        case KinkTable():
            where = f"of the {wire_words(table.wire)} at {table.at_m:g} m"
            place = {"at_m": table.at_m, "wire": table.wire}
            return {**place, "says": f"kink of {table.angle_deg:g} degrees {where}"}


def incident_facts(scene: Scene, problem: Problem) -> list[dict[str, Any]]:
    """Type, time [s] and a sentence of each incident that is simulated, in order of time; of a
    dropper its place [m].

    Not collective.
    """
    found = [
        {
            "type": table.type,
            "time_s": at_step(table.at_s, problem.numerics.dt),
            **_incident(table, problem),
        }
        for table in scene.incidents
        if table.type in problem.effects
    ]
    return sorted(found, key=lambda fact: float(fact["time_s"]))


def _dropper_of_span(line: Line, span: int, number: int) -> tuple[dict[str, float], str]:
    """Place of a dropper [m] and which it is of those there, and both in words."""
    x, nth = line.dropper_of_span(span, number)
    return {"at_m": x, "nth": nth}, f"dropper {number} of span {span}, at {x:g} m"


def _incident(table: Incident, problem: Problem) -> dict[str, Any]:
    match table:
        case DropperBreakTable():
            at, which = _dropper_of_span(problem.line, table.span, table.dropper)
            return {**at, "says": f"{which}, breaks"}
        case TensionLossTable():
            left = f"{table.share * problem.line.wire(table.wire).tension / 1e3:.4g} kN"
            falls = f"falls to {left}, {table.share:g} of what it was"
            return {"says": f"the tension of the {wire_words(table.wire)} {falls}"}
        case LoweringTable():
            says = f"pantograph {table.pantograph} is lowered: its static force goes over to "
            says += f"{table.force_N:g} N within {table.within_s:g} s; {_fall(table, problem)}"
            return {"says": says}


def _fall(table: LoweringTable, problem: Problem) -> str:
    """What becomes of a head that is lowered, by the forces at rest."""
    from catenary.mbs.build import steady_forces

    placement = problem.train.placements[table.pantograph - 1]
    data, force = placement.data, table.force_N
    if simulated(problem).meets_air and data.meets_air:
        force += steady_forces(data, problem.train.speed).whole
    if force >= 0.0:
        return f"the air lifts it with {force - table.force_N:.4g} N, so that it stays up"
    if isinstance(data, LumpedData) and -force < data.stiffnesses[-1] * table.drop_m:
        return f"its base spring holds its head at rest less than {table.drop_m:g} m lower"
    return f"its head is caught {table.drop_m:g} m lower"
