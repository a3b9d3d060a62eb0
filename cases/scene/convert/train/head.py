"""From a scene's table of a head to its strips and how it turns, in SI units."""

from __future__ import annotations

import math

from catenary.cases.scene.tables.train.head import StripsTable
from catenary.mbs.head.flexure import Flexure
from catenary.mbs.head.strips import Strips, Suspension, Turning


def strips_of(table: StripsTable, spring: float = 0.0, damper: float = 0.0) -> Strips:
    """Strips of a head whose own spring [N/m] and damper [N s/m] also hold its pitch."""
    suspension = pitch = None
    if table.mass_kg is not None and table.stiffness_N_per_m is not None:
        suspension = Suspension(table.mass_kg, table.stiffness_N_per_m, table.damping_N_s_per_m)
    inertia, distance = table.pitch_inertia_kg_m2, table.pitch_spring_distance_m
    if inertia is not None and distance is not None:
        pitch = turning_of(inertia, distance, spring, damper)
    flexure = None
    if table.flexure is not None:
        own = table.flexure
        flexure = Flexure(
            own.bending_stiffness_N_m2, own.spring_distance_m, own.modes, own.damping_ratio
        )
    spacing = table.spacing_m or 0.0
    rake = math.radians(table.rake_deg)
    length = table.length_m
    return Strips(table.number, spacing, length, suspension, pitch, flexure=flexure, rake=rake)


def turning_of(inertia: float, distance: float, spring: float, damper: float) -> Turning:
    """A head on two halves of its spring and damper at a distance [m] from each other."""
    square = (0.5 * distance) ** 2
    return Turning(inertia, spring * square, damper * square)
