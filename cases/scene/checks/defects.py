"""Whether a line can have a scene's irregularities, defects and fittings, and incidents happen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from catenary.cases.scene.checks.pantographs import reaches_below
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.imperfections import (
    DropperDefectTable,
    HardSpotTable,
    KinkTable,
    WornWireTable,
    WrongTensionTable,
    stretch_of,
)
from catenary.cases.scene.run.incidents import (
    DropperBreakTable,
    IncidentTable,
    LoweringTable,
    TensionLossTable,
)
from catenary.cases.scene.scene import Scene, end_of, line_of
from catenary.meshgen.line import Line
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import SAME_PLACE, End, Piece, Role, Wire
from catenary.postproc.evaluate.wording import counted
from catenary.solver.effects.effect import Limit

# More waves than these along a line take more memory than its motion.
MOST_WAVES = 400_000


def check_defects(scene: Scene, data: LineData) -> Iterator[Fault]:
    """Irregularities, fittings and defects that the line cannot have; its wires must be known."""
    line = line_of(scene)
    yield from _irregularities(scene, line)
    yield from _fittings(scene, line)
    seen: dict[tuple[object, ...], str] = {}
    for i, table in enumerate(scene.defects):
        key = f"defects.{i}"
        if isinstance(table, DropperDefectTable):
            which = table.span, table.dropper
            found = list(dropper_faults(scene, line, key, *which))
            yield from found or _twice(scene, seen, f"{key}.dropper", which)
            continue
        assert isinstance(table, WornWireTable | WrongTensionTable | HardSpotTable | KinkTable)
        wire = line.wire(table.wire)
        if isinstance(table, WornWireTable):
            for name in ("from_m", "to_m"):
                yield from _place(scene, wire, f"{key}.{name}", getattr(table, name))
            yield from _worn_twice(scene, i, table)
        elif isinstance(table, WrongTensionTable):
            what = "tension", table.wire
            yield from _twice(scene, seen, f"{key}.wire", what)
            yield from _wrong_tension(scene, line, wire, f"{key}.factor", table.factor)
        else:
            yield from _place(scene, wire, f"{key}.at_m", table.at_m)
            if isinstance(table, KinkTable) and wire.role is not Role.CONTACT:
                yield scene.refused(f"{key}.wire", "strips run on contact wires only")
            elif isinstance(table, KinkTable) and not wire.bending_stiffness:
                why = f"{wire.name} has no bending stiffness, and so keeps no bend under tension"
                yield scene.refused(f"{key}.angle_deg", why)
    yield from _broken_later(scene, seen)
    yield from _left_nothing(scene, line, line, _wrong_tensions(scene))


def _irregularities(scene: Scene, line: Line) -> Iterator[Fault]:
    for name in ("contact_wire_height", "running_surface"):
        table = getattr(scene.irregularities, name)
        if table is None:
            continue
        key, length = f"irregularities.{name}", line.support_positions[-1]
        for i, (x, _) in enumerate(table.by_place or []):
            if not -SAME_PLACE <= x <= length + SAME_PLACE:
                why = f"the line runs from 0 to {length:g} m"
                yield scene.refused(f"{key}.by_place.{i}.0", why)
        if table.standard_deviation_mm is None:
            continue
        start, end = stretch_of(table, line)
        for part, value in (("from_m", table.from_m), ("to_m", table.to_m)):
            if value is not None and value > length + SAME_PLACE:
                yield scene.refused(f"{key}.{part}", f"the line ends at {length:g} m")
        if end <= start and table.to_m is not None:
            why = f"it must be greater than the {start:g} m where they begin"
            yield scene.refused(f"{key}.to_m", why)
        elif end - start < table.shortest_m:
            why = f"no wave of shortest_m = {table.shortest_m:g} m fits from {start:g} to {end:g} m"
            part = "shortest_m" if table.from_m is None else "from_m"
            yield scene.refused(f"{key}.{part}", why)
        if (end - start) / table.shortest_m > MOST_WAVES:
            why = f"it must be at least {(end - start) / MOST_WAVES:.3g} m on {end - start:g} m"
            yield scene.refused(f"{key}.shortest_m", why)
    lengths = scene.irregularities.dropper_lengths
    seen: dict[tuple[object, ...], str] = {}
    for i, (span, dropper, _) in enumerate((lengths and lengths.by_dropper) or []):
        entry = f"irregularities.dropper_lengths.by_dropper.{i}"
        yield from _twice(scene, seen, f"{entry}.1", (span, dropper))
        yield from dropper_faults(scene, line, entry, int(span), int(dropper), (".0", ".1"))


def _fittings(scene: Scene, line: Line) -> Iterator[Fault]:
    for i, table in enumerate(scene.line.fittings):
        key, wire = f"line.fittings.{i}", line.wire(table.wire)
        yield from _place(scene, wire, f"{key}.at_m", table.at_m)
        end = table.at_m + table.length_m
        if _is_at(wire, table.at_m) and not _is_at(wire, end):
            why = f"it would end at {end:g} m, where {wire.name} is not"
            yield scene.refused(f"{key}.length_m", why)


def _place(scene: Scene, wire: Wire, key: str, x: float) -> Iterator[Fault]:
    if not _is_at(wire, x):
        pieces = [f"{piece.x[0]:g} to {piece.x[-1]:g} m" for piece in wire.pieces]
        more = " and so on" if len(pieces) > 3 else ""
        yield scene.refused(key, f"{wire.name} runs from {', '.join(pieces[:3])}{more}")
        return
    ends = [place for piece in wire.pieces for place in _held_ends(piece)]
    periodic = "periodic" in (scene.line.ends.start.kind, scene.line.ends.end.kind)
    if not periodic and any(abs(place - x) < SAME_PLACE for place in ends):
        yield scene.refused(key, f"{wire.name} ends there, where it is held and nothing moves it")


def _held_ends(piece: Piece) -> list[float]:
    """Places where a piece ends without a clamp to another wire [m]."""
    ends = zip((piece.x[0], piece.x[-1]), piece.ends, strict=True)
    return [place for place, end in ends if end is not End.CLAMPED]


def _is_at(wire: Wire, x: float) -> bool:
    return any(piece.x[0] - SAME_PLACE <= x <= piece.x[-1] + SAME_PLACE for piece in wire.pieces)


def dropper_faults(
    scene: Scene,
    line: Line,
    key: str,
    span: int,
    dropper: int,
    parts: tuple[str, str] = (".span", ".dropper"),
) -> Iterator[Fault]:
    """The fault of a number of a span, or of a dropper in it, that the line does not have.

    ``span`` and ``dropper`` count from 1; ``parts`` complete ``key`` to the key of each.
    """
    if span > line.n_spans:
        yield scene.refused(key + parts[0], f"the line has {counted(line.n_spans, 'span')}")
        return
    n = len(line.droppers_of_span(span - 1))
    if dropper > n:
        yield scene.refused(key + parts[1], f"span {span} has {counted(n, 'dropper')}")


def _twice(
    scene: Scene, seen: dict[tuple[object, ...], str], key: str, what: tuple[object, ...]
) -> Iterator[Fault]:
    if what in seen:
        yield scene.refused(key, f"{seen[what]} has this already; take one of them away")
    seen.setdefault(what, key.rsplit(".", 1)[0])


def _worn_twice(scene: Scene, i: int, table: WornWireTable) -> Iterator[Fault]:
    for j, other in enumerate(scene.defects[:i]):
        if not isinstance(other, WornWireTable) or other.wire != table.wire:
            continue
        if other.from_m < table.to_m and table.from_m < other.to_m:
            why = f"defects.{j} has a stretch of {table.wire} that reaches into this one"
            yield scene.refused(f"defects.{i}.from_m", why)


def taken_faults(scene: Scene, wire: Wire, key: str, share: float) -> Iterator[Fault]:
    """A share of its tension that wires which are clamped to a wire take."""
    most = wire.most_taken
    if share * wire.tension <= most:
        why = (
            f"wires that are clamped to {wire.name} take {most:g} N of its {wire.tension:g} N: it "
            f"must be greater than {most / wire.tension:.3g}"
        )
        yield scene.refused(key, why)


# A wire whose tension is another one: the key, the wire, and the share of its tension.
_Change = tuple[str, str, float]


def _wrong_tensions(scene: Scene) -> list[_Change]:
    if not scene.switches()["wrong_tension"]:
        return []
    return [
        (f"defects.{i}.factor", table.wire, table.factor)
        for i, table in enumerate(scene.defects)
        if isinstance(table, WrongTensionTable)
    ]


def _left_nothing(
    scene: Scene, sound: Line, line: Line, changes: Iterable[_Change]
) -> Iterator[Fault]:
    """The first of some changes with which clamped wires take all that a wire has.

    What the ``sound`` line does not allow by itself is said elsewhere.
    """
    shares: dict[str, float] = {}
    for key, name, share in changes:
        if share * sound.wire(name).tension <= sound.wire(name).most_taken:
            return
        shares[name] = share
        for wire in line.with_shares(shares).wires:
            if wire.taken and wire.tension <= wire.most_taken:
                why = (
                    f"wires that are clamped to {wire.name} would then take {wire.most_taken:g} N "
                    f"of its {wire.tension:g} N"
                )
                yield scene.refused(key, why)
                return


def _wrong_tension(
    scene: Scene, line: Line, wire: Wire, key: str, factor: float
) -> Iterator[Fault]:
    yield from taken_faults(scene, wire, key, factor)
    if wire.role is not Role.CONTACT or not scene.holds(Limit.WAVE_SPEED):
        return
    wave = 3.6 * slowest_wave_of(line, wire, factor)
    if scene.switches()["wrong_tension"] and scene.train.speed_km_h >= wave:
        why = (
            f"the wave speed of {wire.name} would be {wave:.1f} km/h, not above train.speed_km_h = "
            f"{scene.train.speed_km_h:g}, which needs effects.supercritical_speed = true"
        )
        yield scene.refused(key, why)


def _broken_later(scene: Scene, seen: dict[tuple[object, ...], str]) -> Iterator[Fault]:
    for i, incident in enumerate(scene.incidents):
        if isinstance(incident, DropperBreakTable):
            entry = seen.get((incident.span, incident.dropper))
            if entry is not None:
                why = f"{entry} lets this one carry nothing from the start"
                yield scene.refused(f"incidents.{i}.dropper", why)


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
    losses = sorted(
        (table.at_s, f"incidents.{i}.share", table.wire, table.share)
        for i, table in enumerate(scene.incidents)
        if isinstance(table, TensionLossTable)
    )
    if losses:
        sound, changes = make_line(line), [loss[1:] for loss in losses]
        wrong = {name: factor for _, name, factor in _wrong_tensions(scene)}
        yield from _left_nothing(scene, sound, sound.with_shares(wrong), changes)


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
    last = math.floor(duration / dt + 1e-9)
    if round(table.at_s / dt) >= last:
        why = f"it must be at most {(last - 1) * dt:.8g} s, a step before the run ends"
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
