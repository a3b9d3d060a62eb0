"""Whether wind, uplift and tunnels of a scene find what they need."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.table import StretchTable, take_away
from catenary.cases.scene.keys.units import speed_from_km_h
from catenary.cases.scene.line.line_data import wire_tables
from catenary.cases.scene.problem import pantograph_of, static_force
from catenary.cases.scene.run.wind import wind_of
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.train.pantograph import PantographTable
from catenary.meshgen.topologies.line_data import LineData


def check_wind(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Wires without a diameter, stretches that overlap or are nowhere, heights in the ground."""
    table = scene.wind
    if table is None:
        return
    if scene.switches()["wind"] and table.speed_m_per_s > 0.0:
        for name, wire in wire_tables(scene.line).items():
            if wire.diameter_mm is None:
                why = "the drag of the wind depends on it; give it, or write effects.wind = false"
                yield scene.missing(f"{name}.diameter_mm", "", why, of=name)
    yield from _one_after_the_other(scene, "wind.stretches", table.stretches, line, "stretch")
    is_given = "roughness_length_m" in table.model_fields_set and not scene.origin.recorded
    if is_given and table.profile == "power" and table.gusts is None:
        why = "nothing reads it with the profile power and no gusts"
        yield scene.refused("wind.roughness_length_m", why + take_away())
    wind = wind_of(table)
    if wind is not None and (not math.isfinite(wind.mean) or wind.mean <= 0.0):
        yield scene.refused("wind.height_m", "there is no wind at that height")


def has_front(table: PantographTable) -> bool:
    """Whether a pantograph that runs the other way round is another one."""
    turned = table.aerodynamics is not None and table.aerodynamics.reversed is not None
    return turned or table.type == "multibody"


def check_tunnels(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Tunnels that overlap, are nowhere on the line, or that nothing notices."""
    tunnels = scene.line.tunnels
    yield from _one_after_the_other(scene, "line.tunnels", tunnels, line, "tunnel")
    known = [place.name for place in scene.train.pantographs if place.name in scene.pantographs]
    if tunnels and known and not any(_meets_air(scene, name) for name in known):
        yield scene.fault(
            "line.tunnels",
            "changes nothing: no pantograph of the train has aerodynamics or a force of type "
            "aerodynamic_force",
        )


def _one_after_the_other(
    scene: Scene, key: str, stretches: Sequence[StretchTable], line: LineData, what: str
) -> Iterator[Fault]:
    """Stretches that begin beyond the line, or before the end of the one before."""
    end = line.support_positions[-1]
    for i, stretch in enumerate(stretches):
        if stretch.from_m >= end:
            yield scene.refused(f"{key}.{i}.from_m", f"the line ends at {end:g} m")
    for i, (before, after) in enumerate(pairwise(stretches), start=1):
        if after.from_m < before.to_m:
            why = f"it must be {before.to_m:g} at least, where the {what} before it ends"
            yield scene.refused(f"{key}.{i}.from_m", why)


def check_crosswind(scene: Scene, line: LineData) -> Iterator[Fault]:
    """A factor of cross winds without a wind, or of a pantograph on which the air has no forces."""
    for name, table in scene.pantographs.items():
        if not table.crosswind_factor or scene.origin.recorded:
            continue
        if not _meets_air(scene, name):
            why = (
                "the air has no forces on this pantograph: give it aerodynamics or a force of type "
                "aerodynamic_force"
            )
        elif scene.wind is None:
            why = "there is no wind: give a table wind"
        else:
            continue
        yield scene.refused(f"pantographs.{name}.crosswind_factor", why + take_away())


def check_uplift(scene: Scene) -> Iterator[Fault]:
    """Air that presses a pantograph down by more than its static force. Mechanisms are sound."""
    if not scene.switches()["pantograph_aerodynamics"]:
        return
    speed = scene.train.speed_km_h
    for name, turned in dict.fromkeys((p.name, p.reversed) for p in scene.train.pantographs):
        if not _meets_air(scene, name):
            continue
        from catenary.mbs.build import steady_forces  # loads the compiled loops of all models

        table = scene.pantographs[name]
        data = pantograph_of(name, table, speed, reversed=turned)
        lifted, force = (
            steady_forces(data, speed_from_km_h(speed)).whole,
            static_force(name, table, speed),
        )
        if force is not None and force + lifted <= 0.0:
            key = f"pantographs.{name}" + (".aerodynamics" if table.aerodynamics else "")
            yield scene.fault(
                key,
                f"presses the head down by {-lifted:.4g} N at "
                f"{speed:g} km/h, and its static force is {force:.4g} N: it would not touch the "
                "wire",
            )


def _meets_air(scene: Scene, name: str) -> bool:
    """Whether the air has forces on a kind of pantograph."""
    table = scene.pantographs[name]
    if table.aerodynamics is not None:
        return True
    forces = table.forces.values() if table.type == "multibody" else ()
    return any(force.type == "aerodynamic_force" for force in forces)
