"""The air around the train's pantographs."""

from __future__ import annotations

from catenary.mbs.air.airflow import Airflow
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.problem.simulated import Simulated
from catenary.solver.wind.wind_at import wind_at


def airflow(problem: Problem, simulated: Simulated, placement: Placement) -> Airflow | None:
    """The air that a pantograph meets on its way, None if it has no forces. Not collective."""
    if not (simulated.meets_air and placement.data.meets_air):
        return None
    train, wind = problem.train, simulated.wind
    masts = problem.line.support_positions
    blowing = None if wind is None else wind_at(wind, float(masts[0]), float(masts[-1]))
    return Airflow(
        train.speed,
        train.start - placement.behind,
        problem.tunnels,
        blowing,
        placement.data.crosswind_factor,
    )
