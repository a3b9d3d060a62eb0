"""Effects of the train: what pantographs and the vehicle below them have besides the usual."""

from __future__ import annotations

from dataclasses import replace

from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import vertical_effects  # noqa: F401  (built before)
from catenary.solver.problem.problem import Problem, Simulated


def _suspended(laws: Simulated, problem: Problem) -> Simulated:
    vehicle = problem.train.vehicle
    assert vehicle is not None  # the effect applies
    return replace(laws, suspension=vehicle.suspension)


register(
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
