"""Two contact wires side by side, under one messenger wire or each under its own."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from catenary.meshgen.hardware import Droppers, SteadyArms, Supports
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE, STEADY_ARMS, SUPPORTS
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.registry import HUNG, register
from catenary.meshgen.topologies.simple import hung_messenger, simple_catenary
from catenary.meshgen.wires import Wire

TWIN, TWIN_MESSENGER = "twin", "twin_messenger"


def second(name: str) -> str:
    """Name of the second wire or group of a pair."""
    return f"{name}_2"


class _Side(NamedTuple):
    """One of two contact wires: how far to the left it is [m], and where droppers hang it [m]."""

    wire: Wire
    sideways: float
    x: np.ndarray

    def droppers(self, data: LineData, name: str, upper: str) -> Droppers:
        """The droppers that hang it."""
        assert data.dropper is not None
        places = tuple(self.x.tolist())
        return Droppers(name, data.dropper, upper, self.wire.name, places, places)


@register(TWIN, (*HUNG, "twin"))
def twin_contact_wires(data: LineData) -> Line:
    """Two contact wires that hang from one messenger wire, each with a steady arm at each mast."""
    one, other = _sides(data)
    messenger = hung_messenger(data, data.dropper_x, 2.0 * data.contact_wire.mass_per_length)
    inner = tuple(data.support_positions[1:-1].tolist())
    return Line(
        data.span_lengths,
        data.n_transition,
        TWIN,
        (one.wire, other.wire, messenger),
        (
            one.droppers(data, DROPPERS, MESSENGER_WIRE),
            other.droppers(data, second(DROPPERS), MESSENGER_WIRE),
        ),
        _arms(data, inner),
        (Supports(SUPPORTS, data.support_stiffness, MESSENGER_WIRE, inner),),
        twins=((other.wire.name, one.wire.name),),
    )


@register(TWIN_MESSENGER, (*HUNG, "twin"))
def twin_simple_catenaries(data: LineData) -> Line:
    """Two simple catenaries side by side, which only the pan head joins."""
    one, other = _sides(data)
    inner = tuple(data.support_positions[1:-1].tolist())
    names = MESSENGER_WIRE, second(MESSENGER_WIRE)
    messengers = [
        replace(
            _shifted(hung_messenger(data, own.x, own.wire.mass_per_length), own.sideways), name=name
        )
        for own, name in zip((one, other), names, strict=True)
    ]
    return Line(
        data.span_lengths,
        data.n_transition,
        TWIN_MESSENGER,
        (one.wire, other.wire, *messengers),
        (
            one.droppers(data, DROPPERS, names[0]),
            other.droppers(data, second(DROPPERS), names[1]),
        ),
        _arms(data, inner),
        tuple(
            Supports(name, data.support_stiffness, wire, inner)
            for name, wire in zip((SUPPORTS, second(SUPPORTS)), names, strict=True)
        ),
        twins=((other.wire.name, one.wire.name), (names[1], names[0])),
    )


def _sides(data: LineData) -> tuple[_Side, _Side]:
    """The two contact wires; alternating droppers hang them by turns along the whole line."""
    twin = data.twin
    assert twin is not None
    contact, half, x = simple_catenary(data).wires[0], 0.5 * twin.spacing, data.dropper_x
    places = (x[0::2], x[1::2]) if twin.alternating else (x, x)
    one = _Side(_shifted(contact, half), half, places[0])
    beside = replace(_shifted(contact, -half), name=second(CONTACT_WIRE))
    return one, _Side(beside, -half, places[1])


def _arms(data: LineData, inner: tuple[float, ...]) -> tuple[SteadyArms, SteadyArms]:
    """A steady arm for each wire at each inner mast."""
    return (
        SteadyArms(STEADY_ARMS, data.steady_arm, CONTACT_WIRE, inner),
        SteadyArms(second(STEADY_ARMS), data.steady_arm, second(CONTACT_WIRE), inner),
    )


def _shifted(wire: Wire, sideways: float) -> Wire:
    """The wire so far to the left of where it is [m]."""
    pieces = (replace(piece, y=tuple(y + sideways for y in piece.y)) for piece in wire.pieces)
    return replace(wire, pieces=tuple(pieces))
