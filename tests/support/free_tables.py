"""The line of a scene written as free tables of wires and links."""

from __future__ import annotations

import math
from typing import Any

from scenes import Scene, line_of, resolved

from catenary.meshgen.line import DropperKind, Droppers, Line, SteadyArm
from catenary.meshgen.wires import End, Profile, Wire

# Tables and keys of ``line`` that a free line does without.
_REPLACED = (
    "contact_wire", "messenger_wire", "auxiliary_wire", "stitch_wire", "twin", "bridle", "dropper",
    "support", "steady_arm", "encumbrance_m",
)  # fmt: skip
_CONDUCTOR = (
    ("tension_N", "tension"),
    ("mass_kg_per_m", "mass_per_length"),
    ("bending_stiffness_N_m2", "bending_stiffness"),
    ("axial_stiffness_N", "axial_stiffness"),
    ("expansion_per_K", "expansion"),
)


def as_free(scene: Scene) -> dict[str, Any]:
    """The tables of ``scene`` with its line as wires and links."""
    raw, line = resolved(scene), line_of(scene)
    table = {key: value for key, value in raw["line"].items() if key not in _REPLACED}
    hung = scene.line.dropper
    slack = {} if hung is None else {
        "residual_stiffness_ratio": hung.residual_stiffness_ratio,
        "slack_damping": hung.slack_damping,
    }  # fmt: skip
    table["topology"] = "free"
    table["wires"] = [_wire(line, wire) for wire in line.wires]
    table["links"] = [
        *(_droppers(scene, line, group) | slack for group in line.droppers if group.lower_x),
        *(
            {"type": "steady_arms", "name": arms.name, "wire": arms.wire, "at_m": list(arms.x)}
            | _arm(arms.kind)
            for arms in line.steady_arms
        ),
        *(
            {
                "type": "supports",
                "name": group.name,
                "wire": group.wire,
                "stiffness_N_per_m": group.stiffness,
                "at_m": list(group.x),
            }
            | ({"holds": group.holds} if group.holds else {})
            for group in line.supports
        ),
    ]
    # Clamps at the ends of wires have a name of their own here.
    damped = table["damping"].get("per_component", {})
    for clamps in line.clamps:
        if clamps.name in damped:
            damped[f"{clamps.lower}_clamps"] = damped.pop(clamps.name)
    return {**raw, "line": table}


def _wire(line: Line, wire: Wire) -> dict[str, Any]:
    table: dict[str, Any] = {"name": wire.name, "role": wire.role.value}
    for key, name in _CONDUCTOR:
        if getattr(wire, name) is not None:
            table[key] = getattr(wire, name)
    first = wire.pieces[0]
    if first.ends[0] is End.CLAMPED:
        (clamps,) = line.clamps
        bearer = clamps.upper if clamps.lower == wire.name else clamps.lower
        table |= {
            "stretches_m": [[piece.x[0], piece.x[-1]] for piece in wire.pieces],
            "start": bearer,
            "end": bearer,
            "clamp_kg": clamps.mass,
            "clamp_stiffness_N_per_m": clamps.stiffness,
        }
        return table
    y = wire.points(line.support_positions)[:, 1]
    height = wire.profile.height if wire.profile is not None else first.z[0]
    return {**table, "height_m": height, "stagger_m": y.tolist()}


def _droppers(scene: Scene, line: Line, group: Droppers) -> dict[str, Any]:
    profile = line.wire(group.lower).profile
    assert isinstance(profile, Profile)
    sag = [1e3 * value for value in profile.pre_sag(group.lower_x).tolist()]
    return {
        "type": "droppers",
        "name": group.name,
        "upper": group.upper,
        "lower": group.lower,
        "at_m": list(group.lower_x),
        "pre_sag_mm": sag,
    } | _kind(group.kind)


def _kind(kind: DropperKind) -> dict[str, Any]:
    curve = None if kind.curve is None else [list(point) for point in kind.curve]
    return {
        "stiffness_N_per_m": kind.stiffness,
        "axial_stiffness_N": kind.axial_stiffness,
        "curve": curve,
        "mass_kg_per_m": kind.mass_per_length,
        "messenger_clamp_kg": kind.upper_clamp_mass,
        "contact_clamp_kg": kind.lower_clamp_mass,
    }


def _arm(arm: SteadyArm) -> dict[str, Any]:
    return {
        "length_m": arm.length,
        "mass_kg_per_m": arm.mass_per_length,
        "clamp_kg": arm.clamp_mass,
        "stiffness_N_per_m": arm.stiffness,
        "holds_height": arm.holds_height,
        **({} if arm.inclination is None else {"inclination_deg": math.degrees(arm.inclination)}),
        "registration_stiffness_N_per_m": arm.registration_stiffness,
    }
