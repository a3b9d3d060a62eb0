"""The topologies by name, which wires and links the line of each has, and the way to a line.

To add one, write a function and ``register`` it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import Line, SteadyArms, Supports
from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE, STEADY_ARMS, SUPPORTS
from catenary.meshgen.topologies.free import line_of
from catenary.meshgen.topologies.line_data import (
    ClampedWire,
    Course,
    FreeDroppers,
    FreeLink,
    FreeWire,
    LineData,
)
from catenary.meshgen.topologies.overlaps import with_overlaps
from catenary.meshgen.wires import Conductor, Role

SIMPLE, COMPOUND, STITCHED, SINGLE = "simple", "compound", "stitched", "single"
TWIN, TWIN_MESSENGER, FREE = "twin", "twin_messenger", "free"
AUXILIARY_WIRE, AUXILIARY_DROPPERS = "auxiliary_wire", "auxiliary_droppers"
STITCH_WIRE, STITCH_DROPPERS, STITCH_CLAMPS = "stitch_wire", "stitch_droppers", "stitch_clamps"
BRIDLE_WIRE, BRIDLE_CLAMPS = "bridle_wire", "bridle_clamps"
# Parts of most topologies: wires hang by droppers from a messenger wire.
HUNG = ("contact_wire", "messenger_wire", "dropper")


class Parts(NamedTuple):
    """What a line is made of: wires, contact wires first, what joins and carries them, and pairs of
    like wires side by side, the second one of each before the first one."""

    wires: tuple[FreeWire, ...]
    links: tuple[FreeLink, ...]
    twins: tuple[tuple[str, str], ...] = ()


Listing = Callable[[LineData], Parts]


class Topology(NamedTuple):
    """A topology: the function that lists its wires and links, and parts of ``LineData``.

    ``parts`` must be given for this topology, ``may`` may be; further ones must not.
    """

    list_parts: Listing
    parts: tuple[str, ...]
    may: tuple[str, ...]


_TOPOLOGIES: dict[str, Topology] = {}


def register(
    name: str, parts: tuple[str, ...] = HUNG, may: tuple[str, ...] = ()
) -> Callable[[Listing], Listing]:
    """Decorator that registers a function as the one that lists what the topology ``name`` has.

    Parameters
    ----------
    name : str
        Name of the topology.
    parts : tuple of str, optional
        Fields of ``LineData`` that it needs.
    may : tuple of str, optional
        Fields that it uses if they are given.

    Raises
    ------
    ValueError
        If there is a topology of that name.
    """

    def keep(list_parts: Listing) -> Listing:
        if name in _TOPOLOGIES:
            raise ValueError(f"topology {name} is registered already")
        _TOPOLOGIES[name] = Topology(list_parts, parts, may)
        return list_parts

    return keep


def unregister(name: str) -> None:
    """Take a topology out of the table again."""
    del _TOPOLOGIES[name]


def registered() -> dict[str, Topology]:
    """The topologies registered so far by name."""
    return dict(_TOPOLOGIES)


def make_line(data: LineData) -> Line:
    """The line of the topology that ``data`` names.

    Raises
    ------
    InputError
        If there is no such topology, or the data make no line.
    """
    return _made(listed(data))


def listed(data: LineData) -> LineData:
    """The data with all wires and links of the line listed, as they are of a free line.

    Raises
    ------
    InputError
        If there is no such topology, or it lacks a part.
    """
    topology = registered().get(data.topology)
    if topology is None:
        known = ", ".join(sorted(registered()))
        raise InputError(f"the topology {data.topology} is unknown; it must be one of: {known}")
    for part in topology.parts:
        if getattr(data, part) is None:
            raise InputError(f"the topology {data.topology} needs {part}")
    return _listed(topology, data)


# Checks and runs of a scene ask for them many times.
@lru_cache(maxsize=16)
def _listed(topology: Topology, data: LineData) -> LineData:
    wires, links, twins = topology.list_parts(data)
    whole = replace(data, wires=wires, links=links, twins=twins)
    return whole if data.overlaps is None else with_overlaps(whole, data.overlaps)


_made = lru_cache(maxsize=16)(line_of)


def second(name: str) -> str:
    """Name of the second wire or group of a pair."""
    return f"{name}_2"


@register(SIMPLE)
def simple_catenary(data: LineData) -> Parts:
    """A contact wire that droppers hang from a messenger wire straight above the track."""
    wires = _contact(data), _messenger(data)
    return Parts(wires, (_droppers(data), _arms(data), _supports(data)))


@register(COMPOUND, (*HUNG, "auxiliary_wire"))
def compound_catenary(data: LineData) -> Parts:
    """The contact wire hangs from an auxiliary wire, which hangs level from the messenger wire."""
    auxiliary = data.auxiliary_wire
    assert auxiliary is not None
    top = data.contact_height + auxiliary.height
    level = _wire(data, auxiliary.conductor, AUXILIARY_WIRE, Role.AUXILIARY, top)
    x = tuple(data.along(auxiliary.dropper_positions).tolist())
    names = AUXILIARY_DROPPERS, auxiliary.dropper, MESSENGER_WIRE, AUXILIARY_WIRE
    hung = FreeDroppers(*names, x, x, (0.0,) * len(x))
    links = _droppers(data, upper=AUXILIARY_WIRE), hung, _arms(data), _supports(data)
    return Parts((_contact(data), level, _messenger(data)), links)


@register(STITCHED, (*HUNG, "stitch_wire"))
def stitched_catenary(data: LineData) -> Parts:
    """A simple catenary with stitch wires clamped to the messenger wire beside inner supports.

    Between its clamps a stitch wire carries its tension in place of the messenger wire, and at each
    inner support the nearest droppers hang from it.
    """
    assert data.stitch_wire is not None
    stitch = _clamped(data, data.stitch_wire, STITCH_WIRE, MESSENGER_WIRE, STITCH_CLAMPS)
    starts, ends = np.array(stitch.stretches).reshape(-1, 2).T
    near = np.searchsorted(starts, data.dropper_x) > np.searchsorted(ends, data.dropper_x)
    links = (
        _droppers(data, which=~near),
        _droppers(data, STITCH_DROPPERS, STITCH_WIRE, which=near),
        _arms(data),
        _supports(data),
    )
    return Parts((_contact(data), stitch, _messenger(data)), links)


@register(TWIN, (*HUNG, "twin"))
def twin_contact_wires(data: LineData) -> Parts:
    """Two contact wires that hang from one messenger wire, each with a steady arm at each mast."""
    pair = CONTACT_WIRE, second(CONTACT_WIRE)
    wires = *_contacts(data), _messenger(data)
    links = *_twin_droppers(data, MESSENGER_WIRE, MESSENGER_WIRE), *_twin_arms(data)
    return Parts(wires, (*links, _supports(data)), (pair[::-1],))


@register(TWIN_MESSENGER, (*HUNG, "twin"))
def twin_simple_catenaries(data: LineData) -> Parts:
    """Two simple catenaries side by side, which only the pan head joins."""
    pairs = [(name, second(name)) for name in (CONTACT_WIRE, MESSENGER_WIRE)]
    above = [_messenger(data, *own) for own in zip(pairs[1], _sides(data), strict=True)]
    links = (
        *_twin_droppers(data, *pairs[1]),
        *_twin_arms(data),
        _supports(data),
        _supports(data, pairs[1][1], second(SUPPORTS)),
    )
    twins = tuple((other, one) for one, other in pairs)
    return Parts((*_contacts(data), *above), links, twins)


@register(SINGLE, ("contact_wire",), ("bridle",))
def single_wire(data: LineData) -> Parts:
    """A contact wire that supports hold at its height at each mast, itself or by a bridle.

    Between its clamps a bridle carries its tension in place of the contact wire.
    """
    bridles = []
    if data.bridle is not None:
        bridles = [_clamped(data, data.bridle, BRIDLE_WIRE, CONTACT_WIRE, BRIDLE_CLAMPS)]
    carried = BRIDLE_WIRE if bridles else CONTACT_WIRE
    links = _arms(data), _supports(data, carried, holds=CONTACT_WIRE)
    return Parts((_contact(data), *bridles), links)


@register(FREE, ("wires", "links"))
def free_line(data: LineData) -> Parts:
    """The wires and links of a scene's tables."""
    assert data.wires is not None and data.links is not None
    return Parts(data.wires, data.links)


def _wire(
    data: LineData,
    conductor: Conductor,
    name: str,
    role: Role,
    height: float,
    sideways: float = 0.0,
) -> FreeWire:
    """A wire from anchor to anchor, at one height at the masts [m]; over the track, unless it is a
    contact wire, and so far to the left of there [m]."""
    masts = tuple(data.support_positions.tolist())
    y = data.stagger if role is Role.CONTACT else data.messenger_stagger or (0.0,) * len(masts)
    level = Course(masts, (height,) * len(masts))
    lateral = Course(masts, tuple(place + sideways for place in y))
    return FreeWire(conductor, name, role, ((masts[0], masts[-1]),), level, lateral)


def _contact(data: LineData, name: str = CONTACT_WIRE, sideways: float = 0.0) -> FreeWire:
    assert data.contact_wire is not None
    return _wire(data, data.contact_wire, name, Role.CONTACT, data.contact_height, sideways)


def _messenger(data: LineData, name: str = MESSENGER_WIRE, sideways: float = 0.0) -> FreeWire:
    assert data.messenger_wire is not None
    top = data.contact_height + data.encumbrance
    return _wire(data, data.messenger_wire, name, Role.MESSENGER, top, sideways)


def _clamped(data: LineData, wire: ClampedWire, name: str, bearer: str, clamps: str) -> FreeWire:
    """A wire at each inner support that is clamped to another one on both sides of it."""
    return FreeWire(
        wire.conductor,
        name,
        Role.STITCH,
        tuple((start, end) for start, end in data.around_supports(wire.length).tolist()),
        None,
        None,
        clamped_to=(bearer, bearer),
        clamp_mass=wire.clamp_mass,
        clamp_stiffness=wire.clamp_stiffness,
        clamps=clamps,
    )


def _droppers(
    data: LineData,
    name: str = DROPPERS,
    upper: str = MESSENGER_WIRE,
    lower: str = CONTACT_WIRE,
    which: slice | np.ndarray = slice(None),
) -> FreeDroppers:
    """Some of the droppers of a contact wire, all of them by default."""
    assert data.dropper is not None
    x = tuple(data.dropper_x[which].tolist())
    sag = tuple(np.concatenate([np.zeros(0), *data.pre_sag])[which].tolist())
    return FreeDroppers(name, data.dropper, upper, lower, x, x, sag)


def _arms(data: LineData, name: str = STEADY_ARMS, wire: str = CONTACT_WIRE) -> SteadyArms:
    return SteadyArms(name, data.steady_arm, wire, _inner(data))


def _supports(
    data: LineData, wire: str = MESSENGER_WIRE, name: str = SUPPORTS, holds: str = ""
) -> Supports:
    return Supports(name, data.support_stiffness, wire, _inner(data), holds)


def _inner(data: LineData) -> tuple[float, ...]:
    """Places of the masts between two spans [m]."""
    return tuple(data.support_positions[1:-1].tolist())


def _sides(data: LineData) -> tuple[float, float]:
    """Lateral place of each of two wires [m], positive to the left."""
    assert data.twin is not None
    return 0.5 * data.twin.spacing, -0.5 * data.twin.spacing


def _contacts(data: LineData) -> tuple[FreeWire, FreeWire]:
    left, right = _sides(data)
    return _contact(data, sideways=left), _contact(data, second(CONTACT_WIRE), right)


def _twin_droppers(data: LineData, one: str, other: str) -> tuple[FreeDroppers, FreeDroppers]:
    """The droppers of both contact wires; alternating ones hang them by turns along the line."""
    assert data.twin is not None
    turns = (slice(0, None, 2), slice(1, None, 2)) if data.twin.alternating else (slice(None),) * 2
    return (
        _droppers(data, DROPPERS, one, CONTACT_WIRE, turns[0]),
        _droppers(data, second(DROPPERS), other, second(CONTACT_WIRE), turns[1]),
    )


def _twin_arms(data: LineData) -> tuple[SteadyArms, SteadyArms]:
    return _arms(data), _arms(data, second(STEADY_ARMS), second(CONTACT_WIRE))
