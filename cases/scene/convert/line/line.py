"""From a scene's tables to the line in SI units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from catenary.cases.scene.scene import Scene
from catenary.cases.scene.tables.line.curve import CurveTable
from catenary.cases.scene.tables.line.droppers import DropperTable, HangingTable
from catenary.cases.scene.tables.line.line import LineTable
from catenary.cases.scene.tables.line.wires import BridleTable, StitchWireTable, WireTable
from catenary.cases.scene.tables.units import angle_from_deg, length_from_mm
from catenary.meshgen.curve import Curve
from catenary.meshgen.hardware import DropperKind, Fittings, SteadyArm
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import (
    AuxiliaryWire,
    Bridle,
    LineData,
    Overlap,
    StitchWire,
    Twin,
)
from catenary.meshgen.wires import Conductor
from catenary.solver.base.errors import InputError

# Span lengths are written in decimal; two that differ by less are the same one.
_SAME_SPAN = 1e-6


def line_of(scene: Scene) -> Line:
    """The line of a scene.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths, or do not fit into one.
    """
    return replace(make_line(line_data_of(scene)), fittings=_fittings(scene.line))


def _fittings(table: LineTable) -> tuple[Fittings, ...]:
    """Fittings by kind and wire; what has a length is two masses."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for one in table.fittings:
        ends = (one.at_m, one.at_m + one.length_m) if one.length_m else (one.at_m,)
        group = found.setdefault((one.kind, one.wire), [])
        group += [(x, one.mass_kg / len(ends)) for x in ends]
    return tuple(
        Fittings(kind, wire, *zip(*sorted(group), strict=True))
        for (kind, wire), group in found.items()
    )


def line_data_of(scene: Scene) -> LineData:
    """What a scene says of its line.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths.
    """
    table = scene.line
    spans = span_lengths(table)
    hung = table.dropper
    positions = [_positions(scene, "line.dropper", hung, span) for span in spans]
    first, last = table.transition.n_spans_start, table.n_spans - table.transition.n_spans_end
    pre_sag = [
        _pre_sag(hung, spans[i], positions[i])
        if hung is not None and first <= i < last
        else (0.0,) * len(positions[i])
        for i in range(table.n_spans)
    ]
    return LineData(
        span_lengths=spans,
        dropper_positions=tuple(positions),
        pre_sag=tuple(pre_sag),
        stagger=_stagger(table.stagger_m, table.n_spans),
        messenger_stagger=_optional(
            lambda own: _stagger(own, table.n_spans), table.messenger_stagger_m
        ),
        curve=_optional(_curve, table.curve),
        contact_height=table.contact_height_m,
        encumbrance=table.encumbrance_m or 0.0,
        contact_wire=_conductor(table.contact_wire),
        messenger_wire=_optional(_conductor, table.messenger_wire),
        dropper=None if hung is None else _dropper_kind(hung, hung.contact_clamp_kg),
        support_stiffness=table.support.stiffness_N_per_m,
        steady_arm=SteadyArm(
            length=table.steady_arm.length_m,
            mass_per_length=table.steady_arm.mass_kg_per_m,
            clamp_mass=table.steady_arm.clamp_kg,
            stiffness=table.steady_arm.stiffness_N_per_m,
            holds_height=table.steady_arm.holds_height,
            inclination=_optional(angle_from_deg, table.steady_arm.inclination_deg),
        ),
        n_transition=(table.transition.n_spans_start, table.transition.n_spans_end),
        transition_rise=table.transition.rise_m,
        topology=table.topology,
        auxiliary_wire=_auxiliary(scene, spans),
        stitch_wire=_optional(_stitch, table.stitch_wire),
        twin=_optional(lambda own: Twin(own.spacing_m, own.droppers == "alternating"), table.twin),
        bridle=_optional(_bridle, table.bridle),
        overlap=_optional(
            lambda own: Overlap(own.first_span - 1, own.n_spans, own.rise_m, own.distance_m),
            table.overlap,
        ),
    )


_Table = TypeVar("_Table")
_Part = TypeVar("_Part")


def _optional(make: Callable[[_Table], _Part], table: _Table | None) -> _Part | None:
    return None if table is None else make(table)


def _auxiliary(scene: Scene, spans: tuple[float, ...]) -> AuxiliaryWire | None:
    table = scene.line.auxiliary_wire
    if table is None:
        return None
    key = "line.auxiliary_wire.dropper"
    return AuxiliaryWire(
        _conductor(table),
        table.height_m,
        _dropper_kind(table.dropper, table.dropper.auxiliary_clamp_kg),
        tuple(_positions(scene, key, table.dropper, span) for span in spans),
    )


def _stitch(table: StitchWireTable) -> StitchWire:
    return StitchWire(
        _conductor(table), table.length_m, table.clamp_kg, table.clamp_stiffness_N_per_m
    )


def _bridle(table: BridleTable) -> Bridle:
    return Bridle(_conductor(table), table.length_m, table.clamp_kg, table.clamp_stiffness_N_per_m)


def _dropper_kind(table: HangingTable, lower_clamp: float) -> DropperKind:
    return DropperKind(
        stiffness=table.stiffness_N_per_m,
        axial_stiffness=table.axial_stiffness_N,
        mass_per_length=table.mass_kg_per_m,
        upper_clamp_mass=table.messenger_clamp_kg,
        lower_clamp_mass=lower_clamp,
    )


def span_lengths(table: LineTable) -> tuple[float, ...]:
    """Length of every span [m]; ``span_m`` is repeated over the spans that it stands for."""
    transition, n = table.transition, table.n_spans
    if transition.span_m is None:
        return tuple(table.span_m[i % len(table.span_m)] for i in range(n))
    n_running = n - transition.n_spans_start - transition.n_spans_end
    running = tuple(table.span_m[i % len(table.span_m)] for i in range(n_running))
    ends = (transition.span_m,)
    return ends * transition.n_spans_start + running + ends * transition.n_spans_end


def _positions(scene: Scene, key: str, kind: HangingTable | None, span: float) -> tuple[float, ...]:
    if kind is None:
        return ()
    if kind.positions_m is not None:
        return tuple(kind.positions_m)
    if kind.patterns is not None:
        for pattern in kind.patterns:
            if abs(pattern.span_m - span) < _SAME_SPAN:
                return tuple(pattern.positions_m)
        listed = ", ".join(f"{pattern.span_m:g}" for pattern in kind.patterns)
        key = f"{key}.patterns"
        raise InputError(
            f"{key} {scene.origin.of(key)} has no entry for spans of {span:g} m; it has {listed} m"
        )
    assert kind.count is not None and kind.spacing_m is not None
    margin = 0.5 * (span - (kind.count - 1) * kind.spacing_m)
    return tuple(margin + i * kind.spacing_m for i in range(kind.count))


def _pre_sag(kind: DropperTable, span: float, positions: tuple[float, ...]) -> tuple[float, ...]:
    if kind.pre_sag_mm is not None:
        return tuple(length_from_mm(value) for value in kind.pre_sag_mm)
    for pattern in kind.patterns or []:
        if pattern.pre_sag_mm is not None and abs(pattern.span_m - span) < _SAME_SPAN:
            return tuple(length_from_mm(value) for value in pattern.pre_sag_mm)
    if not kind.pre_sag_mid_mm or len(positions) < 3:
        return (0.0,) * len(positions)
    x = np.asarray(positions)
    across = (2 * x - x[0] - x[-1]) / (x[-1] - x[0])
    return tuple(float(v) for v in length_from_mm(kind.pre_sag_mid_mm) * (1 - across**2))


def _stagger(given: list[float], n_spans: int) -> tuple[float, ...]:
    if len(given) > 1:
        return tuple(given)
    side = given[0]
    return tuple(side if i % 2 == 0 else -side for i in range(n_spans + 1))


def _curve(table: CurveTable) -> Curve:
    to_left = 1.0 if table.side == "left" else -1.0
    first = -np.inf if table.from_m is None else table.from_m
    last = np.inf if table.to_m is None else table.to_m
    tilt = math.asin(table.cant_mm / table.rail_distance_mm)
    return Curve(to_left / table.radius_m, tilt, (first, last), table.transition_m)


def _conductor(table: WireTable) -> Conductor:
    return Conductor(
        table.tension_N,
        table.mass_kg_per_m,
        table.bending_stiffness_N_m2,
        axial_stiffness=table.stiffness_along(),
        expansion=table.expansion_per_K,
        diameter=None if table.diameter_mm is None else length_from_mm(table.diameter_mm),
        drag_coefficient=table.drag_coefficient,
    )
