"""Where the train's course ends, and a scene with all values that hold."""

from __future__ import annotations

from typing import Any

from catenary.cases.scene.convert.line.line import line_data_of
from catenary.cases.scene.scene import Scene


def end_of(scene: Scene) -> float:
    """Where the leading pantograph stops [m]: ``train.end_m`` or what stands for it."""
    if scene.train.end_m is not None:
        return scene.train.end_m
    line = line_data_of(scene)
    running_end = line.running_range[1]
    behind = max(placement.behind_m for placement in scene.train.pantographs)
    run_out = sum(line.span_lengths) / line.n_spans
    # The foremost strip must not leave the line either.
    running_end -= max(strips_ahead(scene))
    return float(min(running_end, scene.evaluation.to_m + behind + run_out))


def strips_ahead(scene: Scene) -> list[float]:
    """How far the outer strips of each pantograph are from its middle, along the track [m]."""
    kinds = (scene.pantographs.get(place.name) for place in scene.train.pantographs)
    return [0.0 if kind is None else kind.strips.ahead for kind in kinds]


def resolved(scene: Scene) -> dict[str, Any]:
    """All keys with the values that hold, plain enough for JSON; loads to the same scene."""
    plain: dict[str, Any] = scene.model_dump(mode="json", exclude_none=True)
    plain["train"]["end_m"] = end_of(scene)
    plain["effects"] = scene.switches()
    if scene.mesh.file is not None:
        plain["mesh"] = {"file": scene.mesh.file}
    return plain
