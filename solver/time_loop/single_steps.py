"""Reasons for steps outside of the loop of compiled kernels, and what these steps cost.

One list of reasons: `plan` reads it for a problem, a march for what it steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from catenary.mbs.build import has_joints
from catenary.solver.effects.all_effects import simulated
from catenary.solver.integrators.slow_path import SlowPath
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.simulated import Simulated

if TYPE_CHECKING:
    from catenary.solver.time_loop.views.row_layout import RowLayout


class _Stepped(NamedTuple):
    """Parts of a march that are stepped; the layout of its rows is not known before the march."""

    problem: Problem
    laws: Simulated
    layout: RowLayout | None


class Reason(NamedTuple):
    """A reason, the time of a step in terms of one in the loop, and whether it holds."""

    sentence: str
    factor: float
    holds: Callable[[_Stepped], bool]


def _has_all_bodies(stepped: _Stepped) -> bool:
    return any(has_joints(place.data) for place in stepped.problem.train.placements)


# Factors are those of the case ambrosio2012 with its lumped pantograph; the largest comes first.
REASONS = (
    Reason("a pantograph has all its bodies in the time loop", 40.0, _has_all_bodies),
    Reason(
        'numerics.coupling = "iterated" repeats the exchange of forces',
        9.0,
        lambda stepped: stepped.problem.numerics.coupling == "iterated",
    ),
    Reason(
        "numerics.adaptive_tolerance_N lets steps be halved",
        5.5,
        lambda stepped: stepped.problem.numerics.adaptive_tolerance is not None,
    ),
    Reason(
        "a channel is a Python function, called after each step",
        3.0,
        lambda stepped: stepped.layout is not None and not stepped.layout.in_loop,
    ),
)


def single_steps_of(problem: Problem, layout: RowLayout | None = None) -> SlowPath | None:
    """Reason why steps of a problem leave the compiled kernels on one rank, None if they do not.

    Not collective. A scheme other than ``one_solve``, and a coupling that is not implicit, step in
    their own way, which is reported elsewhere.
    """
    numerics = problem.numerics
    if numerics.scheme != "one_solve" or numerics.coupling == "explicit":
        return None
    stepped = _Stepped(problem, simulated(problem), layout)
    for reason in REASONS:
        if reason.holds(stepped):
            return SlowPath(reason.sentence, reason.factor)
    return None
