"""Simple catenary: one messenger wire, one contact wire, vertical droppers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catenary.meshgen.hardware import Droppers, SteadyArms, Supports
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE, STEADY_ARMS, SUPPORTS
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.registry import register
from catenary.meshgen.topologies.sag import sagging
from catenary.meshgen.wires import Piece, Role, Wire

SIMPLE = "simple"


@register(SIMPLE)
def simple_catenary(data: LineData) -> Line:
    """A contact wire that droppers hang from a messenger wire straight above the track."""
    assert data.dropper is not None
    masts = data.support_positions
    at_masts, at_droppers = tuple(masts.tolist()), tuple(data.dropper_x.tolist())
    inner = at_masts[1:-1]
    contact = Piece(at_masts, data.stagger, tuple(data.profile.level(masts).tolist()))
    return Line(
        data.span_lengths,
        data.n_transition,
        SIMPLE,
        (
            Wire.of(data.contact_wire, CONTACT_WIRE, Role.CONTACT, (contact,), data.profile),
            hung_messenger(data, data.dropper_x, data.contact_wire.mass_per_length),
        ),
        (Droppers(DROPPERS, data.dropper, MESSENGER_WIRE, CONTACT_WIRE, at_droppers, at_droppers),),
        (SteadyArms(STEADY_ARMS, data.steady_arm, CONTACT_WIRE, inner),),
        (Supports(SUPPORTS, data.support_stiffness, MESSENGER_WIRE, inner),),
    )


def hung_messenger(data: LineData, x: np.ndarray, hung: float) -> Wire:
    """A messenger wire that carries ``hung`` [kg/m] at places ``x`` (n,) [m]."""
    wire = data.messenger_wire
    assert wire is not None
    top = data.contact_height + data.encumbrance
    course = sagging(data, x, top, hung + wire.mass_per_length, wire.tension)
    course = replace(course, y=data.over_track(np.array(course.x)))
    return Wire.of(wire, MESSENGER_WIRE, Role.MESSENGER, (course,))
