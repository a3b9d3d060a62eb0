"""Marches of a scene with windows, beside one of its whole line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.runs import RunHistories
from catenary.solver.problem.problem import WindowChoice
from catenary.solver.statics.line_at_rest import LineAtRest

COMM = MPI.COMM_SELF


def march(rest: LineAtRest, window: WindowChoice | None = None) -> RunHistories:
    """A march with a window, of the whole line without one."""
    problem = replace(rest.problem, window=window or WindowChoice())
    return hard_runs.run(rest._replace(problem=problem), COMM)


def nudged(rest: LineAtRest) -> LineAtRest:
    """The same with static forces that differ in the 12th digit."""
    train = rest.problem.train
    places = tuple(
        replace(place, static_force=place.static_force * (1.0 + 1e-12))
        for place in train.placements
    )
    return rest._replace(problem=replace(rest.problem, train=replace(train, placements=places)))


def apart(found: RunHistories, whole: RunHistories) -> float:
    """Largest difference of a contact force, over the largest force."""
    assert found.force.shape == whole.force.shape, (found.outcome, whole.outcome)
    return float(np.abs(found.force - whole.force).max() / largest(whole))


def largest(whole: RunHistories) -> float:
    """Largest contact force, 1 N at least [N]."""
    return max(float(np.abs(whole.force).max()), 1.0)
