"""Reasons for steps outside of the loop of compiled kernels, and what these steps cost.

One list of reasons: `plan` reads it for a problem, a march for what it steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.mbs.build import has_joints
from catenary.solver.integrators.slow_path import SlowPath
from catenary.solver.problem.problem import Problem

if TYPE_CHECKING:
    from catenary.solver.time_loop.views.row_layout import RowLayout


def single_steps_of(problem: Problem, layout: RowLayout | None = None) -> SlowPath | None:
    """Reason why steps of a problem leave the compiled kernels on one rank, None if they do not.

    Not collective. A scheme other than ``one_solve``, and a coupling that is not implicit, step in
    their own way, which is reported elsewhere.
    """
    numerics = problem.numerics
    if numerics.scheme != "one_solve" or numerics.coupling == "explicit":
        return None
    # Factors are those of the case ambrosio2012 with its lumped pantograph; the largest is first.
    if any(has_joints(place.data) for place in problem.train.placements):
        return SlowPath("a pantograph has all its bodies in the time loop", 40.0)
    if numerics.coupling == "iterated":
        return SlowPath('numerics.coupling = "iterated" repeats the exchange of forces', 9.0)
    if numerics.adaptive_tolerance is not None:
        return SlowPath("numerics.adaptive_tolerance_N lets steps be halved", 5.5)
    if layout is not None and not layout.in_loop:
        return SlowPath("a channel is a Python function, called after each step", 3.0)
    return None
