"""From a scene's tables to the line and the problem in SI units.

Conversion is here and in the other modules `convert_*`, and nowhere else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.cases.scene.convert.contact import contact_law_of
from catenary.cases.scene.convert.incidents import line_incidents, lowering_of
from catenary.cases.scene.convert.pantograph import pantograph_of, static_force
from catenary.cases.scene.convert.vehicle import vehicle_of
from catenary.cases.scene.tables.line import LineTable, WireTable
from catenary.cases.scene.units import length_from_mm, speed_from_km_h
from catenary.meshgen.line import DropperKind, Line, SteadyArm, Wire
from catenary.solver.base.errors import InputError
from catenary.solver.problem.problem import Damping, Numerics, Placement, Problem, Train

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

# Span lengths are written in decimal; two that differ by less are the same one.
_SAME_SPAN = 1e-6


def line_of(scene: Scene) -> Line:
    """The line of a scene.

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
    return Line(
        span_lengths=spans,
        dropper_positions=tuple(positions),
        pre_sag=tuple(pre_sag),
        stagger=_stagger(table),
        contact_height=table.contact_height_m,
        encumbrance=table.encumbrance_m,
        contact_wire=_wire(table.contact_wire),
        messenger_wire=_wire(table.messenger_wire),
        dropper=DropperKind(
            stiffness=kind.stiffness_N_per_m,
            axial_stiffness=kind.axial_stiffness_N,
            mass_per_length=kind.mass_kg_per_m,
            messenger_clamp_mass=kind.messenger_clamp_kg,
            contact_clamp_mass=kind.contact_clamp_kg,
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


def problem_of(scene: Scene) -> Problem:
    """The problem of a scene."""
    numerics, train, line = scene.numerics, _train(scene), line_of(scene)
    ratio = scene.line.dropper.residual_stiffness_ratio
    return Problem(
        line=line,
        damping=_damping(scene.line),
        contact=contact_law_of(scene.contact, train.placements[0].static_force),
        train=train,
        numerics=Numerics(
            dt=numerics.dt_s,
            scheme=numerics.scheme,
            beta=numerics.newmark_beta,
            gamma=numerics.newmark_gamma,
            eps_d=numerics.eps_d_m,
            eps_v=numerics.eps_v_m_per_s,
            max_iterations=numerics.max_iterations,
            coupling=numerics.coupling or "implicit",
            eps_force=numerics.eps_force_N,
            integrator=numerics.integrator,
            spectral_radius=1.0 if numerics.spectral_radius is None else numerics.spectral_radius,
            iterations=numerics.iterations,
            adaptive_tolerance=numerics.adaptive_tolerance_N,
            smallest_dt=numerics.smallest_dt_s,
        ),
        evaluation=(scene.evaluation.from_m, scene.evaluation.to_m),
        residual_stiffness_ratio=ratio,
        effects=frozenset(name for name, on in scene.switches().items() if on),
        incidents=line_incidents(scene.incidents, line, numerics.dt_s),
        slack_dampers_act=scene.line.dropper.slack_damping == "kept",
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


def _wire(table: WireTable) -> Wire:
    return Wire(table.tension_N, table.mass_kg_per_m, table.bending_stiffness_N_m2)


def _damping(table: LineTable) -> Damping:
    components = table.damping.per_component
    given = {name: getattr(components, name) for name in type(components).model_fields}
    return Damping(
        alpha=table.damping.alpha_s,
        beta=table.damping.beta_per_s,
        per_component={
            name: (value.alpha_s, value.beta_per_s)
            for name, value in given.items()
            if value is not None
        },
    )


def _train(scene: Scene) -> Train:
    placements = []
    for number, place in enumerate(scene.train.pantographs, start=1):
        kind = scene.pantographs[place.name]
        force = static_force(place.name, kind, scene.train.speed_km_h)
        assert force is not None  # checks_pantograph.py has refused speeds outside the table
        placements.append(
            Placement(
                data=pantograph_of(
                    place.name, kind, scene.train.speed_km_h, reversed=place.reversed
                ),
                static_force=force,
                behind=place.behind_m,
                nominal_height=kind.nominal_height_m,
                lowering=lowering_of(scene.incidents, number, scene.numerics.dt_s),
            )
        )
    return Train(
        speed=speed_from_km_h(scene.train.speed_km_h),
        start=scene.train.start_m,
        end=scene.end_m,
        raise_time=scene.train.raise_time_s,
        start_below=scene.train.start_below_m,
        placements=tuple(placements),
        vehicle=None if scene.vehicle is None else vehicle_of(scene.vehicle),
    )
