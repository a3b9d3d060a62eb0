"""Whether what the air does to pantographs, and tunnels, are possible."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.train.pantograph import pantograph_of, static_force
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.table import TAKE_AWAY
from catenary.cases.scene.tables.train.pantograph import PantographTable
from catenary.cases.scene.tables.units import speed_from_km_h
from catenary.meshgen.topologies.line_data import LineData

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def has_front(table: PantographTable) -> bool:
    """Whether a pantograph that runs the other way round is another one."""
    turned = table.aerodynamics is not None and table.aerodynamics.reversed is not None
    return turned or table.type == "multibody"


def check_tunnels(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Tunnels that overlap, are nowhere on the line, or that nothing notices."""
    tunnels, end = scene.line.tunnels, line.support_positions[-1]
    for i, tunnel in enumerate(tunnels):
        if tunnel.from_m >= end:
            key = f"line.tunnels.{i}.from_m"
            yield refusal(scene.origin, key, tunnel.from_m, f"the line ends at {end:g} m")
    for i, (before, after) in enumerate(pairwise(tunnels), start=1):
        if after.from_m < before.to_m:
            why = f"it must be {before.to_m:g} at least, where the tunnel before it ends"
            yield refusal(scene.origin, f"line.tunnels.{i}.from_m", after.from_m, why)
    known = [place.name for place in scene.train.pantographs if place.name in scene.pantographs]
    if tunnels and known and not any(_meets_air(scene, name) for name in known):
        yield Fault(
            "line.tunnels",
            f"line.tunnels {scene.origin.of('line.tunnels')} changes nothing: no pantograph of the "
            "train has aerodynamics or a force of type aerodynamic_force",
        )


def check_crosswind(scene: Scene, line: LineData) -> Iterator[Fault]:
    """A factor of cross winds of a pantograph on which the air has no forces."""
    for name, table in scene.pantographs.items():
        if table.crosswind_factor and not _meets_air(scene, name) and not scene.origin.recorded:
            key = f"pantographs.{name}.crosswind_factor"
            why = (
                "the air has no forces on this pantograph: give it aerodynamics or a force of type "
                f"aerodynamic_force{TAKE_AWAY}"
            )
            yield refusal(scene.origin, key, table.crosswind_factor, why)


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
            yield Fault(
                key,
                f"{key} {scene.origin.of(key)} presses the head down by {-lifted:.4g} N at "
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
