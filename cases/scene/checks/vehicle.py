"""Whether strips are long enough, and fit beside each other, under the vehicle's own motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.problem import end_of, pantograph_of, strips_ahead
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.train.pantograph import LumpedTable, MultibodyTable
from catenary.cases.scene.train.train import MotionTable, vehicle_of
from catenary.mbs.roll import roll_of
from catenary.meshgen.topologies.line_data import LineData

# A wave of an irregular track takes at least so many steps.
STEPS_PER_WAVE = 8
# Slack for sums of decimal lengths [m] and times [s].
_TINY = 1e-6


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
    on, said = scene.switches()["vehicle_motion"], "vehicle_motion" in scene.effects
    if scene.vehicle is None:
        return
    if not on and not said:
        yield _idle(scene, "vehicle", "vehicle_motion")
    acts = any(scene.switches()[name] for name in ("head_roll", "lateral_motion"))
    if on and scene.vehicle.lateral is not None and not acts:
        key = "vehicle.lateral"
        yield scene.fault(
            key,
            "moves the wire along the strips, which acts only with "
            "effects.head_roll = true or effects.lateral_motion = true",
        )


def _roll_acts(scene: Scene) -> Iterator[Fault]:
    on, said = scene.switches()["head_roll"], "head_roll" in scene.effects
    speed = scene.train.speed_km_h
    names = list(dict.fromkeys(place.name for place in scene.train.pantographs))
    for name in names:
        kind = scene.pantographs[name]
        if isinstance(kind, LumpedTable) and kind.roll is not None and not on and not said:
            yield _idle(scene, f"pantographs.{name}.roll", "head_roll")
    if not on:
        return
    rolling = [
        name for name in names if roll_of(pantograph_of(name, scene.pantographs[name], speed))
    ]
    for name in rolling:
        if scene.pantographs[name].strips.length_m is None:
            why = (
                f"it needs pantographs.{name}.strips.length_m, the strip that the wire moves along"
            )
            yield scene.refused("effects.head_roll", why)


def _idle(scene: Scene, key: str, effect: str) -> Fault:
    return scene.fault(
        key, f"acts only with effects.{effect} = true; write that, or false to leave it out"
    )


def _multibody_strips(scene: Scene) -> Iterator[Fault]:
    for name in dict.fromkeys(place.name for place in scene.train.pantographs):
        kind = scene.pantographs[name]
        if not isinstance(kind, MultibodyTable) or kind.strips.mass_kg is None:
            continue
        from catenary.mbs.mechanism.pantograph_data import stand

        data = pantograph_of(name, kind, scene.train.speed_km_h)
        mass = stand(data).head.mass  # type: ignore[arg-type]
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
    duration = (end - start) / (scene.train.speed_km_h / 3.6)
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
                key = f"vehicle.{direction}.{name}"
                yield scene.fault(
                    key,
                    f"holds from {first:g} to {last:g} {unit}, but "
                    f"the run needs it from {low:g} to {high:.5g} {unit}",
                )


def _waves(scene: Scene) -> Iterator[Fault]:
    if scene.vehicle is None or scene.vehicle.irregularity is None:
        return
    step = scene.train.speed_km_h / 3.6 * scene.numerics.dt_s
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
    """Where the wire is farthest from the middle of a pantograph's strips on its run, and the
    pantograph's place then [m]."""
    place, speed = scene.train.pantographs[number], scene.train.speed_km_h / 3.6
    start = scene.train.start_m - place.behind_m
    duration = (end_of(scene) - scene.train.start_m) / speed
    offsets = np.array([1.0, -1.0]) * strips_ahead(scene)[number]
    base = None
    if scene.switches()["vehicle_motion"] and scene.vehicle is not None:
        from catenary.mbs.vehicle.base_motion import BaseMotion

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
