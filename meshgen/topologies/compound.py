"""Compound catenary: an auxiliary wire between messenger and contact wire."""

from __future__ import annotations

from dataclasses import replace

from catenary.meshgen.hardware import Droppers
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.registry import HUNG, register
from catenary.meshgen.topologies.simple import hung_messenger, simple_catenary
from catenary.meshgen.wires import Piece, Profile, Role, Wire

COMPOUND = "compound"
AUXILIARY_WIRE = "auxiliary_wire"
AUXILIARY_DROPPERS = "auxiliary_droppers"


@register(COMPOUND, (*HUNG, "auxiliary_wire"))
def compound_catenary(data: LineData) -> Line:
    """The contact wire hangs from an auxiliary wire, which hangs level from the messenger wire."""
    auxiliary = data.auxiliary_wire
    assert auxiliary is not None
    simple = simple_catenary(data)
    contact, _ = simple.wires
    (low,) = simple.droppers
    over = data.profile
    level = Profile(data.contact_height + auxiliary.height, (0.0,), (0.0,), over.sections)
    heights = level.level(data.support_positions).tolist()
    masts = tuple(data.support_positions.tolist())
    course = Piece(masts, data.over_track(data.support_positions), tuple(heights))
    middle = Wire.of(auxiliary.conductor, AUXILIARY_WIRE, Role.AUXILIARY, (course,), level)
    x = data.along(auxiliary.dropper_positions)
    hung = contact.mass_per_length + middle.mass_per_length
    places = tuple(x.tolist())
    return replace(
        simple,
        topology=COMPOUND,
        wires=(contact, middle, hung_messenger(data, x, hung)),
        droppers=(
            replace(low, upper=AUXILIARY_WIRE),
            Droppers(
                AUXILIARY_DROPPERS,
                auxiliary.dropper,
                MESSENGER_WIRE,
                AUXILIARY_WIRE,
                places,
                places,
            ),
        ),
    )
