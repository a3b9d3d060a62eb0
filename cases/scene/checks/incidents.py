"""Whether what is to happen during a run can happen to its line and its pantographs."""

from __future__ import annotations

import math
from collections.abc import Iterator

from catenary.cases.scene.checks.defects import dropper_faults, taken_faults
from catenary.cases.scene.checks.pantographs import reaches_below
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.problem import end_of
from catenary.cases.scene.run.incidents import (
    DropperBreakTable,
    IncidentTable,
    LoweringTable,
    TensionLossTable,
)
from catenary.cases.scene.scene import Scene
from catenary.meshgen.line import Line
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Role, Wire
from catenary.postproc.evaluate.wording import counted
from catenary.solver.effects.effect import Limit


def check_incidents(scene: Scene, line: LineData) -> Iterator[Fault]:
    """The incidents that cannot be."""
    seen: dict[tuple[object, ...], int] = {}
    duration = (end_of(scene) - scene.train.start_m) / (scene.train.speed_km_h / 3.6)
    for i, table in enumerate(scene.incidents):
        key, what = _what(scene, table)
        if what in seen:
            why = f"this happens in incidents.{seen[what]} already; take one of them away"
            yield scene.refused(f"incidents.{i}.{key}", why)
            continue
        seen[what] = i
        yield from _time(scene, i, table, duration)
        if isinstance(table, DropperBreakTable):
            yield from _dropper(scene, i, table, line)
        elif isinstance(table, TensionLossTable):
            yield from _tension(scene, i, table, line)
        else:
            assert isinstance(table, LoweringTable)
            yield from _lowering(scene, i, table, line)
    yield from _tensions_fall(scene)


def _what(scene: Scene, table: IncidentTable) -> tuple[str, tuple[object, ...]]:
    """The key that would have to differ, and the event that cannot happen twice."""
    if isinstance(table, DropperBreakTable):
        return "dropper", ("dropper", table.span, table.dropper)
    if isinstance(table, TensionLossTable):
        return "at_s", ("tension", table.wire, round(table.at_s / scene.numerics.dt_s))
    assert isinstance(table, LoweringTable)
    return "pantograph", ("pantograph", table.pantograph)


def _tensions_fall(scene: Scene) -> Iterator[Fault]:
    """Losses of tension that would give a wire back some of it, or change nothing.

    Shares are of the tension at the start, which is easily taken for the tension before.
    """
    latest: dict[str, int] = {}
    losses = [
        (round(table.at_s / scene.numerics.dt_s), i, table)
        for i, table in enumerate(scene.incidents)
        if isinstance(table, TensionLossTable)
    ]
    for _, i, table in sorted(losses, key=lambda loss: loss[:2]):
        if table.wire in latest:
            before = scene.incidents[latest[table.wire]]
            assert isinstance(before, TensionLossTable)
            if table.share >= before.share:
                why = (
                    f"it must be less than the {before.share:g} that incidents.{latest[table.wire]}"
                    f" leaves at {before.at_s:g} s: both are shares of the tension at the start"
                )
                yield scene.refused(f"incidents.{i}.share", why)
        latest[table.wire] = i


def _time(scene: Scene, i: int, table: IncidentTable, duration: float) -> Iterator[Fault]:
    dt = scene.numerics.dt_s
    if round(table.at_s / dt) >= math.floor(duration / dt + 1e-9):
        why = f"it must be less than the {duration:.4g} s that the run lasts"
        yield scene.refused(f"incidents.{i}.at_s", why)


def _hangs(scene: Scene, i: int) -> Iterator[Fault]:
    if not scene.switches().get("gravity", True):
        why = "effects.gravity is off: a line that does not hang has no balance to lose"
        yield scene.refused(f"incidents.{i}.type", why)


def _dropper(scene: Scene, i: int, table: DropperBreakTable, line: LineData) -> Iterator[Fault]:
    yield from _hangs(scene, i)
    yield from dropper_faults(scene, make_line(line), f"incidents.{i}", table.span, table.dropper)


def _tension(scene: Scene, i: int, table: TensionLossTable, line: LineData) -> Iterator[Fault]:
    yield from _hangs(scene, i)
    whole, key = make_line(line), f"incidents.{i}.share"
    wire = whole.wire(table.wire)
    taken = list(taken_faults(scene, wire, key, table.share))
    yield from taken
    if taken or wire.role is not Role.CONTACT or not scene.holds(Limit.WAVE_SPEED):
        return
    speed = scene.train.speed_km_h / 3.6
    wave = slowest_wave_of(whole, wire, table.share)
    if speed >= wave:
        least = _least_share(whole, wire, speed)
        why = (
            f"the wave speed of the contact wire would fall to {3.6 * wave:.1f} "
            f"km/h: it must be greater than {least:.3g} at train.speed_km_h = "
            f"{scene.train.speed_km_h:g} unless effects.supercritical_speed = true"
        )
        yield scene.refused(key, why)


def _least_share(line: Line, wire: Wire, speed: float) -> float:
    """Share of its tension at which the slowest wave of a wire is as fast as a train [m/s], which
    it is not faster than with all of it; 1 at most."""
    from scipy import optimize  # for lines with a fault only

    def faster(share: float) -> float:
        return slowest_wave_of(line, wire, share) - speed

    return 1.0 if faster(1.0) <= 0.0 else float(optimize.brentq(faster, 0.0, 1.0))


def _lowering(scene: Scene, i: int, table: LoweringTable, line: LineData) -> Iterator[Fault]:
    n = len(scene.train.pantographs)
    if table.pantograph > n:
        noun = counted(n, "pantograph")
        yield scene.refused(f"incidents.{i}.pantograph", f"the train has {noun}")
        return
    why = ""
    if scene.contact.law == "kinematic":
        why = 'contact.law is "kinematic", which holds only while contact lasts'
    elif not scene.switches().get("contact_loss", True):
        why = "effects.contact_loss is off: the wire would hold the head"
    if why:
        yield scene.refused(f"incidents.{i}.type", why)
        return
    name = scene.train.pantographs[table.pantograph - 1].name
    if not reaches_below(scene, name, line, table.drop_m):
        why = f"the mechanism of pantographs.{name} does not reach down so far; take a smaller one"
        yield scene.refused(f"incidents.{i}.drop_m", why)
