"""Lines of more than two wires: shipped topologies, and one as a newcomer would write it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from small_lines import en50318_line

from catenary.meshgen.line import DropperKind
from catenary.meshgen.topologies.all_topologies import (
    AUXILIARY_WIRE,
    STITCH_WIRE,
    Parts,
    register,
    simple_catenary,
    unregister,
)
from catenary.meshgen.topologies.line_data import (
    AuxiliaryWire,
    ClampedWire,
    Course,
    FreeWire,
    LineData,
)
from catenary.meshgen.wires import Conductor, Role

AUXILIARY, STITCH = AUXILIARY_WIRE, STITCH_WIRE
STITCH_HALF = 9.0  # [m]
TOPOLOGIES = ("compound", "stitched")
FEEDER = "feeder"


def with_feeder(data: LineData) -> Parts:
    """A simple catenary with a wire above it that nothing joins: what a newcomer writes."""
    simple = simple_catenary(data)
    ends = float(data.support_positions[0]), float(data.support_positions[-1])
    top = data.contact_height + data.encumbrance + 1.0
    level, middle = Course(ends, (top, top)), Course(ends, (0.0, 0.0))
    feeder = FreeWire(Conductor(5e3, 1.1, 50.0), FEEDER, Role.MESSENGER, (ends,), level, middle)
    return simple._replace(wires=(*simple.wires, feeder))


@contextmanager
def further_topologies() -> Iterator[None]:
    """``with_feeder`` is known to the registry while the block runs."""
    register("with_feeder")(with_feeder)
    try:
        yield
    finally:
        unregister("with_feeder")


def data_of(topology: str, n_spans: int = 6, bending: float = 1.0) -> LineData:
    """A compound line with the wires of the Shinkansen, a stitched one like a Re330."""
    line = en50318_line(n_spans)
    if topology == "compound":
        span, places = 50.0, tuple(2.5 + 5.0 * k for k in range(10))
        wires = Conductor(14.7e3, 1.511, 130.0), Conductor(24.5e3, 1.45, 100.0)
    else:
        span, places = 65.0, (2.5, 7.5, 17.5, 27.5, 37.5, 47.5, 57.5, 62.5)
        wires = Conductor(27e3, 1.082, 137.0), Conductor(21e3, 1.06, 40.0)
    above = tuple(5.0 + 10.0 * k for k in range(5))
    return replace(
        line,
        topology=topology,
        span_lengths=(span,) * n_spans,
        dropper_positions=(places,) * n_spans,
        pre_sag=((0.0,) * len(places),) * n_spans,
        encumbrance=1.8,
        contact_wire=replace(wires[0], bending_stiffness=bending * wires[0].bending_stiffness),
        messenger_wire=replace(wires[1], bending_stiffness=bending * wires[1].bending_stiffness),
        auxiliary_wire=AuxiliaryWire(
            Conductor(14.7e3, 1.375, 120.0),
            0.4 * 1.8,
            DropperKind(2e5, None, 0.0, 0.0, 0.0),
            (above,) * n_spans,
        ),
        stitch_wire=ClampedWire(Conductor(3.5e3, 0.31, 0.0), 2.0 * STITCH_HALF, 0.38, 1e7),
        support_stiffness=5e5,
    )
