"""Units of scene keys, the conversions to SI, and usual values, which show a wrong unit.

A suffix stands for a unit. Of usual values there are words for somebody who sets up a line, and
ranges.
"""

from __future__ import annotations

import math
from typing import NamedTuple

# One table gives each key its unit. Longest suffix first, so that "_kg_per_m" is not read as "_m".
SUFFIXES: dict[str, str] = {
    "_N_s2_per_m2": "N s2/m2",
    "_kg_per_m3": "kg/m3",
    "_N_per_m1_5": "N/m^1.5",
    "_N_s_per_m": "N s/m",
    "_mm_per_s": "mm/s",
    "_um_per_m": "um/m",
    "_percent": "%",
    "_m_per_s": "m/s",
    "_kg_per_m": "kg/m",
    "_N_per_m": "N/m",
    "_kg_m2": "kg m2",
    "_N_m2": "N m2",
    "_deg": "deg",
    "_km_h": "km/h",
    "_hz": "Hz",
    "_per_s": "1/s",
    "_per_K": "1/K",
    "_GPa": "GPa",
    "_mm2": "mm2",
    "_mm": "mm",
    "_kg": "kg",
    "_m": "m",
    "_N": "N",
    "_s": "s",
    "_K": "K",
}


def unit_of(key: str) -> str:
    """Unit that the last part of a dotted key names, "" where it names none."""
    name = next((part for part in reversed(key.split(".")) if not part.isdigit()), "")
    return next((unit for suffix, unit in SUFFIXES.items() if name.endswith(suffix)), "")


def without_unit(name: str) -> str:
    """A key's last part without the unit at its end."""
    return next((name.removesuffix(end) for end in SUFFIXES if name.endswith(end)), name)


def speed_from_km_h(speed: float) -> float:
    """Speed [m/s] from ``speed`` [km/h]."""
    return speed / 3.6


def angle_from_deg(angle: float) -> float:
    """Angle [rad] from ``angle`` [deg]."""
    return math.radians(angle)


def length_from_mm(length: float) -> float:
    """Length [m] from ``length`` [mm]."""
    return length / 1000.0


def area_from_mm2(area: float) -> float:
    """Area [m2] from ``area`` [mm2]."""
    return area * 1e-6


def pressure_from_GPa(pressure: float) -> float:
    """Pressure [N/m2] from ``pressure`` [GPa]."""
    return pressure * 1e9


class Usual(NamedTuple):
    """Usual values of a key, in the unit of the key.

    Attributes
    ----------
    words : typical values; a figure of a formula or of a shipped case names it. "" where the key
        has a default
    least, most : range in lines and pantographs of railways, zero is always allowed; of a list
        each number is meant. A number beyond the range by more than a factor of ten that would lie
        inside in a unit a thousand times larger or smaller is taken for a slip. None where words
        say it
    """

    words: str = ""
    least: float | None = None
    most: float = 0.0


# By key; a * stands for a name that the scene chooses, or a place in a list.
USUAL: dict[str, Usual] = {
    "line.n_spans": Usual(
        "12 to 30: the evaluated spans, and on either side enough for no reflection"
    ),
    "line.span_m": Usual("40 to 65, of tramways 25 to 40", 20, 80),
    "line.encumbrance_m": Usual("1.2 to 1.8", 0.3, 3),
    "line.contact_height_m": Usual("", 4, 7),
    "line.stagger_m": Usual("", 0.05, 0.6),
    "line.messenger_stagger_m": Usual("", 0.05, 0.6),
    "line.contact_wire.tension_N": Usual("10000 to 20000, high speed 20000 to 31500", 5e3, 4e4),
    "line.contact_wire.mass_kg_per_m": Usual(
        "copper of 107 mm2 0.95, 120 mm2 1.07, 150 mm2 1.33", 0.5, 2
    ),
    "line.contact_wire.bending_stiffness_N_m2": Usual(
        "E A^2 / (4 pi) of a round copper wire: 107 mm2 110, 120 mm2 140, 150 mm2 215", 30, 600
    ),
    "line.contact_wire.diameter_mm": Usual("14.4 (150 mm2), 12.9 (120 mm2)", 5, 40),
    "line.messenger_wire.tension_N": Usual("10000 to 20000, high speed up to 28000", 3e3, 4e4),
    "line.messenger_wire.mass_kg_per_m": Usual("bronze strand of 65 mm2 0.6, 120 mm2 1.07", 0.3, 3),
    "line.messenger_wire.bending_stiffness_N_m2": Usual(
        "45 (65 mm2) to 130 (120 mm2); a strand has less than a solid wire"
    ),
    "line.messenger_wire.diameter_mm": Usual("14 (117 mm2), 10.5 (70 mm2), 9 (50 mm2)", 5, 40),
    "line.auxiliary_wire.tension_N": Usual("9800 to 14700 (Shinkansen)", 3e3, 4e4),
    "line.auxiliary_wire.mass_kg_per_m": Usual("copper of 150 mm2 1.375", 0.3, 3),
    "line.auxiliary_wire.bending_stiffness_N_m2": Usual(
        "a solid wire of 150 mm2 215, a strand less"
    ),
    "line.auxiliary_wire.height_m": Usual("0.2 to 0.6", 0.1, 2),
    "line.stitch_wire.tension_N": Usual("2000 to 5000, mostly 2800 to 3500", 1e3, 6e3),
    "line.stitch_wire.mass_kg_per_m": Usual("bronze strand of 35 mm2 0.31", 0.1, 1),
    "line.stitch_wire.bending_stiffness_N_m2": Usual(
        "2 to 11 (35 mm2); a strand has less than a wire"
    ),
    "line.stitch_wire.length_m": Usual("12 to 22, mostly 18", 5, 30),
    "line.wires.*.name": Usual("contact_wire, messenger_wire"),
    "line.wires.*.role": Usual("contact"),
    "line.wires.*.tension_N": Usual("contact wires 10000 to 31500, others 2000 to 28000", 1e3, 4e4),
    "line.wires.*.mass_kg_per_m": Usual(
        "copper of 107 mm2 0.95, 120 mm2 1.07, 150 mm2 1.33", 0.1, 3
    ),
    "line.wires.*.bending_stiffness_N_m2": Usual("a solid wire of 150 mm2 215, of 107 mm2 110"),
    "line.wires.*.height_m": Usual("", 4, 9),
    "line.wires.*.stagger_m": Usual("", 0.05, 0.6),
    "line.links.*.name": Usual("droppers, supports, steady_arms"),
    "line.links.*.upper": Usual("messenger_wire"),
    "line.links.*.lower": Usual("contact_wire"),
    "line.links.*.wire": Usual("messenger_wire for supports, contact_wire for steady_arms"),
    "line.links.*.at_m": Usual("where the two wires meet"),
    "line.links.*.positions_m": Usual("", 1, 80),
    "line.links.*.pre_sag_mm": Usual("", 5, 150),
    "line.links.*.pre_sag_mid_mm": Usual("", 5, 150),
    "line.damping.per_component.*.alpha_s": Usual("", 1e-5, 0.03),
    "line.twin.spacing_m": Usual("0.04 to 0.1", 0.02, 0.5),
    "line.bridle.tension_N": Usual("1000 to 3000", 500, 6e3),
    "line.bridle.mass_kg_per_m": Usual("bronze strand of 35 mm2 0.31", 0.1, 1),
    "line.bridle.bending_stiffness_N_m2": Usual("2 to 11 (35 mm2)"),
    "line.bridle.length_m": Usual("4 to 12", 2, 20),
    "line.overlap.first_span": Usual(
        "where a tension section ends, 1200 to 1500 m from the last one"
    ),
    "line.overlap.rise_m": Usual("0.6 over two spans: 0.15 at the next mast", 0.2, 2),
    "line.overlap.distance_m": Usual("", 0.2, 0.5),
    "wind.roughness_length_m": Usual("0.003 (sea), 0.05 (open country), 0.3 (suburbs)"),
    "wind.gusts.turbulence_intensity": Usual("0.1 to 0.25"),
    "wind.gusts.decay": Usual("7 to 16"),
    "line.curve.radius_m": Usual(
        "3000 to 7000 at 200 to 300 km/h, 300 and less on tramways", 150, 2e4
    ),
    "line.curve.cant_mm": Usual("", 10, 200),
    "line.tunnels.*.from_m": Usual("where the train enters it"),
    "line.tunnels.*.to_m": Usual("where the train leaves it"),
    "line.tunnels.*.force_factor": Usual("1.2 to 2, by the tunnel's cross-section (assumed)"),
    "line.dropper.stiffness_N_per_m": Usual("100000 (EN 50318)", 1e4, 1e6),
    "line.dropper.axial_stiffness_N": Usual("1.2e6 (bronze rope of 12 mm2 at 100 GPa)", 1e4, 1e7),
    "line.dropper.count": Usual("5 to 9"),
    "line.dropper.spacing_m": Usual("4 to 10", 2, 20),
    "line.dropper.pre_sag_mid_mm": Usual("0 to 1/1000 of the span, 55 for 55 m", 5, 150),
    "line.dropper.positions_m": Usual("", 1, 80),
    "line.dropper.pre_sag_mm": Usual("", 5, 150),
    "line.steady_arm.length_m": Usual("1 to 1.3", 0.3, 3),
    "line.steady_arm.mass_kg_per_m": Usual("", 0.2, 3),
    "line.steady_arm.clamp_kg": Usual("", 0.05, 2),
    "line.steady_arm.stiffness_N_per_m": Usual("", 50, 2e3),
    "line.fittings.*.kind": Usual("section_insulator"),
    "line.fittings.*.at_m": Usual("in the middle of a span, between droppers"),
    "line.fittings.*.mass_kg": Usual("section insulators 6 to 20, splices 0.5 to 1.5", 0.2, 50),
    "line.damping.alpha_s": Usual(
        "0.0001 (en50318_2002, ac_simple); 0.0275 and 0.00275 (Ambrosio et al., 2012)",
        1e-5,
        0.03,
    ),
    "line.damping.beta_per_s": Usual("0.0125 (en50318_2002, ac_simple); 0 (Ambrosio et al., 2012)"),
    "line.damping.lateral.alpha_s": Usual("0 (assumed; none was measured)", 1e-5, 0.03),
    "line.damping.lateral.beta_per_s": Usual(
        "0.003 (wires alone) to 0.9 (a ratio of 0.05 at 1.4 Hz, as measured on vertical motion)"
    ),
    "pantographs.*.static_force_N": Usual(
        "AC 60 to 90, DC 3 kV 90 to 120, DC 1.5 kV 70 to 140", 30, 300
    ),
    "pantographs.*.masses_kg": Usual(
        "two masses [7.2, 15] (EN 50318); head 5 to 10, frame 10 to 20", 1, 100
    ),
    "pantographs.*.stiffnesses_N_per_m": Usual("[4200, 50] for two masses (EN 50318)"),
    "pantographs.*.dampings_N_s_per_m": Usual("[10, 90] for two masses (EN 50318)"),
    "pantographs.*.nominal_height_m": Usual("", 4, 7),
    "pantographs.*.strips.length_m": Usual("0.8 to 1.2", 0.4, 2.2),
    "pantographs.*.strips.spacing_m": Usual("", 0.2, 1.5),
    "pantographs.*.strips.flexure.bending_stiffness_N_m2": Usual(
        "of a carbon strip on its holder some hundreds to some thousands"
    ),
    "train.speed_km_h": Usual("below 0.7 of the contact wire's wave speed"),
    "train.start_m": Usual("two spans after the start of the line"),
    "evaluation.from_m": Usual("after the run-in, where a span begins"),
    "evaluation.to_m": Usual("whole spans after evaluation.from_m"),
    "contact.restitution": Usual("0.1 to 0.9"),
    "contact.stiffness_N_per_m": Usual("", 5e3, 1e7),
    "numerics.spectral_radius": Usual("0.8 to 0.9"),
    "numerics.adaptive_tolerance_N": Usual("0.1 to 10"),
    "numerics.dt_s": Usual("", 1e-05, 0.005),
    "line.auxiliary_wire.dropper.stiffness_N_per_m": Usual("", 1e4, 1e6),
    "line.support.stiffness_N_per_m": Usual("", 1e4, 1e7),
    "line.transition.span_m": Usual("", 20, 80),
    "line.transition.rise_m": Usual("", 0.1, 2),
    "irregularities.contact_wire_height.standard_deviation_mm": Usual("", 1, 50),
    "irregularities.dropper_lengths.standard_deviation_mm": Usual("", 1, 50),
}
_WIRES = ("contact_wire", "messenger_wire", "auxiliary_wire", "stitch_wire", "bridle", "wires.*")
USUAL |= {f"line.{wire}.axial_stiffness_N": Usual("", 1e6, 1e8) for wire in _WIRES}
USUAL |= {f"line.{wire}.diameter_mm": Usual("", 5, 40) for wire in _WIRES[2:]}
_CLAMPED = ("line.stitch_wire", "line.bridle", "line.wires.*")
USUAL |= {f"{wire}.clamp_kg": Usual("", 0.05, 2) for wire in _CLAMPED}
_DROPPERS = ("line.dropper", "line.auxiliary_wire.dropper", "line.links.*")
USUAL |= {f"{one}.messenger_clamp_kg": Usual("", 0.02, 2) for one in _DROPPERS}
USUAL |= {f"{one}.mass_kg_per_m": Usual("", 0.02, 2) for one in _DROPPERS}
USUAL |= {
    "line.dropper.contact_clamp_kg": Usual("", 0.02, 2),
    "line.auxiliary_wire.dropper.auxiliary_clamp_kg": Usual("", 0.02, 2),
    "line.links.*.contact_clamp_kg": Usual("", 0.02, 2),
}
_SIGNED = ("stagger_m", "messenger_stagger_m", "pre_sag")
_MARGIN = 10.0  # beyond a usual range without a question
# Probable units of a number that is a thousand times too small, or too large.
_LARGER = {"N": "kN", "N/m": "kN/m", "mm": "m", "N m2": "kN m2"}
_SMALLER = {"m": "mm", "kg": "g", "kg/m": "g/m", "s": "ms"}


def usual_range(key: str) -> tuple[float, float] | None:
    """The usual range of a dotted key, None if none is declared."""
    parts = key.split(".")
    while parts[-1].isdigit():  # one number of a list
        parts.pop()
    named = len(parts) > 2 and parts[0] == "pantographs"
    pattern = ["*" if one.isdigit() or (named and i == 1) else one for i, one in enumerate(parts)]
    usual = USUAL.get(".".join(pattern))
    return None if usual is None or usual.least is None else (usual.least, usual.most)


def unit_guess(key: str, value: float) -> str:
    """The sentence on a number whose unit is probably another one, "" for others."""
    usual = usual_range(key)
    # Sideways and below there are negative numbers, of which only the size can be a slip.
    size = abs(value)
    if usual is None or not size or usual[0] / _MARGIN <= size <= usual[1] * _MARGIN:
        return ""
    unit, signed = unit_of(key), any(part.startswith(_SIGNED) for part in key.split("."))
    if value < 0 and not signed:
        return ""
    for others, factor in ((_LARGER, 1e3), (_SMALLER, 1e-3)):
        if unit in others and usual[0] <= size * factor <= usual[1]:
            return (
                f"usual are {usual[0]:.12g} to {usual[1]:.12g} {unit}: is it {value:.12g} "
                f"{others[unit]}? write {value * factor:.12g}"
            )
    return ""
