"""Usual values of keys: words for somebody who sets up a line, ranges that show a wrong unit.

A range holds what lines and pantographs of railways have. A number beyond it by more than a factor
of ten that would lie inside in a unit a thousand times larger or smaller is taken for a slip.
"""

from __future__ import annotations

from catenary.cases.scene.keys.units import unit_of

# By key; a * stands for a name that the scene chooses. Values are in the key's unit.
TYPICAL: dict[str, str] = {
    "line.n_spans": "12 to 30: the evaluated spans, and on either side enough for no reflection",
    "line.span_m": "40 to 65",
    "line.encumbrance_m": "1.2 to 1.8",
    "line.contact_wire.tension_N": "10000 to 20000, high speed 20000 to 31500",
    "line.contact_wire.mass_kg_per_m": "copper of 107 mm2 0.95, 120 mm2 1.07, 150 mm2 1.33",
    "line.contact_wire.bending_stiffness_N_m2": (
        "E A^2 / (4 pi) of a round copper wire: 107 mm2 110, 120 mm2 140, 150 mm2 215"
    ),
    "line.messenger_wire.tension_N": "10000 to 20000, high speed up to 28000",
    "line.messenger_wire.mass_kg_per_m": "bronze strand of 65 mm2 0.6, 120 mm2 1.07",
    "line.messenger_wire.bending_stiffness_N_m2": (
        "45 (65 mm2) to 130 (120 mm2); a strand has less than a solid wire"
    ),
    "line.auxiliary_wire.tension_N": "9800 to 14700 (Shinkansen)",
    "line.auxiliary_wire.mass_kg_per_m": "copper of 150 mm2 1.375",
    "line.auxiliary_wire.bending_stiffness_N_m2": "a solid wire of 150 mm2 215, a strand less",
    "line.auxiliary_wire.height_m": "0.2 to 0.6",
    "line.stitch_wire.tension_N": "2000 to 5000, mostly 2800 to 3500",
    "line.stitch_wire.mass_kg_per_m": "bronze strand of 35 mm2 0.31",
    "line.stitch_wire.bending_stiffness_N_m2": "2 to 11 (35 mm2); a strand has less than a wire",
    "line.stitch_wire.length_m": "12 to 22, mostly 18",
    "line.wires.*.name": "contact_wire, messenger_wire",
    "line.wires.*.role": "contact",
    "line.wires.*.tension_N": "contact wires 10000 to 31500, others 2000 to 28000",
    "line.wires.*.mass_kg_per_m": "copper of 107 mm2 0.95, 120 mm2 1.07, 150 mm2 1.33",
    "line.wires.*.bending_stiffness_N_m2": "a solid wire of 150 mm2 215, of 107 mm2 110",
    "line.links.*.name": "droppers, supports, steady_arms",
    "line.links.*.upper": "messenger_wire",
    "line.links.*.lower": "contact_wire",
    "line.links.*.wire": "messenger_wire for supports, contact_wire for steady_arms",
    "line.links.*.at_m": "where the two wires meet",
    "line.twin.spacing_m": "0.04 to 0.1",
    "line.bridle.tension_N": "1000 to 3000",
    "line.bridle.mass_kg_per_m": "bronze strand of 35 mm2 0.31",
    "line.bridle.bending_stiffness_N_m2": "2 to 11 (35 mm2)",
    "line.bridle.length_m": "4 to 12",
    "line.overlap.first_span": "where a tension section ends, 1200 to 1500 m from the last one",
    "line.overlap.rise_m": "0.6 over two spans: 0.15 at the next mast",
    "line.contact_wire.diameter_mm": "14.4 (150 mm2), 12.9 (120 mm2)",
    "line.messenger_wire.diameter_mm": "14 (117 mm2), 10.5 (70 mm2), 9 (50 mm2)",
    "wind.roughness_length_m": "0.003 (sea), 0.05 (open country), 0.3 (suburbs)",
    "wind.gusts.turbulence_intensity": "0.1 to 0.25",
    "wind.gusts.decay": "7 to 16",
    "line.curve.radius_m": "3000 to 7000 at 200 to 300 km/h, 300 and less on tramways",
    "line.tunnels.*.from_m": "where the train enters it",
    "line.tunnels.*.to_m": "where the train leaves it",
    "line.tunnels.*.force_factor": "1.2 to 2, by the tunnel's cross-section (assumed)",
    "line.dropper.stiffness_N_per_m": "100000 (EN 50318)",
    "line.dropper.axial_stiffness_N": "1.2e6 (bronze rope of 12 mm2 at 100 GPa)",
    "line.dropper.count": "5 to 9",
    "line.dropper.spacing_m": "4 to 10",
    "line.dropper.pre_sag_mid_mm": "0 to 1/1000 of the span, 55 for 55 m",
    "line.steady_arm.length_m": "1 to 1.3",
    "line.fittings.*.kind": "section_insulator",
    "line.fittings.*.at_m": "in the middle of a span, between droppers",
    "line.fittings.*.mass_kg": "section insulators 6 to 20, splices 0.5 to 1.5",
    "line.damping.alpha_s": (
        "0.0001 (en50318_2002, ac_simple); 0.0275 and 0.00275 (Ambrosio et al., 2012)"
    ),
    "line.damping.beta_per_s": "0.0125 (en50318_2002, ac_simple); 0 (Ambrosio et al., 2012)",
    "line.damping.lateral.alpha_s": "0 (assumed; none was measured)",
    "line.damping.lateral.beta_per_s": (
        "0.003 (wires alone) to 0.9 (a ratio of 0.05 at 1.4 Hz, as measured on vertical motion)"
    ),
    "pantographs.*.static_force_N": "AC 60 to 90, DC 3 kV 90 to 120, DC 1.5 kV 70 to 140",
    "pantographs.*.masses_kg": "two masses [7.2, 15] (EN 50318); head 5 to 10, frame 10 to 20",
    "pantographs.*.stiffnesses_N_per_m": "[4200, 50] for two masses (EN 50318)",
    "pantographs.*.dampings_N_s_per_m": "[10, 90] for two masses (EN 50318)",
    "pantographs.*.strips.length_m": "0.8 to 1.2",
    "pantographs.*.strips.flexure.bending_stiffness_N_m2": (
        "of a carbon strip on its holder some hundreds to some thousands"
    ),
    "train.speed_km_h": "below 0.7 of the contact wire's wave speed",
    "train.start_m": "two spans after the start of the line",
    "evaluation.from_m": "after the run-in, where a span begins",
    "evaluation.to_m": "whole spans after evaluation.from_m",
    "contact.restitution": "0.1 to 0.9",
    "numerics.spectral_radius": "0.8 to 0.9",
    "numerics.adaptive_tolerance_N": "0.1 to 10",
}
# Lowest and highest usual value by key, in the key's unit; zero is always allowed. A * stands for a
# name that the scene chooses; of a list each number is meant.
USUAL: dict[str, tuple[float, float]] = {
    "line.span_m": (20, 80),
    "line.contact_height_m": (4, 7),
    "line.encumbrance_m": (0.3, 3),
    "line.stagger_m": (0.05, 0.6),
    "line.messenger_stagger_m": (0.05, 0.6),
    "line.curve.radius_m": (150, 2e4),
    "line.curve.cant_mm": (10, 200),
    "line.contact_wire.tension_N": (5e3, 4e4),
    "line.contact_wire.mass_kg_per_m": (0.5, 2),
    "line.contact_wire.bending_stiffness_N_m2": (30, 600),
    "line.messenger_wire.tension_N": (3e3, 4e4),
    "line.messenger_wire.mass_kg_per_m": (0.3, 3),
    "line.auxiliary_wire.tension_N": (3e3, 4e4),
    "line.auxiliary_wire.mass_kg_per_m": (0.3, 3),
    "line.auxiliary_wire.height_m": (0.1, 2),
    "line.auxiliary_wire.dropper.stiffness_N_per_m": (1e4, 1e6),
    "line.stitch_wire.tension_N": (1e3, 6e3),
    "line.stitch_wire.mass_kg_per_m": (0.1, 1),
    "line.stitch_wire.length_m": (5, 30),
    "line.overlap.rise_m": (0.2, 2),
    "line.overlap.distance_m": (0.2, 0.5),
    "line.twin.spacing_m": (0.02, 0.5),
    "line.bridle.tension_N": (500, 6e3),
    "line.bridle.mass_kg_per_m": (0.1, 1),
    "line.bridle.length_m": (2, 20),
    "line.dropper.stiffness_N_per_m": (1e4, 1e6),
    "line.dropper.axial_stiffness_N": (1e4, 1e7),
    "line.dropper.positions_m": (1, 80),
    "line.dropper.spacing_m": (2, 20),
    "line.dropper.pre_sag_mm": (5, 150),
    "line.dropper.pre_sag_mid_mm": (5, 150),
    "line.support.stiffness_N_per_m": (1e4, 1e7),
    "line.wires.tension_N": (1e3, 4e4),
    "line.wires.mass_kg_per_m": (0.1, 3),
    "line.wires.height_m": (4, 9),
    "line.wires.stagger_m": (0.05, 0.6),
    "line.links.positions_m": (1, 80),
    "line.links.pre_sag_mm": (5, 150),
    "line.links.pre_sag_mid_mm": (5, 150),
    "line.transition.span_m": (20, 80),
    "pantographs.*.static_force_N": (30, 300),
    "pantographs.*.nominal_height_m": (4, 7),
    "pantographs.*.masses_kg": (1, 100),
    "pantographs.*.strips.length_m": (0.4, 2.2),
    "pantographs.*.strips.spacing_m": (0.2, 1.5),
    "contact.stiffness_N_per_m": (5e3, 1e7),
    "numerics.dt_s": (1e-5, 5e-3),
}
_SIGNED = ("stagger_m", "messenger_stagger_m", "pre_sag")
_MARGIN = 10.0  # beyond a usual range without a question
# What a number a thousand times too small, or too large, was probably written in.
_LARGER = {"N": "kN", "N/m": "kN/m", "mm": "m", "N m2": "kN m2"}
_SMALLER = {"m": "mm", "kg": "g", "kg/m": "g/m", "s": "ms"}


def usual_range(key: str) -> tuple[float, float] | None:
    """The usual range of a dotted key, None if none is declared."""
    parts = [part for part in key.split(".") if not part.isdigit()]
    if len(parts) > 2 and parts[0] == "pantographs":
        parts[1] = "*"
    return USUAL.get(".".join(parts))


def unit_guess(key: str, value: float) -> str:
    """The sentence on a number whose unit is probably another one, "" for others."""
    usual, unit = usual_range(key), unit_of(key)
    # Sideways and below there are negative numbers, of which only the size can be a slip.
    signed = any(part.startswith(_SIGNED) for part in key.split("."))
    size = abs(value) if signed else value
    if usual is None or size <= 0 or usual[0] / _MARGIN <= size <= usual[1] * _MARGIN:
        return ""
    for others, factor in ((_LARGER, 1e3), (_SMALLER, 1e-3)):
        if unit in others and usual[0] <= size * factor <= usual[1]:
            return (
                f"usual are {usual[0]:.12g} to {usual[1]:.12g} {unit}: is it {value:.12g} "
                f"{others[unit]}? write {value * factor:.12g}"
            )
    return ""
