"""Topologies with one wire more, as a newcomer would write them: functions from data to a line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from small_lines import en50318_line

from catenary.meshgen.line import Clamps, Conductor, Droppers, End, Line, Piece, Profile, Role, Wire
from catenary.meshgen.mesh import DROPPERS, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.registry import register, unregister
from catenary.meshgen.topologies.simple import simple_catenary

AUXILIARY, STITCH, HANGERS = "auxiliary_wire", "stitch_wire", "hangers"
AUXILIARY_CONDUCTOR = Conductor(14.7e3, 1.375, 120.0)
STITCH_CONDUCTOR = Conductor(3.5e3, 0.31, 0.0)
STITCH_HALF = 9.0  # [m]


def compound(data: LineData) -> Line:
    """The scene's droppers hang the contact wire from an auxiliary wire, which hangs by half as
    many from the messenger wire."""
    simple = simple_catenary(data)
    contact, messenger = simple.wires
    (low,) = simple.droppers
    x = tuple((0.5 * (data.dropper_x[0::2] + data.dropper_x[1::2])).tolist())
    ends = simple.support_positions[[0, -1]].tolist()
    level = data.contact_height + 0.4 * data.encumbrance
    profile = Profile(level, (0.0,), (0.0,), 0.0, data.profile.ends, data.profile.running)
    course = Piece(tuple(ends), (0.0, 0.0), (level, level))
    middle = Wire.of(AUXILIARY_CONDUCTOR, AUXILIARY, Role.AUXILIARY, (course,), profile)
    return replace(
        simple,
        topology="compound",
        wires=(contact, middle, messenger),
        droppers=(
            replace(low, name=HANGERS, upper=AUXILIARY),
            Droppers(
                DROPPERS, replace(data.dropper, stiffness=2e5), MESSENGER_WIRE, AUXILIARY, x, x
            ),
        ),
    )


def stitched(data: LineData) -> Line:
    """At each inner mast the droppers nearest to it hang from a stitch wire clamped to the
    messenger wire on both sides."""
    simple = simple_catenary(data)
    contact, messenger = simple.wires
    (low,) = simple.droppers
    masts = simple.support_positions[1:-1]
    ends = np.stack([masts - STITCH_HALF, masts + STITCH_HALF], axis=1)
    top = data.contact_height + data.encumbrance
    pieces = tuple(
        Piece((a, b), (0.0, 0.0), (top - 0.4, top - 0.4), (End.CLAMPED, End.CLAMPED))
        for a, b in ends.tolist()
    )
    near = (np.abs(data.dropper_x[:, None] - masts) < STITCH_HALF).any(axis=1)
    groups = [
        replace(low, name=name, upper=upper, upper_x=tuple(x.tolist()), lower_x=tuple(x.tolist()))
        for name, upper, x in (
            (DROPPERS, MESSENGER_WIRE, data.dropper_x[~near]),
            (HANGERS, STITCH, data.dropper_x[near]),
        )
    ]
    taken = tuple((a, b, STITCH_CONDUCTOR.tension) for a, b in ends.tolist())
    return replace(
        simple,
        topology="stitched",
        wires=(
            contact,
            Wire.of(STITCH_CONDUCTOR, STITCH, Role.STITCH, pieces),
            replace(messenger, taken=taken),
        ),
        droppers=tuple(groups),
        clamps=(Clamps("clamps", 1e7, 0.38, MESSENGER_WIRE, STITCH, tuple(ends.ravel().tolist())),),
    )


TOPOLOGIES = {"compound": compound, "stitched": stitched}


@contextmanager
def further_topologies() -> Iterator[None]:
    """``compound`` and ``stitched`` are known to the registry while the block runs."""
    for name, make in TOPOLOGIES.items():
        register(name)(make)
    try:
        yield
    finally:
        for name in TOPOLOGIES:
            unregister(name)


def data_of(topology: str, n_spans: int = 6, bending: float = 1.0) -> LineData:
    """A compound line with the wires of the Shinkansen, a stitched one like a Re330."""
    line = en50318_line(n_spans)
    if topology == "compound":
        span, places = 50.0, tuple(2.5 + 5.0 * k for k in range(10))
        wires = Conductor(14.7e3, 1.511, 130.0), Conductor(24.5e3, 1.45, 100.0)
    else:
        span, places = 65.0, (2.5, 7.5, 17.5, 27.5, 37.5, 47.5, 57.5, 62.5)
        wires = Conductor(27e3, 1.082, 137.0), Conductor(21e3, 1.06, 40.0)
    return replace(
        line,
        topology=topology,
        span_lengths=(span,) * n_spans,
        dropper_positions=(places,) * n_spans,
        pre_sag=((0.0,) * len(places),) * n_spans,
        encumbrance=1.8,
        contact_wire=replace(wires[0], bending_stiffness=bending * wires[0].bending_stiffness),
        messenger_wire=replace(wires[1], bending_stiffness=bending * wires[1].bending_stiffness),
        support_stiffness=5e5,
    )
