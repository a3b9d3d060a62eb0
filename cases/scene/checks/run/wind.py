"""Whether the wind of a scene finds what it needs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.line.parts import wire_tables
from catenary.cases.scene.convert.line.wind import wind_of
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.table import TAKE_AWAY
from catenary.meshgen.topologies.line_data import LineData

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_wind(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Wires without a diameter, stretches that overlap or are nowhere, heights in the ground."""
    table = scene.wind
    if table is None:
        return
    if scene.switches()["wind"] and table.speed_m_per_s > 0.0:
        for name, wire in wire_tables(scene.line).items():
            if wire.diameter_mm is None:
                key = f"{name}.diameter_mm"
                yield Fault(
                    key,
                    f"{key} is missing {scene.origin.of(name)}: the drag of the wind "
                    "depends on it; give it, or write effects.wind = false",
                )
    end = line.support_positions[-1]
    for i, stretch in enumerate(table.stretches):
        if stretch.from_m >= end:
            key = f"wind.stretches.{i}.from_m"
            yield refusal(scene.origin, key, stretch.from_m, f"the line ends at {end:g} m")
    for i, (before, after) in enumerate(pairwise(table.stretches), start=1):
        if after.from_m < before.to_m:
            why = f"it must be {before.to_m:g} at least, where the stretch before it ends"
            yield refusal(scene.origin, f"wind.stretches.{i}.from_m", after.from_m, why)
    said = "roughness_length_m" in table.model_fields_set and not scene.origin.recorded
    if said and table.profile == "power" and table.gusts is None:
        key, value = "wind.roughness_length_m", table.roughness_length_m
        why = "nothing reads it with the profile power and no gusts"
        yield refusal(scene.origin, key, value, why + TAKE_AWAY)
    wind = wind_of(table)
    if wind is not None and (not math.isfinite(wind.mean) or wind.mean <= 0.0):
        yield refusal(
            scene.origin, "wind.height_m", table.height_m, "there is no wind at that height"
        )
