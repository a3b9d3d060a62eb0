"""From wires and links to a line, which all topologies are made by.

What hangs on nothing but its own tension gets a first guess of its sag here; form finding gives the
heights.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    droppers = _of_kind(links, FreeDroppers)
    loads = _loads(data, wires, droppers)
    made: dict[str, Wire] = {}
    for name in in_order((one.name, one.bearers) for one in wires):
        made[name] = _wire(data, by_name[name], made, loads[name])
    listed = sorted((made[name] for name in by_name), key=lambda one: one.role is not Role.CONTACT)
    return Line(
        data.span_lengths,
        data.n_transition,
        data.topology,
        tuple(replace(wire, taken=_taken(wire.name, wires)) for wire in listed),
        tuple(_plain(group) for group in droppers),
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


def _loads(
    data: LineData, wires: tuple[FreeWire, ...], droppers: tuple[FreeDroppers, ...]
) -> dict[str, Loads]:
    """Expected loads that hang from each wire: of wires below by their droppers, of clamped ones at
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
                ends = np.array(wire.stretches)
                whole = wire.conductor.mass_per_length * np.diff(ends) + np.diff(own.before(ends))
                loads[bearer].add(ends[:, end], 0.5 * whole[:, 0])
    return loads


class Loads:
    """Masses that hang from a wire at places along the line."""

    def __init__(self) -> None:
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []

    def add(self, x: Sequence[float] | np.ndarray, mass: Sequence[float] | np.ndarray) -> None:
        """Further masses [kg] at places ``x`` [m]."""
        self._parts.append((np.asarray(x, dtype=float), np.asarray(mass, dtype=float)))

    @property
    def sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Places, ascending, and masses there."""
        x = np.concatenate([np.zeros(0), *(part[0] for part in self._parts)])
        mass = np.concatenate([np.zeros(0), *(part[1] for part in self._parts)])
        order = np.argsort(x, kind="stable")
        return x[order], mass[order]

    @property
    def x(self) -> np.ndarray:
        """Places, ascending [m]."""
        return self.sorted[0]

    def before(self, x: np.ndarray) -> np.ndarray:
        """Mass of all that hangs before places ``x``, shape as ``x`` [kg]."""
        at, mass = self.sorted
        return np.asarray(np.concatenate([[0.0], np.cumsum(mass)])[np.searchsorted(at, x)])

    def shared(self, carriers: np.ndarray, wire: FreeWire) -> np.ndarray:
        """Masses (n,) that a wire's ``carriers``, at ascending places (n,) [m], carry [kg].

        Each carries the wire, and the masses that hang from it, half-way to either neighbour.
        """
        ends = wire.stretches[0][0], wire.stretches[-1][1]
        between = 0.5 * (carriers[1:] + carriers[:-1])
        bounds = np.concatenate([ends[:1], between, ends[1:]])
        own = wire.conductor.mass_per_length * np.diff(bounds)
        return np.asarray(own + np.diff(self.before(bounds)))


def sag_between(x: np.ndarray, held: np.ndarray, loads: Loads, wire: Conductor) -> np.ndarray:
    """Sag of a string below the straight line between neighbouring places ``held`` (m,).

    Parameters
    ----------
    x : ndarray, shape (n,)
        Places between the first and the last of ``held`` [m].
    held : ndarray, shape (m,)
        Places at which the string is held, ascending [m].
    loads : Loads
        Loads per length and single loads.
    wire : Conductor
        Conductor, whose tension counts.
    """
    at, mass = loads.sorted
    inside = (at > held[0]) & (at < held[-1])
    at, mass = at[inside], mass[inside]
    gap = np.clip(np.searchsorted(held, x, side="right") - 1, 0, held.size - 2)
    of_load = np.searchsorted(held, at, side="right") - 1
    length = np.diff(held)
    # Moments as of a beam on two supports: reaction on the left, own weight, loads passed.
    lever = mass * (held[of_load + 1] - at) / length[of_load]
    reaction = 0.5 * wire.mass_per_length * length
    reaction += np.bincount(of_load, lever, minlength=length.size)
    along = x - held[gap]
    levers = at - held[of_load]
    sums = [np.concatenate([[0.0], np.cumsum(part)]) for part in (mass, mass * levers)]
    first, passed = np.searchsorted(at, held[gap]), np.searchsorted(at, x)
    masses, moments = (part[passed] - part[first] for part in sums)
    moment = reaction[gap] * along - 0.5 * wire.mass_per_length * along**2
    sag = GRAVITY * (moment - masses * along + moments) / wire.tension
    return np.where(np.isin(x, held), 0.0, sag)


def _wire(data: LineData, free: FreeWire, made: dict[str, Wire], loads: Loads) -> Wire:
    """A wire with its pieces; the wires that it is clamped to are ``made``."""
    profile = _profile(data, free) if free.name in hung(data) else None
    held, ends = carriers(data, free), np.array(free.stretches).reshape(-1, 2)
    clamps = [made[name] if name else None for name in free.clamped_to]
    courses = [np.array(own.x) for own in (free.heights, free.lateral) if own is not None]
    hanging = [] if profile is not None else [held, loads.x]
    x = np.unique(np.concatenate([data.support_positions, ends.ravel(), *courses, *hanging]))
    y = free.lateral.at(x) if free.lateral is not None else _beside(x, ends, clamps)
    if profile is not None:
        z = profile.level(x)
    else:
        z = _straight(free, x, ends, clamps)
        z -= 0.0 if free.drawn else sag_between(x, held, loads, free.conductor)
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
