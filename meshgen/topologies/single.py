"""Single contact wire of tramways, carried at the masts, by bridles or without."""

from __future__ import annotations

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.hardware import Clamps, SteadyArms, Supports
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, STEADY_ARMS, SUPPORTS
from catenary.meshgen.topologies.line_data import Bridle, LineData
from catenary.meshgen.topologies.registry import register
from catenary.meshgen.topologies.sag import GRAVITY
from catenary.meshgen.wires import End, Piece, Role, Wire

SINGLE = "single"
BRIDLE_WIRE = "bridle_wire"
BRIDLE_CLAMPS = "bridle_clamps"


@register(SINGLE, ("contact_wire",), ("bridle",))
def single_wire(data: LineData) -> Line:
    """A contact wire that supports hold at its height at each mast, itself or by a bridle.

    Between its clamps a bridle carries its tension in place of the contact wire.

    Raises
    ------
    InputError
        If bridles of neighbouring supports would overlap.
    """
    masts = data.support_positions
    at_masts = tuple(masts.tolist())
    inner = at_masts[1:-1]
    course = Piece(at_masts, data.stagger, tuple(data.profile.level(masts).tolist()))
    wires, clamps, carried = [], [], CONTACT_WIRE
    taken: tuple[tuple[float, float, float], ...] = ()
    if data.bridle is not None:
        bridle = _bridle_wire(data, data.bridle)
        wires.append(bridle)
        carried = BRIDLE_WIRE
        taken = tuple((piece.x[0], piece.x[-1], bridle.tension) for piece in bridle.pieces)
        ends = tuple(data.around_supports(data.bridle.length).ravel().tolist())
        own = data.bridle.clamp_stiffness, data.bridle.clamp_mass
        clamps.append(Clamps(BRIDLE_CLAMPS, *own, BRIDLE_WIRE, CONTACT_WIRE, ends))
    contact = Wire.of(data.contact_wire, CONTACT_WIRE, Role.CONTACT, (course,), data.profile, taken)
    return Line(
        data.span_lengths,
        data.n_transition,
        SINGLE,
        (contact, *wires),
        (),
        (SteadyArms(STEADY_ARMS, data.steady_arm, CONTACT_WIRE, inner),),
        (Supports(SUPPORTS, data.support_stiffness, carried, inner, holds=CONTACT_WIRE),),
        tuple(clamps),
    )


def _bridle_wire(data: LineData, bridle: Bridle) -> Wire:
    if bridle.length >= min(data.span_lengths):
        raise InputError(
            f"bridles of {bridle.length:g} m overlap in a span of {min(data.span_lengths):g} m"
        )
    masts = data.support_positions
    weights = GRAVITY * data.contact_wire.mass_per_length * 0.5 * (masts[2:] - masts[:-2])
    # First guess: the weight of a span hangs in the middle of the bridle.
    rise = 0.25 * weights * bridle.length / bridle.conductor.tension
    pieces = []
    for (a, b), mast, above in zip(
        data.around_supports(bridle.length), masts[1:-1], rise, strict=True
    ):
        x = np.array([a, mast, b])
        z = data.profile.level(x) + np.array([0.0, above, 0.0])
        y = np.interp(x, masts, data.stagger)
        pieces.append(
            Piece(tuple(x.tolist()), tuple(y.tolist()), tuple(z.tolist()), (End.CLAMPED,) * 2)
        )
    return Wire.of(bridle.conductor, BRIDLE_WIRE, Role.STITCH, tuple(pieces))
