"""From a scene to the problem in SI units.

Conversion is in this folder and nowhere else.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.contact import contact_law_of
from catenary.cases.scene.convert.course import end_of
from catenary.cases.scene.convert.incidents import line_incidents, lowering_of
from catenary.cases.scene.convert.line.along import along_of
from catenary.cases.scene.convert.line.defects import defects_of, irregularities_of
from catenary.cases.scene.convert.line.ends import ends_of
from catenary.cases.scene.convert.line.line import line_of
from catenary.cases.scene.convert.line.parts import hanging_table
from catenary.cases.scene.convert.line.wind import wind_of
from catenary.cases.scene.convert.train.aerodynamics import tunnels_of
from catenary.cases.scene.convert.train.laws import regulation_of
from catenary.cases.scene.convert.train.pantograph import pantograph_of, static_force
from catenary.cases.scene.convert.train.vehicle import vehicle_of
from catenary.cases.scene.tables.line.line import LineTable
from catenary.cases.scene.tables.run.window import WindowTable
from catenary.cases.scene.tables.units import speed_from_km_h
from catenary.mbs.vehicle.base_motion import VehicleMotion
from catenary.solver.problem.problem import Damping, Numerics, Placement, Problem, Train
from catenary.solver.problem.window import BOUNDED, WindowChoice
from catenary.solver.window.choice import spans_of_window

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def problem_of(scene: Scene) -> Problem:
    """The problem of a scene."""
    numerics, train, line = scene.numerics, _train(scene), line_of(scene)
    hung = hanging_table(scene.line)
    problem = Problem(
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
        residual_stiffness_ratio=0.0 if hung is None else hung.residual_stiffness_ratio,
        effects=frozenset(name for name, on in scene.switches().items() if on),
        incidents=line_incidents(scene.incidents, line, numerics.dt_s),
        slack_dampers_act=hung is not None and hung.slack_damping == "kept",
        ends=ends_of(scene.line.ends),
        tunnels=tunnels_of(scene.line.tunnels),
        wind=wind_of(scene.wind),
        along=along_of(scene.line),
        irregularities=irregularities_of(scene.irregularities, line),
        defects=defects_of(scene.defects, line),
    )
    return replace(problem, window=_window(scene.window, problem))


def _window(table: WindowTable, problem: Problem) -> WindowChoice:
    if table.mode == BOUNDED and table.tolerance is None:
        return spans_of_window(problem, table.spans_ahead, table.spans_behind)
    return WindowChoice(table.mode, table.tolerance)


def _damping(table: LineTable) -> Damping:
    lateral = table.damping.lateral
    return Damping(
        alpha=table.damping.alpha_s,
        beta=table.damping.beta_per_s,
        per_component={
            name: (value.alpha_s, value.beta_per_s)
            for name, value in table.damping.per_component.items()
        },
        lateral=None if lateral is None else (lateral.alpha_s, lateral.beta_per_s),
    )


def _vehicle(scene: Scene) -> VehicleMotion | None:
    if scene.vehicle is None:
        return None
    vehicle = vehicle_of(scene.vehicle)
    # A suspension passes on what the track does, and nothing else.
    return vehicle if scene.switches()["vehicle_motion"] else replace(vehicle, suspension=None)


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
                regulator=regulation_of(kind.regulation),
            )
        )
    return Train(
        speed=speed_from_km_h(scene.train.speed_km_h),
        start=scene.train.start_m,
        end=end_of(scene),
        raise_time=scene.train.raise_time_s,
        start_below=scene.train.start_below_m,
        placements=tuple(placements),
        vehicle=_vehicle(scene),
    )
