"""Effects of the train: what pantographs and the vehicle below them have besides the usual."""

from __future__ import annotations

from dataclasses import replace

from catenary.solver.effects import vertical_effects  # noqa: F401  (built before)
from catenary.solver.effects.effect import Effect, register
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.simulated import Simulated


def _suspended(laws: Simulated, problem: Problem) -> Simulated:
    vehicle = problem.train.vehicle
    assert vehicle is not None  # the effect applies
    return replace(laws, suspension=vehicle.suspension)


register(
    Effect(
        "vehicle_suspension",
        "suspension of the vehicle between the track and its pantographs",
        "the roof's answer to the track: bounce and pitch, sway and roll of a car body on bogies",
        "linear car body on two bogies (Garg, Dukkipati 1984)",
        default=True,
        applies=lambda p: p.train.vehicle is not None and p.train.vehicle.suspension is not None,
        law=_suspended,
        data="a table [vehicle.suspension]",
    )
)
