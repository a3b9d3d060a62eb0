"""Whether what only lateral motion reads is given without it, and what does not go with it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

_EFFECT = "lateral_motion"


def check_lateral(scene: Scene) -> Iterator[Fault]:
    """Keys of lateral motion without it, and ends that it has not."""
    line = scene.line
    if scene.switches()[_EFFECT]:
        for side, end in (("start", line.ends.start), ("end", line.ends.end)):
            if end.kind == "periodic":
                key = f"line.ends.{side}.kind"
                why = (
                    f"with effects.{_EFFECT} it must be fixed or absorbing_layer, because a "
                    "staggered line does not repeat itself from span to span"
                )
                yield refusal(scene.origin, key, end.kind, why)
        return
    given = {
        "line.steady_arm.inclination_deg": line.steady_arm.inclination_deg,
        "line.messenger_stagger_m": line.messenger_stagger_m,
        "line.curve": line.curve and line.curve.radius_m,
    }
    for key, value in given.items():
        if value is not None and _EFFECT not in scene.effects:
            why = (
                f"it acts only with effects.{_EFFECT} = true; write that, or false to leave it out"
            )
            yield refusal(scene.origin, key, value, why)
