"""Whether pantographs can be what a scene says, and fit the vehicle's motion, the line and the air.

Mechanisms must reach the wire, and strips be long enough for it; wind, tunnels and uplift must find
what they act on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.cases.scene.input.faults import Fault, shown
from catenary.cases.scene.keys.table import StretchTable, take_away
from catenary.cases.scene.keys.units import speed_from_km_h
from catenary.cases.scene.line.line_data import tables_of
from catenary.cases.scene.line.wires import WireTable
from catenary.cases.scene.run.wind import wind_of
from catenary.cases.scene.scene import Scene, end_of, pantograph_of, static_force, strips_ahead
from catenary.cases.scene.train.mechanism import ActuatorTable
from catenary.cases.scene.train.pantograph import (
    LumpedTable,
    MultibodyTable,
    PantographTable,
    wanted_force,
)
from catenary.cases.scene.train.train import MotionTable, vehicle_of
from catenary.mbs.rigid.bodies import SPACE
from catenary.mbs.vehicle import BaseMotion
from catenary.meshgen.topologies.line_data import LineData

if TYPE_CHECKING:
    from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, Standing

# A wave of an irregular track takes at least so many steps.
STEPS_PER_WAVE = 8
# By how much the arm may be further down than the head while both fall [m].
_LEADS = 0.05
# Slack for sums of decimal lengths [m] and times [s].
_TINY = 1e-6


def check_pantographs(scene: Scene) -> Iterator[Fault]:
    """Names and forces that are wrong with a kind of pantograph."""
    yield from _static_forces(scene)
    for name, table in scene.pantographs.items():
        if isinstance(table, MultibodyTable):
            yield from _names(scene, name, table)
            yield from _actuator(scene, name, table)


def check_mechanisms(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Mechanisms on the train that cannot be assembled, or do not reach the wire from the height
    that ``nominal_height_m`` puts them to. Names and forces have no fault.

    The machinery of multibody systems is imported here, for scenes that have a mechanism.
    """
    found: list[Fault] = []
    for name, table in _kinds(scene).items():
        if isinstance(table, MultibodyTable):
            try:
                _standing(scene, name, table)
            except (InputError, RunBroken) as error:
                found.append(scene.fault(f"pantographs.{name}", f"cannot be built: {error}"))
    yield from found or _out_of_reach(scene, line)


def _kinds(scene: Scene) -> dict[str, PantographTable]:
    """Tables of the kinds of pantograph that are on the train, by their names, leading one first.

    Names have no fault.
    """
    return {place.name: scene.pantographs[place.name] for place in scene.train.pantographs}


def _out_of_reach(scene: Scene, line: LineData) -> Iterator[Fault]:
    lowest, highest = line.contact_heights
    for name, table in _kinds(scene).items():
        if not isinstance(table, MultibodyTable) or table.nominal_height_m is None:
            continue
        data, standing = _standing(scene, name, table)
        for height in (lowest, highest):
            if _reaches(data, standing.working_height + height - table.nominal_height_m):
                continue
            yield scene.refused(
                f"pantographs.{name}.nominal_height_m",
                f"the contact wire hangs at {lowest:.4g} to {highest:.4g} m, where its "
                f"head would be {height - table.nominal_height_m:+.4g} m away from there, beyond "
                "the reach of its mechanism",
            )
            break


def reaches_below(scene: Scene, name: str, line: LineData, drop: float) -> bool:
    """Whether a kind of pantograph can go down by ``drop`` [m] from wherever the wire is."""
    table = scene.pantographs[name]
    if not isinstance(table, MultibodyTable):
        return True
    lowest, highest = line.contact_heights
    nominal = highest if table.nominal_height_m is None else table.nominal_height_m
    data, standing = _standing(scene, name, table)
    return _reaches(data, standing.working_height + lowest - nominal - drop - _LEADS)


def _standing(scene: Scene, name: str, table: MultibodyTable) -> tuple[MultibodyData, Standing]:
    """A mechanism, and how it stands."""
    from catenary.cases.scene.train.multibody import multibody_of
    from catenary.mbs.mechanism.multibody_pantograph import stand

    data = multibody_of(name, table, scene.train.speed_km_h)
    return data, stand(data)


def _reaches(data: MultibodyData, arm: float) -> bool:
    """Whether a mechanism can have its arm at a height above its base [m]."""
    from catenary.mbs.mechanism.multibody_pantograph import HOLDER, reduced, stand
    from catenary.mbs.rigid.joints import Constant, PrescribedPoint

    if data.all_bodies is None:
        heights = reduced(data).heights
        return bool(heights[0] <= arm <= heights[-1])
    standing = stand(data)
    holder = PrescribedPoint(HOLDER, data.arm, Constant(arm))
    try:
        standing.system.with_joints(holder).assemble(standing.motion)
    except InputError:
        return False
    return True


def _names(scene: Scene, kind: str, table: MultibodyTable) -> Iterator[Fault]:
    key = f"pantographs.{kind}"
    bodies = list(table.bodies)
    if SPACE in bodies:
        why = "is the name of the frame at rest; choose another"
        yield scene.fault(f"{key}.bodies.{SPACE}", why)
    for role in ("head", "arm"):
        yield from scene.among(f"{key}.{role}", bodies)
    if table.head == table.arm:
        yield scene.refused(f"{key}.head", "the arm is this body too; they are two")
    if table.actuator is not None:
        yield from scene.among(f"{key}.actuator", list(table.forces))
    for place in _uses(table):
        # A force or mass on one body alone would have no effect on the space at rest.
        on_one = place.endswith(".body")
        yield from scene.among(f"{key}.{place}", bodies if on_one else [*bodies, SPACE])
    for what in ("joints", "forces"):
        for label, one in getattr(table, what).items():
            if getattr(one, "i", None) == getattr(one, "j", SPACE):
                yield scene.fault(f"{key}.{what}.{label}", f"has {shown(one.i)} on both sides")
    for label in table.forces:
        if label in table.joints or label == "gravity":
            yield scene.fault(f"{key}.forces.{label}", "has the name of a joint or of gravity")


def _uses(table: MultibodyTable) -> Iterator[str]:
    """Keys of joints and forces that hold names of bodies."""
    for what in ("joints", "forces"):
        for label, one in getattr(table, what).items():
            for end in ("i", "j", "body"):
                if hasattr(one, end):
                    yield f"{what}.{label}.{end}"


def _actuator(scene: Scene, kind: str, table: MultibodyTable) -> Iterator[Fault]:
    if not table.calibrate or table.actuator not in table.forces:
        return
    force = table.forces[table.actuator]
    key = f"pantographs.{kind}.actuator"
    if not isinstance(force, ActuatorTable):
        yield scene.refused(key, f"that is a {force.type}, no actuator")
    elif force.force_N is None:
        why = "its force is a table, so that it cannot be calibrated; write calibrate = false"
        yield scene.refused(key, why)


def _static_forces(scene: Scene) -> Iterator[Fault]:
    speed = scene.train.speed_km_h
    for name, table in _kinds(scene).items():
        if table.static_force_by_speed is None:
            continue
        if wanted_force(table, speed) is None:
            first, last = table.static_force_by_speed[0][0], table.static_force_by_speed[-1][0]
            key = "train.speed_km_h"
            held = f"{first:g} km/h" if first == last else f"{first:g} to {last:g} km/h"
            yield Fault(
                key,
                f"{key} is {speed:g} km/h {scene.origin.of(key)}; "
                f"pantographs.{name}.static_force_by_speed only holds forces for {held}",
            )


def check_laws(scene: Scene) -> Iterator[Fault]:
    """Laws on masses that are not there, and what all bodies or slow samples do not allow."""
    for name, table in scene.pantographs.items():
        key = f"pantographs.{name}"
        lumped = isinstance(table, LumpedTable)
        n = len(table.masses_kg) if isinstance(table, LumpedTable) else 2
        for number, law in enumerate(table.laws):
            if law.at_mass is not None and law.at_mass > n:
                has = f"{n} masses" if lumped else "2, the head and the arm"
                yield scene.refused(f"{key}.laws.{number}.at_mass", f"the pantograph has {has}")
        whole = not isinstance(table, LumpedTable) and table.motion == "all_bodies"
        for part, given in (("laws", table.laws), ("regulation", table.regulation)):
            if whole and given:
                yield scene.refused(
                    f"{key}.motion",
                    f"{key}.{part} acts on mechanisms that are reduced to tables only",
                )
        regulation = table.regulation
        if regulation is not None and regulation.sample_s < scene.numerics.dt_s:
            yield scene.refused(
                f"{key}.regulation.sample_s",
                f"a sample takes at least a step, numerics.dt_s = {scene.numerics.dt_s:g}",
            )


def has_front(table: PantographTable) -> bool:
    """Whether a pantograph that runs the other way round is another one."""
    turned = table.aerodynamics is not None and table.aerodynamics.reversed is not None
    return turned or table.type == "multibody"


def check_vehicle(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Contradictions between vehicle, heads and line."""
    yield from _vehicle_acts(scene)
    yield from _roll_acts(scene)
    yield from _multibody_strips(scene)
    reaches = list(_tables_reach(scene))
    yield from reaches
    yield from _waves(scene)
    if not reaches:
        yield from _strip_lengths(scene, line)


def _vehicle_acts(scene: Scene) -> Iterator[Fault]:
    if scene.vehicle is None:
        return
    yield from scene.needs_effect("vehicle_motion", "vehicle")
    if scene.switches()["vehicle_motion"] and not _wire_moves_along_strips(scene):
        suspension = scene.vehicle.suspension
        sways = suspension is not None and suspension.lateral is not None
        for key, is_there in (
            ("vehicle.lateral", scene.vehicle.lateral is not None),
            ("vehicle.suspension.lateral", sways and scene.switches()["vehicle_suspension"]),
        ):
            if is_there:
                yield scene.fault(
                    key,
                    "moves the wire along the strips, which acts only with effects.head_roll = "
                    "true, effects.lateral_motion = true or strips that bend",
                )


def _wire_moves_along_strips(scene: Scene) -> bool:
    """Whether it matters where wires cross the strips."""
    on = scene.switches()
    kinds = _kinds(scene).values()
    bends = on["flexible_strips"] and any(kind.strips.flexure is not None for kind in kinds)
    return bends or on["head_roll"] or on["lateral_motion"]


def _roll_acts(scene: Scene) -> Iterator[Fault]:
    on = scene.switches()["head_roll"]
    for name, kind in _kinds(scene).items():
        if isinstance(kind, LumpedTable) and kind.roll is not None:
            yield from scene.needs_effect("head_roll", f"pantographs.{name}.roll")
        rolls = on and pantograph_of(name, kind, scene.train.speed_km_h).roll
        if rolls and kind.strips.length_m is None:
            strip = f"pantographs.{name}.strips.length_m"
            why = f"it needs {strip}, the strip that the wire moves along"
            yield scene.refused("effects.head_roll", why)


def _multibody_strips(scene: Scene) -> Iterator[Fault]:
    for name, kind in _kinds(scene).items():
        if not isinstance(kind, MultibodyTable) or kind.strips.mass_kg is None:
            continue
        mass = _standing(scene, name, kind)[1].head.mass
        if kind.strips.mass >= mass:
            yield scene.refused(
                f"pantographs.{name}.strips.mass_kg",
                f"strips are part of the head, which weighs {mass:.3g} kg",
            )


def _tables_reach(scene: Scene) -> Iterator[Fault]:
    """Tables must hold for all of the run; splines are not continued."""
    if scene.vehicle is None:
        return
    start, end = scene.train.start_m, end_of(scene)
    rear = scene.train.pantographs[-1].behind_m
    duration = (end - start) / speed_from_km_h(scene.train.speed_km_h)
    for direction in ("vertical", "lateral"):
        table: MotionTable | None = getattr(scene.vehicle, direction)
        if table is None:
            continue
        for name, pairs, low, high, unit in (
            ("by_time", table.by_time, 0.0, duration, "s"),
            ("by_place", table.by_place, start - rear, end, "m"),
        ):
            if pairs is None:
                continue
            first, last = pairs[0][0], pairs[-1][0]
            if first > low + _TINY or last < high - _TINY:
                yield scene.fault(
                    f"vehicle.{direction}.{name}",
                    f"holds from {first:g} to {last:g} {unit}, but the run needs it from {low:g} "
                    f"to {high:.5g} {unit}",
                )


def _waves(scene: Scene) -> Iterator[Fault]:
    if scene.vehicle is None or scene.vehicle.irregularity is None:
        return
    step = speed_from_km_h(scene.train.speed_km_h) * scene.numerics.dt_s
    shortest = scene.vehicle.irregularity.shortest_m
    if shortest < STEPS_PER_WAVE * step:
        yield scene.refused(
            "vehicle.irregularity.shortest_m",
            f"the train runs {step:.3g} m in a step of numerics.dt_s; a wave must take "
            f"{STEPS_PER_WAVE} of these",
        )


def _strip_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    for i, place in enumerate(scene.train.pantographs):
        kind = scene.pantographs[place.name]
        length = kind.strips.length_m
        if length is None:
            continue
        far, x = _farthest(scene, line, i)
        if 2.0 * abs(far) > length + _TINY:
            keys = "line.stagger_m"
            if scene.switches()["vehicle_motion"] and scene.vehicle is not None:
                keys += " and vehicle"
            needed = math.ceil(2e3 * abs(far) - 1e-6) / 1e3
            yield scene.refused(
                f"pantographs.{place.name}.strips.length_m",
                f"at {x:.4g} m the wire is {abs(far):.3g} m beside the strips' middle ({keys}), so "
                f"that they must be at least {needed:g} m long",
            )


def _farthest(scene: Scene, line: LineData, number: int) -> tuple[float, float]:
    """Farthest place of the wire from the middle of a pantograph's strips on its run, and the
    pantograph's place then [m]."""
    place, speed = scene.train.pantographs[number], speed_from_km_h(scene.train.speed_km_h)
    start = scene.train.start_m - place.behind_m
    duration = (end_of(scene) - scene.train.start_m) / speed
    offsets = np.array([1.0, -1.0]) * strips_ahead(scene)[number]
    base = None
    if scene.switches()["vehicle_motion"] and scene.vehicle is not None:
        vehicle = vehicle_of(scene.vehicle)
        if not scene.switches()["vehicle_suspension"]:
            vehicle = replace(vehicle, suspension=None)
        base = BaseMotion(vehicle, start, speed)
    # Extremes are at supports, unless the vehicle sways: then every 0.25 m and 20 ms are sampled.
    supports = line.support_positions
    times = np.concatenate(
        [[0.0, duration], *((supports - start - one) / speed for one in offsets)]
    )
    if base is not None:
        n = math.ceil(duration / min(0.25 / speed, 0.02))
        times = np.concatenate([times, np.linspace(0.0, duration, n)])
    times = times[(times >= 0.0) & (times <= duration)]
    ahead = start + speed * times[:, None] + offsets
    courses = np.array(line.contact_sideways(ahead))
    places = np.take_along_axis(courses, np.abs(courses).argmax(axis=0)[None], axis=0)[0]
    if base is not None:
        places -= np.array([base.lateral(time).place for time in times.tolist()])[:, None]
    farthest = np.abs(places).max(axis=1)
    first = int(np.argmax(farthest))
    if farthest[first] == 0.0:
        return 0.0, start
    strip = int(np.argmax(np.abs(places[first])))
    return float(places[first, strip]), float(start + speed * times[first])


def check_wind(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Wires without a diameter, stretches that overlap or are nowhere, heights in the ground."""
    table = scene.wind
    if table is None:
        return
    if scene.switches()["wind"] and table.speed_m_per_s > 0.0:
        for name, wire in tables_of(scene.line, WireTable).items():
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
