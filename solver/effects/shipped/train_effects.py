"""Effects of the train and the air: pantographs, the vehicle below them, wind."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from catenary.solver.effects.effect import Effect
from catenary.solver.problem.problem import Problem, Simulated

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


def _steady(laws: Simulated, problem: Problem) -> Simulated:
    assert problem.wind is not None  # the effect applies
    return replace(laws, wind=problem.wind.with_gusts(None))


def _damped(builder: ModelBuilder) -> None:
    from catenary.solver.wind import damping_blocks

    wind = builder.model.simulated.wind
    assert wind is not None
    for block in damping_blocks(builder.model, wind):
        builder.add_block(block)


def _gusts(builder: ModelBuilder) -> None:
    from catenary.solver.wind import gust_loads

    wind = builder.model.simulated.wind
    assert wind is not None
    for load in gust_loads(builder.model, wind):
        builder.add_load(load)


AIR = (
    Effect(
        "pantograph_aerodynamics",
        "aerodynamic forces on the pantographs",
        "uplift of head and frame by the air's speed, drag on bodies of a mechanism, tunnels",
        "uplift by speed as measured; forces with the square of the speed",
        applies=lambda p: any(place.data.meets_air for place in p.train.placements),
        law=lambda laws, p: replace(laws, meets_air=True),
        data="a table [pantographs.*.aerodynamics] or a force of type aerodynamic_force",
    ),
    Effect(
        "wind",
        "mean wind on wires and pantographs",
        "drag of the wires at rest, aerodynamic damping of their motion, air at the pantographs",
        "1/2 rho d C_d |q| q, linear in the motion (Dyrbye, Hansen: Wind Loads on Structures)",
        applies=lambda p: p.wind is not None,
        build=_damped,
        law=_steady,
        data="a table [wind] with a speed above 0",
        after_cutting=True,
    ),
    Effect(
        "gusts",
        "gusts on wires and pantographs",
        "loads of a random field along the line, which is coherent in space",
        "spectra of Davenport, von Karman, Panofsky, Kaimal; coherence exp(-C n d / U)",
        requires=("wind",),
        applies=lambda p: p.wind is not None and p.wind.gusts is not None,
        build=_gusts,
        law=lambda laws, p: replace(laws, wind=p.wind),
        data="a table [wind.gusts] in a wind above 0",
        after_cutting=True,
    ),
)


def _suspended(laws: Simulated, problem: Problem) -> Simulated:
    vehicle = problem.train.vehicle
    assert vehicle is not None  # the effect applies
    return replace(laws, suspension=vehicle.suspension)


PANTOGRAPHS = (
    Effect(
        "pantograph_laws",
        "laws of pantographs that are not linear",
        "limiters, dampers, springs and friction as tables of force over extension or its rate",
        "piecewise linear tables, implicit in each step",
        applies=lambda p: any(place.data.laws for place in p.train.placements),
        law=lambda laws, p: replace(laws, pantograph_laws=True),
        data="pantographs.*.laws",
    ),
    Effect(
        "flexible_strips",
        "collector strips that bend",
        "modes of each strip as a beam, where the wire crosses it",
        "Euler-Bernoulli beam with free ends on two springs (Ritz)",
        applies=lambda p: any(place.data.strips.flexure for place in p.train.placements),
        law=lambda laws, p: replace(laws, flexible_strips=True),
        data="pantographs.*.strips.flexure",
    ),
    Effect(
        "raked_strips",
        "collector strips at an angle to the cross-section",
        "places of contacts ahead of or behind a strip's middle, by the stagger",
        "straight strip under the wires at rest",
        applies=lambda p: any(place.data.strips.rake for place in p.train.placements),
        law=lambda laws, p: replace(laws, raked_strips=True),
        data="pantographs.*.strips.rake_deg",
    ),
    Effect(
        "regulated_lift",
        "pantographs whose static force is regulated",
        "a force on the lift, by a sampled controller of the contact force or the head's height",
        "PID controller with filter, scheduled gains, limits and delay",
        applies=lambda p: any(place.regulator is not None for place in p.train.placements),
        law=lambda laws, p: replace(laws, regulated_lift=True),
        data="pantographs.*.regulation",
    ),
    Effect(
        "vehicle_suspension",
        "suspension of the vehicle between the track and its pantographs",
        "the roof's answer to the track: bounce and pitch, sway and roll of a car body on bogies",
        "linear car body on two bogies (Garg, Dukkipati 1984)",
        applies=lambda p: p.train.vehicle is not None and p.train.vehicle.suspension is not None,
        law=_suspended,
        data="a table [vehicle.suspension]",
    ),
)
