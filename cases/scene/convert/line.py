"""From a scene's tables to the line in SI units."""

from __future__ import annotations

import numpy as np

from catenary.cases.scene.scene import Scene
from catenary.cases.scene.tables.line import LineTable, WireTable
from catenary.cases.scene.tables.units import length_from_mm
from catenary.meshgen.line import Conductor, DropperKind, Line, SteadyArm
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
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
    return make_line(line_data_of(scene))


def line_data_of(scene: Scene) -> LineData:
    """What a scene says of its line.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths.
    """
    table = scene.line
    spans = span_lengths(table)
    positions = [_positions(scene, span) for span in spans]
    first, last = table.transition.n_spans_start, table.n_spans - table.transition.n_spans_end
    pre_sag = [
        _pre_sag(table, spans[i], positions[i]) if first <= i < last else (0.0,) * len(positions[i])
        for i in range(table.n_spans)
    ]
    kind = table.dropper
    return LineData(
        span_lengths=spans,
        dropper_positions=tuple(positions),
        pre_sag=tuple(pre_sag),
        stagger=_stagger(table),
        contact_height=table.contact_height_m,
        encumbrance=table.encumbrance_m,
        contact_wire=_conductor(table.contact_wire),
        messenger_wire=_conductor(table.messenger_wire),
        dropper=DropperKind(
            stiffness=kind.stiffness_N_per_m,
            axial_stiffness=kind.axial_stiffness_N,
            mass_per_length=kind.mass_kg_per_m,
            upper_clamp_mass=kind.messenger_clamp_kg,
            lower_clamp_mass=kind.contact_clamp_kg,
        ),
        support_stiffness=table.support.stiffness_N_per_m,
        steady_arm=SteadyArm(
            length=table.steady_arm.length_m,
            mass_per_length=table.steady_arm.mass_kg_per_m,
            clamp_mass=table.steady_arm.clamp_kg,
            stiffness=table.steady_arm.stiffness_N_per_m,
            holds_height=table.steady_arm.holds_height,
        ),
        n_transition=(table.transition.n_spans_start, table.transition.n_spans_end),
        transition_rise=table.transition.rise_m,
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


def _positions(scene: Scene, span: float) -> tuple[float, ...]:
    kind = scene.line.dropper
    if kind.positions_m is not None:
        return tuple(kind.positions_m)
    if kind.patterns is not None:
        for pattern in kind.patterns:
            if abs(pattern.span_m - span) < _SAME_SPAN:
                return tuple(pattern.positions_m)
        listed = ", ".join(f"{pattern.span_m:g}" for pattern in kind.patterns)
        key = "line.dropper.patterns"
        raise InputError(
            f"{key} {scene.origin.of(key)} has no entry for spans of {span:g} m; it has {listed} m"
        )
    assert kind.count is not None and kind.spacing_m is not None
    margin = 0.5 * (span - (kind.count - 1) * kind.spacing_m)
    return tuple(margin + i * kind.spacing_m for i in range(kind.count))


def _pre_sag(table: LineTable, span: float, positions: tuple[float, ...]) -> tuple[float, ...]:
    kind = table.dropper
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


def _stagger(table: LineTable) -> tuple[float, ...]:
    if len(table.stagger_m) > 1:
        return tuple(table.stagger_m)
    side = table.stagger_m[0]
    return tuple(side if i % 2 == 0 else -side for i in range(table.n_spans + 1))


def _conductor(table: WireTable) -> Conductor:
    return Conductor(table.tension_N, table.mass_kg_per_m, table.bending_stiffness_N_m2)
