"""Usual ranges of a scene's numbers, by which a value in another unit is recognised.

A range holds what lines and pantographs of railways have. A number beyond it by more than a factor
of ten that would lie inside in a unit a thousand times larger or smaller is taken for a slip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.cases.scene.tables.units import unit_of

if TYPE_CHECKING:
    pass

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
