"""Stitched catenary: at each inner support the nearest droppers hang from a stitch wire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.hardware import Clamps
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, LineData, StitchWire
from catenary.meshgen.topologies.registry import HUNG, register
from catenary.meshgen.topologies.sag import GRAVITY
from catenary.meshgen.topologies.simple import simple_catenary
from catenary.meshgen.wires import End, Piece, Role, Wire

STITCHED = "stitched"
STITCH_WIRE = "stitch_wire"
STITCH_DROPPERS = "stitch_droppers"
STITCH_CLAMPS = "stitch_clamps"


@register(STITCHED, (*HUNG, "stitch_wire"))
def stitched_catenary(data: LineData) -> Line:
    """A simple catenary with stitch wires clamped to the messenger wire beside inner supports.

    Between its clamps a stitch wire carries its tension in place of the messenger wire.

    Raises
    ------
    InputError
        If stitch wires of neighbouring supports would overlap, or none would carry a dropper.
    """
    stitch = data.stitch_wire
    assert stitch is not None
    _check_lengths(data, stitch.length)
    simple = simple_catenary(data)
    contact, messenger = simple.wires
    (low,) = simple.droppers
    half = 0.5 * stitch.length
    masts = data.support_positions[1:-1]
    near = (np.abs(data.dropper_x[:, None] - masts) < half).any(axis=1)
    if not near.any():
        raise InputError(
            f"no dropper hangs from a stitch wire: none is nearer than {half:g} m to a support"
        )
    pieces = _pieces(data, stitch, contact, messenger)
    taken = tuple((piece.x[0], piece.x[-1], stitch.conductor.tension) for piece in pieces)
    groups = [
        replace(low, name=name, upper=upper, upper_x=places, lower_x=places)
        for name, upper, places in (
            (low.name, MESSENGER_WIRE, tuple(data.dropper_x[~near].tolist())),
            (STITCH_DROPPERS, STITCH_WIRE, tuple(data.dropper_x[near].tolist())),
        )
    ]
    return replace(
        simple,
        topology=STITCHED,
        wires=(
            contact,
            Wire.of(stitch.conductor, STITCH_WIRE, Role.STITCH, pieces),
            replace(messenger, taken=taken),
        ),
        droppers=tuple(groups),
        clamps=(
            Clamps(
                STITCH_CLAMPS,
                stitch.clamp_stiffness,
                stitch.clamp_mass,
                MESSENGER_WIRE,
                STITCH_WIRE,
                tuple(data.around_supports(stitch.length).ravel().tolist()),
            ),
        ),
    )


def _pieces(
    data: LineData, stitch: StitchWire, contact: Wire, messenger: Wire
) -> tuple[Piece, ...]:
    """A stitch wire at each inner support. First guess of its sag: half of it, and of the contact
    wire that it carries, hang on each clamp."""
    half = 0.5 * stitch.length
    carried = GRAVITY * half * (contact.mass_per_length + stitch.conductor.mass_per_length)
    sag = 0.5 * carried * half / stitch.conductor.tension
    starts, ends = data.around_supports(stitch.length).T
    clamps = [messenger.points(x)[:, 2] for x in (starts, ends)]
    pieces = []
    for a, mast, b, left, right in zip(
        starts, data.support_positions[1:-1], ends, *clamps, strict=True
    ):
        x, z = (a, mast, b), (left, 0.5 * (left + right) - sag, right)
        course = tuple(map(float, x)), data.over_track(np.array(x)), tuple(map(float, z))
        pieces.append(Piece(*course, (End.CLAMPED,) * 2))
    return tuple(pieces)


def _check_lengths(data: LineData, length: float) -> None:
    """Stitch wires must lie side by side, and their outer ones inside the line."""
    if data.n_spans < 2:
        raise InputError("a stitched line needs a support between two spans")
    if length >= min(data.span_lengths):
        raise InputError(
            f"stitch wires of {length:g} m overlap in a span of {min(data.span_lengths):g} m"
        )
    clamps = data.around_supports(length).ravel()
    apart = np.abs(data.dropper_x[:, None] - clamps).min(axis=0)
    if apart.min() < SHORTEST_GAP:
        at = clamps[int(np.argmin(apart))]
        raise InputError(f"the clamp of a stitch wire at {at:g} m stands on a dropper")
