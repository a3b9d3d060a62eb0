"""From a scene's tables to the line in SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from catenary.cases.scene.convert.line.free import free_links, free_wires
from catenary.cases.scene.convert.line.overlaps import overlaps_of
from catenary.cases.scene.convert.line.parts import (
    conductor,
    dropper_kind,
    positions_in,
    pre_sag_of,
    staggered,
    steady_arm,
)
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.tables.line.fittings import FittingTable
from catenary.cases.scene.tables.line.line import LineTable
from catenary.cases.scene.tables.line.track.curve import CurveTable
from catenary.cases.scene.tables.line.wires import AuxiliaryWireTable, BridleTable, StitchWireTable
from catenary.meshgen.curve import Curve
from catenary.meshgen.hardware import Fittings
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.free_data import FreeWire
from catenary.meshgen.topologies.line_data import (
    AuxiliaryWire,
    Bridle,
    LineData,
    StitchWire,
    Twin,
)
from catenary.meshgen.wires import Conductor, Role


def line_of(scene: Scene) -> Line:
    """The line of a scene.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths, or do not fit into one.
    """
    return replace(make_line(line_data_of(scene)), fittings=fittings_of(scene.line.fittings))


def fittings_of(tables: Sequence[FittingTable]) -> tuple[Fittings, ...]:
    """Fittings by kind and wire; what has a length is two masses."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for one in tables:
        ends = (one.at_m, one.at_m + one.length_m) if one.length_m else (one.at_m,)
        group = found.setdefault((one.kind, one.wire), [])
        group += [(x, one.mass_kg / len(ends)) for x in ends]
    return tuple(
        Fittings(kind, wire, *zip(*sorted(group), strict=True))
        for (kind, wire), group in found.items()
    )


def line_data_of(scene: Scene) -> LineData:
    """The line of a scene as topologies take it.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths.
    """
    return line_data(scene.line, scene.origin)


def line_data(table: LineTable, origin: Origin) -> LineData:
    """The line of a table as topologies take it; ``origin`` says where its keys were written.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths.
    """
    spans = span_lengths(table)
    hung = table.dropper
    wires = free_wires(table, spans)
    links = free_links(table, origin, spans, wires)
    contact_height, contact_wire, stagger = _contact_of(table, wires)
    # Spans of one length are alike.
    lengths = dict.fromkeys(spans)
    of_length = {span: positions_in(origin, "line.dropper", hung, span) for span in lengths}
    positions = [of_length[span] for span in spans]
    first, last = table.transition.n_spans_start, table.n_spans - table.transition.n_spans_end
    sag_of = {
        span: () if hung is None else pre_sag_of(hung, span, of_length[span])
        for span in dict.fromkeys(spans[first:last])
    }
    pre_sag = [
        sag_of[spans[i]] if first <= i < last else (0.0,) * len(positions[i])
        for i in range(table.n_spans)
    ]
    return LineData(
        span_lengths=spans,
        dropper_positions=tuple(positions),
        pre_sag=tuple(pre_sag),
        stagger=stagger,
        messenger_stagger=_optional(
            lambda own: staggered(own, table.n_spans), table.messenger_stagger_m
        ),
        curve=_optional(_curve, table.curve),
        contact_height=contact_height,
        encumbrance=table.encumbrance_m or 0.0,
        contact_wire=contact_wire,
        messenger_wire=_optional(conductor, table.messenger_wire),
        dropper=None if hung is None else dropper_kind(hung, hung.contact_clamp_kg),
        support_stiffness=table.support.stiffness_N_per_m,
        steady_arm=steady_arm(table.steady_arm),
        n_transition=(table.transition.n_spans_start, table.transition.n_spans_end),
        transition_rise=table.transition.rise_m,
        topology=table.topology,
        auxiliary_wire=_optional(lambda own: _auxiliary(own, origin, spans), table.auxiliary_wire),
        stitch_wire=_optional(_stitch, table.stitch_wire),
        twin=_optional(lambda own: Twin(own.spacing_m, own.droppers == "alternating"), table.twin),
        bridle=_optional(_bridle, table.bridle),
        overlaps=overlaps_of(table),
        wires=wires,
        links=links,
    )


def _contact_of(
    table: LineTable, wires: tuple[FreeWire, ...] | None
) -> tuple[float, Conductor, tuple[float, ...]]:
    """Height, conductor and stagger of the contact wire; of several the one with the slowest waves.

    ValueError if there is none, which checks report.
    """
    stagger = staggered(table.stagger_m, table.n_spans)
    if table.contact_wire is not None:
        return table.contact_height_m, conductor(table.contact_wire), stagger
    contact = [wire for wire in wires or () if wire.role is Role.CONTACT]
    if not contact:
        raise ValueError("the line has no contact wire")
    slowest = min(contact, key=lambda wire: wire.conductor.wave_speed)
    assert slowest.heights is not None
    if slowest.lateral is not None:
        supports = np.concatenate([[0.0], np.cumsum(span_lengths(table))])
        stagger = tuple(slowest.lateral.at(supports).tolist())
    return max(slowest.heights.value), slowest.conductor, stagger


_Table = TypeVar("_Table")
_Part = TypeVar("_Part")


def _optional(make: Callable[[_Table], _Part], table: _Table | None) -> _Part | None:
    return None if table is None else make(table)


def _auxiliary(
    table: AuxiliaryWireTable, origin: Origin, spans: tuple[float, ...]
) -> AuxiliaryWire:
    key = "line.auxiliary_wire.dropper"
    return AuxiliaryWire(
        conductor(table),
        table.height_m,
        dropper_kind(table.dropper, table.dropper.auxiliary_clamp_kg),
        tuple(positions_in(origin, key, table.dropper, span) for span in spans),
    )


def _stitch(table: StitchWireTable) -> StitchWire:
    return StitchWire(
        conductor(table), table.length_m, table.clamp_kg, table.clamp_stiffness_N_per_m
    )


def _bridle(table: BridleTable) -> Bridle:
    return Bridle(conductor(table), table.length_m, table.clamp_kg, table.clamp_stiffness_N_per_m)


def span_lengths(table: LineTable) -> tuple[float, ...]:
    """Length of every span [m]; ``span_m`` is repeated over the spans that it stands for."""
    transition, n = table.transition, table.n_spans
    if transition.span_m is None:
        return tuple(table.span_m[i % len(table.span_m)] for i in range(n))
    n_running = n - transition.n_spans_start - transition.n_spans_end
    running = tuple(table.span_m[i % len(table.span_m)] for i in range(n_running))
    ends = (transition.span_m,)
    return ends * transition.n_spans_start + running + ends * transition.n_spans_end


def _curve(table: CurveTable) -> Curve:
    to_left = 1.0 if table.side == "left" else -1.0
    first = -np.inf if table.from_m is None else table.from_m
    last = np.inf if table.to_m is None else table.to_m
    tilt = math.asin(table.cant_mm / table.rail_distance_mm)
    return Curve(to_left / table.radius_m, tilt, (first, last), table.transition_m)
