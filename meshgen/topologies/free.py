"""Free line: wires and links from tables, for what no other topology has foreseen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.hardware import Clamps, Droppers, SteadyArms, Supports
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.free_data import FreeDroppers, FreeLink, FreeWire
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.registry import register
from catenary.meshgen.topologies.sag import Loads, sag_between
from catenary.meshgen.wires import End, Piece, Profile, Role, Wire

FREE = "free"
_Group = TypeVar("_Group", FreeDroppers, Clamps, SteadyArms, Supports)
_NOWHERE: tuple[float, ...] = ()


@register(FREE, ("wires", "links"))
def free_line(data: LineData) -> Line:
    """The wires and links of a scene's tables. Contact wires come first, the others as listed.

    A contact wire, a wire that droppers hang, and one that supports or arms are to hold at its
    height have that height at rest; the others hang between what carries them.

    Raises
    ------
    InputError
        If there is no contact wire, or wires are clamped to each other or hang from each other in a
        circle.
    """
    assert data.wires is not None and data.links is not None
    wires = {wire.name: wire for wire in data.wires}
    if not any(wire.role is Role.CONTACT for wire in wires.values()):
        raise InputError("no wire of the line has the role contact")
    droppers = _those(data.links, FreeDroppers)
    clamps = (*_those(data.links, Clamps), *_end_clamps(data.wires))
    loads = _loads(data, data.wires, droppers)
    made: dict[str, Wire] = {}
    for name in in_order((one.name, one.bearers) for one in data.wires):
        made[name] = _wire(data, wires[name], made, loads[name])
    listed = sorted((made[name] for name in wires), key=lambda one: one.role is not Role.CONTACT)
    return Line(
        data.span_lengths,
        data.n_transition,
        FREE,
        tuple(replace(wire, taken=_taken(wire.name, data.wires)) for wire in listed),
        tuple(_plain(group) for group in droppers),
        _those(data.links, SteadyArms),
        _those(data.links, Supports),
        clamps,
    )


def hung(data: LineData) -> set[str]:
    """Names of the wires that have a wanted height at rest."""
    assert data.wires is not None and data.links is not None
    found = {wire.name for wire in data.wires if wire.role is Role.CONTACT}
    found |= {link.lower for link in _those(data.links, FreeDroppers)}
    found |= {link.holds for link in _those(data.links, Supports) if link.holds}
    found |= {link.wire for link in _those(data.links, SteadyArms) if link.kind.holds_height}
    return found


def in_order(each_after: Iterable[tuple[str, Iterable[str]]]) -> list[str]:
    """Names, each after those that it comes after.

    Raises
    ------
    InputError
        If they come after each other in a circle.
    """
    try:
        return list(TopologicalSorter(dict(each_after)).static_order())
    except CycleError as circle:
        names = " to ".join(reversed(circle.args[1]))
        raise InputError(f"wires are joined in a circle: {names}") from None


def carriers(data: LineData, wire: FreeWire) -> np.ndarray:
    """Places at which something carries a wire: its ends, supports, clamps, droppers, ascending."""
    places = [x for stretch in wire.stretches for x in stretch]
    assert data.wires is not None and data.links is not None
    for link in data.links:
        if isinstance(link, Supports):
            here = wire.name == link.wire
        elif isinstance(link, SteadyArms):
            here = wire.name == link.wire and link.kind.holds_height
        else:
            here = wire.name == link.lower
        if here:
            places += link.lower_x if isinstance(link, FreeDroppers) else link.x
    if wire.role is Role.CONTACT:  # clamped wires carry it, others hang from what they clamp to
        for other in data.wires:
            ends = zip(other.clamped_to, (0, 1), strict=True)
            places += [s[end] for name, end in ends if name == wire.name for s in other.stretches]
    return np.unique(places)


def _those(links: tuple[FreeLink, ...], kind: type[_Group]) -> tuple[_Group, ...]:
    return tuple(link for link in links if isinstance(link, kind))


def _plain(group: FreeDroppers) -> Droppers:
    return Droppers(group.name, group.kind, group.upper, group.lower, group.upper_x, group.lower_x)


def _end_clamps(wires: tuple[FreeWire, ...]) -> tuple[Clamps, ...]:
    """Clamps at the ends of wires: the upper one is the wire that carries the other."""
    found = []
    for wire in wires:
        for bearer in wire.bearers:
            ends = [end for end, name in enumerate(wire.clamped_to) if name == bearer]
            x = sorted(stretch[end] for stretch in wire.stretches for end in ends)
            carries = next(one for one in wires if one.name == bearer).role is Role.CONTACT
            pair = (wire.name, bearer) if carries else (bearer, wire.name)
            name = f"{wire.name}_clamps" + (f"_on_{bearer}" if len(wire.bearers) > 1 else "")
            found.append(Clamps(name, wire.clamp_stiffness, wire.clamp_mass, *pair, tuple(x)))
    return tuple(found)


def _taken(name: str, wires: tuple[FreeWire, ...]) -> tuple[tuple[float, float, float], ...]:
    """Stretches over which wires that are clamped to a wire carry a part of its tension."""
    taken = [
        (*stretch, wire.conductor.tension)
        for wire in wires
        if name in wire.bearers
        for stretch in wire.stretches
    ]
    return tuple(sorted(taken))


def _loads(
    data: LineData, wires: tuple[FreeWire, ...], droppers: tuple[FreeDroppers, ...]
) -> dict[str, Loads]:
    """What is expected to hang from each wire: of wires below by their droppers, of clamped ones at
    their ends. For first guesses only."""
    by_name = {wire.name: wire for wire in wires}
    loads = {wire.name: Loads() for wire in wires}
    below: dict[str, list[str]] = {wire.name: [] for wire in wires}
    for group in droppers:
        below[group.upper].append(group.lower)
    for wire in wires:
        for bearer in wire.bearers:
            if by_name[bearer].role is not Role.CONTACT:
                below[bearer].append(wire.name)
    for name in in_order(below.items()):
        own, wire = loads[name], by_name[name]
        holding = [group for group in droppers if group.lower == name]
        at = carriers(data, wire)
        carried = own.shared(at, wire)
        for group in holding:
            loads[group.upper].add(group.upper_x, carried[np.searchsorted(at, group.lower_x)])
        for end, bearer in enumerate(wire.clamped_to):
            if bearer and not holding and by_name[bearer].role is not Role.CONTACT:
                for stretch in wire.stretches:
                    half = 0.5 * own.between(*stretch, wire.conductor.mass_per_length)
                    loads[bearer].add((stretch[end],), (half,))
    return loads


def _wire(data: LineData, free: FreeWire, made: dict[str, Wire], loads: Loads) -> Wire:
    """A wire with its pieces; those that it is clamped to are ``made``."""
    profile = _profile(data, free) if free.name in hung(data) else None
    at = np.concatenate([data.support_positions, carriers(data, free), loads.x])
    pieces = []
    for stretch in free.stretches:
        own = at[(at > stretch[0]) & (at < stretch[1])]
        x = np.unique([*stretch, *own, *_knots(free, stretch)])
        ends = np.array(stretch)
        clamps = [made[name] if name else None for name in free.clamped_to]
        z = _height(free, x, ends, clamps)
        if profile is None and not free.drawn:
            held = carriers(data, free)
            z = z - sag_between(x, held, loads, free.conductor)
        y = free.lateral.at(x) if free.lateral is not None else _beside(x, clamps)
        kinds = tuple(End.CLAMPED if clamp else End.HELD for clamp in clamps)
        pieces.append(
            Piece(
                tuple(x.tolist()),
                tuple(y.tolist()),
                tuple(z.tolist()),
                (kinds[0], kinds[1]),
                free.tensioned,
            )
        )
    return Wire.of(free.conductor, free.name, free.role, tuple(pieces), profile)


def _knots(free: FreeWire, stretch: tuple[float, float]) -> tuple[float, ...]:
    """Places inside a stretch at which a course given by points has a kink."""
    courses = (free.heights, free.lateral)
    given = {x for course in courses if course is not None for x in course.x}
    return tuple(x for x in given if stretch[0] < x < stretch[1])


def _height(
    free: FreeWire, x: np.ndarray, ends: np.ndarray, clamps: list[Wire | None]
) -> np.ndarray:
    """Heights of a piece without sag; clamped ends are where their wires are."""
    at_ends = free.heights.at(ends) if free.heights is not None else np.zeros(2)
    for end, clamp in enumerate(clamps):
        if clamp is not None:
            at_ends[end] = clamp.points(ends[end : end + 1])[0, 2]
    inner = free.heights.x if free.heights is not None else _NOWHERE
    inner = tuple(place for place in inner if ends[0] < place < ends[1])
    knots = np.array([ends[0], *inner, ends[1]])
    heights = free.heights.at(knots[1:-1]) if free.heights is not None else np.zeros(0)
    return np.interp(x, knots, np.concatenate([at_ends[:1], heights, at_ends[1:]]))


def _beside(x: np.ndarray, clamps: list[Wire | None]) -> np.ndarray:
    """Lateral places of the wires that a piece is clamped to, from the first over to the last."""
    sides = [clamp.points(x)[:, 1] for clamp in clamps if clamp is not None]
    if not sides:
        return np.zeros(x.size)
    over = (x - x[0]) / (x[-1] - x[0])
    return np.asarray(sides[0] + (sides[-1] - sides[0]) * over)


def _profile(data: LineData, free: FreeWire) -> Profile:
    """Heights wanted of a wire, with the pre-sag that its droppers give it."""
    assert free.heights is not None and data.links is not None
    masts = data.support_positions
    holding = [link for link in _those(data.links, FreeDroppers) if link.lower == free.name]
    x = np.concatenate([masts, *(link.lower_x for link in holding)])
    sag = np.concatenate([np.zeros(masts.size), *(link.pre_sag for link in holding)])
    order = np.argsort(x)
    height = float(free.heights.at(np.array(data.running_range))[0])
    above = [value - height for value in free.heights.value]
    course = (free.heights.x, tuple(above)) if any(above) else ((), ())
    return Profile(
        height,
        tuple(x[order].tolist()),
        tuple(sag[order].tolist()),
        (data.whole(data.transition_rise),),
        *course,
    )
