"""From wires and links to a line, which all topologies are made by.

What hangs on nothing but its own tension gets a first guess of its sag here; form finding gives the
heights.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.geometry import Cuts, cuts_at
from catenary.meshgen.line import Clamps, Droppers, Line, SteadyArms, Supports
from catenary.meshgen.topologies.line_data import FreeDroppers, FreeLink, FreeWire, LineData
from catenary.meshgen.wires import Conductor, End, Piece, Profile, Role, Taken, Wire

# Only for the first guess of a sag; equilibrium uses the scene's value [m/s2].
GRAVITY = 9.81
_Group = TypeVar("_Group", FreeDroppers, Clamps, SteadyArms, Supports)


def line_of(data: LineData) -> Line:
    """The line of listed wires and links. Contact wires come first, the others as listed.

    A contact wire, a wire that droppers hang, and one that supports or arms are to hold at its
    height have that height at rest; the others hang between what carries them.

    Raises
    ------
    InputError
        If there is no contact wire, or wires are clamped to each other or hang from each other in a
        circle.
    """
    wires, links = data.wires, data.links
    assert wires is not None and links is not None
    by_name = {wire.name: wire for wire in wires}
    if not any(wire.role is Role.CONTACT for wire in wires):
        raise InputError("no wire of the line has the role contact")
    hanging = _hanging(data)
    made: dict[str, Wire] = {}
    for name in in_order((one.name, one.bearers) for one in wires):
        made[name] = _wire(data, by_name[name], made, hanging[name])
    listed = sorted((made[name] for name in by_name), key=lambda one: one.role is not Role.CONTACT)
    return Line(
        data.span_lengths,
        data.n_transition,
        data.topology,
        tuple(replace(wire, taken=_taken(wire.name, wires)) for wire in listed),
        tuple(_plain(group) for group in _of_kind(links, FreeDroppers)),
        _of_kind(links, SteadyArms),
        _of_kind(links, Supports),
        (*_of_kind(links, Clamps), *_end_clamps(wires)),
        curve=data.curve,
        twins=data.twins,
    )


def hung(data: LineData) -> set[str]:
    """Names of the wires that have a wanted height at rest."""
    assert data.wires is not None and data.links is not None
    found = {wire.name for wire in data.wires if wire.role is Role.CONTACT}
    found |= {link.lower for link in _of_kind(data.links, FreeDroppers)}
    found |= {link.holds for link in _of_kind(data.links, Supports) if link.holds}
    found |= {link.wire for link in _of_kind(data.links, SteadyArms) if link.kind.holds_height}
    return found


def in_order(each_after: Iterable[tuple[str, Iterable[str]]]) -> list[str]:
    """Names in topological order; ``each_after`` are pairs of a name and its predecessors.

    Raises
    ------
    InputError
        If names precede each other in a circle.
    """
    try:
        return list(TopologicalSorter(dict(each_after)).static_order())
    except CycleError as circle:
        names = " to ".join(reversed(circle.args[1]))
        raise InputError(f"wires are joined in a circle: {names}") from None


def carriers(data: LineData, wire: FreeWire) -> np.ndarray:
    """Places at which a wire is carried: its ends, supports, clamps, droppers, ascending [m]."""
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


def cuts_of(data: LineData) -> Cuts:
    """Places at which the wires are cut: masts, ends of wires, and links."""
    assert data.wires is not None and data.links is not None
    ends = [x for wire in data.wires for stretch in wire.stretches for x in stretch]
    hanging, placed = [], []
    for link in data.links:
        if isinstance(link, FreeDroppers):
            hanging += [link.upper_x, link.lower_x]
        else:
            placed.append(link.x)
    return cuts_at(data.support_positions, ends, *hanging, *placed)


def _of_kind(links: tuple[FreeLink, ...], kind: type[_Group]) -> tuple[_Group, ...]:
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
            name = wire.clamps or f"{wire.name}_clamps"
            name += f"_on_{bearer}" if len(wire.bearers) > 1 else ""
            found.append(Clamps(name, wire.clamp_stiffness, wire.clamp_mass, *pair, tuple(x)))
    return tuple(found)


def _taken(name: str, wires: tuple[FreeWire, ...]) -> tuple[Taken, ...]:
    """Stretches over which wires that are clamped to a wire carry a part of its tension."""
    taken = [
        Taken(*stretch, wire.conductor.tension, wire.name)
        for wire in wires
        if name in wire.bearers
        for stretch in wire.stretches
    ]
    return tuple(sorted(taken))


def _hanging(data: LineData) -> dict[str, np.ndarray]:
    """Places [m] and masses [kg], (2, n), that are expected to hang from each wire: of wires below
    by their droppers, of clamped ones at their ends. For first guesses only.

    What carries a wire has half of it, and of what hangs from it, up to either neighbour.
    """
    assert data.wires is not None and data.links is not None
    by_name = {wire.name: wire for wire in data.wires}
    joints = [
        (group.lower, group.upper, group.lower_x, group.upper_x)
        for group in _of_kind(data.links, FreeDroppers)
    ]
    for wire in data.wires:
        for x, bearer in zip(zip(*wire.stretches, strict=True), wire.clamped_to, strict=True):
            if bearer and by_name[bearer].role is not Role.CONTACT:
                joints.append((wire.name, bearer, x, x))
    below: dict[str, list[str]] = {wire.name: [] for wire in data.wires}
    found = {wire.name: np.zeros((2, 0)) for wire in data.wires}
    for lower, upper, _, _ in joints:
        below[upper].append(lower)
    for name in in_order(below.items()):
        wire, (x, mass) = by_name[name], found[name]
        at, ends = carriers(data, wire), np.array(wire.stretches)
        passed = np.repeat(np.cumsum([0.0, *np.diff(ends)[:, 0]]), 2)[1:-1]
        bounds = np.concatenate([ends[0, :1], 0.5 * (at[1:] + at[:-1]), ends[-1, 1:]])
        own = wire.conductor.mass_per_length * np.diff(np.interp(bounds, ends.ravel(), passed))
        carried = own + np.histogram(x, bounds, weights=mass)[0]
        for lower, upper, low, high in joints:
            if lower == name:
                more = np.array([high, carried[np.searchsorted(at, low)]])
                found[upper] = np.concatenate([found[upper], more], axis=1)
    return found


def _sag(x: np.ndarray, held: np.ndarray, hanging: np.ndarray, wire: Conductor) -> np.ndarray:
    """Sag (n,) of a string at places ``x`` (n,) below straight lines between places ``held`` (m,),
    ascending; ``hanging`` (2, k) are places and masses of what hangs from it."""
    at, mass = hanging[:, np.argsort(hanging[0])]
    sums = np.cumsum(np.pad([mass, mass * at], ((0, 0), (1, 0))), axis=1)

    def moment(x: np.ndarray) -> np.ndarray:
        masses, levers = sums[:, np.searchsorted(at, x)]
        return np.asarray(masses * x - levers)

    gap = np.clip(np.searchsorted(held, x, side="right") - 1, 0, held.size - 2)
    own = 0.5 * wire.mass_per_length * (x - held[gap]) * (held[gap + 1] - x)
    return GRAVITY * (own + np.interp(x, held, moment(held)) - moment(x)) / wire.tension


def _wire(data: LineData, free: FreeWire, made: dict[str, Wire], hanging: np.ndarray) -> Wire:
    """A wire with its pieces; the wires that it is clamped to are ``made``."""
    profile = _profile(data, free) if free.name in hung(data) else None
    held, ends = carriers(data, free), np.array(free.stretches).reshape(-1, 2)
    clamps = [made[name] if name else None for name in free.clamped_to]
    courses = [np.array(own.x) for own in (free.heights, free.lateral) if own is not None]
    between = [] if profile is not None else [held, hanging[0]]
    x = np.unique(np.concatenate([data.support_positions, ends.ravel(), *courses, *between]))
    y = free.lateral.at(x) if free.lateral is not None else _beside(x, ends, clamps)
    if profile is not None:
        z = profile.level(x)
    else:
        z = _straight(free, x, ends, clamps)
        z -= 0.0 if free.drawn else _sag(x, held, hanging, free.conductor)
    kinds = [End.CLAMPED if clamp else End.HELD for clamp in clamps]
    pieces = []
    for first, last in np.searchsorted(x, ends):
        along, left, up = (tuple(row[first : last + 1].tolist()) for row in (x, y, z))
        pieces.append(Piece(along, left, up, (kinds[0], kinds[1]), free.tensioned))
    return Wire.of(free.conductor, free.name, free.role, tuple(pieces), profile)


def _straight(
    free: FreeWire, x: np.ndarray, ends: np.ndarray, clamps: list[Wire | None]
) -> np.ndarray:
    """Heights of pieces without sag; clamped ends are where their wires are."""
    inner = () if free.heights is None else free.heights.x
    knots = np.unique(np.concatenate([ends.ravel(), inner]))
    heights = np.zeros(knots.size) if free.heights is None else free.heights.at(knots)
    for side, clamp in enumerate(clamps):
        if clamp is not None:
            at = ends[:, side]
            heights[np.searchsorted(knots, at)] = clamp.points(at)[:, 2]
    return np.interp(x, knots, heights)


def _beside(x: np.ndarray, ends: np.ndarray, clamps: list[Wire | None]) -> np.ndarray:
    """Lateral positions of the wires that pieces are clamped to, from the first to the last."""
    sides = [clamp.points(x)[:, 1] for clamp in clamps if clamp is not None]
    if not sides:
        return np.zeros(x.size)
    starts, stops = ends[np.clip(np.searchsorted(ends[:, 0], x, side="right") - 1, 0, None)].T
    return np.asarray(sides[0] + (sides[-1] - sides[0]) * (x - starts) / (stops - starts))


def _profile(data: LineData, free: FreeWire) -> Profile:
    """Heights wanted of a wire, with the pre-sag that its droppers give it."""
    assert free.heights is not None and data.links is not None
    masts = data.support_positions
    holding = [link for link in _of_kind(data.links, FreeDroppers) if link.lower == free.name]
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
        free.sections or data.sections,
        *course,
    )
