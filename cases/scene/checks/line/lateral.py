"""Whether what only lateral motion reads is given without it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.line.parts import arm_tables
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

_EFFECT = "lateral_motion"


def check_lateral(scene: Scene) -> Iterator[Fault]:
    """Keys of lateral motion without it."""
    line = scene.line
    if scene.switches()[_EFFECT]:
        return
    given: dict[str, object] = {
        **{
            f"{key}.{name}": getattr(arm, name)
            for key, arm in arm_tables(line).items()
            for name in ("inclination_deg", "registration_stiffness_N_per_m")
        },
        "line.messenger_stagger_m": line.messenger_stagger_m,
        "line.curve.radius_m": line.curve and line.curve.radius_m,
        "line.damping.lateral": line.damping.lateral,
    }
    for key, value in given.items():
        if value is not None and _EFFECT not in scene.effects:
            why = (
                f"it acts only with effects.{_EFFECT} = true; write that, or false to leave it out"
            )
            yield refusal(scene.origin, key, value, why)
