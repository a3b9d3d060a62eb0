"""Slow paths through a step: why free steps are not taken in two passes, or steps not in the loop
of compiled kernels, and their cost. `plan` reads this for a problem, a march for what it steps.
"""

from __future__ import annotations

import logging
from typing import NamedTuple

from catenary.mbs.build import has_joints
from catenary.solver.model.loads import FunctionLoad
from catenary.solver.model.model import Model
from catenary.solver.model.unknowns import Unknowns
from catenary.solver.problem.problem import Numerics, Problem

logger = logging.getLogger(__name__)

# Time of a step in terms of one in the compiled loop, as measured with the case ambrosio2012: part
# by part with products and solves by stations, and with factors of PETSc.
PARTS, LIBRARY = 5.5, 5.6
# By kernels that look up what stations join: shinkansen_compound with lateral motion and damping by
# component takes 2.0 to 2.8 of the time without that damping, which takes 1.4 where it is compiled.
GENERAL = 1.8
# A short function of NumPy, called for each step.
CALLED = 1.5


class SlowPath(NamedTuple):
    """A slower way through a step: its reason, its time in terms of the compiled loop."""

    reason: str
    factor: float

    def __str__(self) -> str:
        return f"steps take about {self.factor:g} times as long as they could: {self.reason}"


_logged: set[str] = set()


def warn_of_slow_path(slow_path: SlowPath) -> None:
    """Warn of a slow path, once in a process and not for each line of a sweep.

    Not collective; on rank 0.
    """
    if slow_path.reason not in _logged:
        _logged.add(slow_path.reason)
        logger.warning("%s", slow_path)


def slow_path_of(problem: Problem, numbering: Unknowns) -> SlowPath | None:
    """The slow path that a problem calls for by itself, None if it calls for none. Not collective.

    A scheme other than ``one_solve`` steps in its own way, which is no slow path.
    """
    if problem.numerics.scheme != "one_solve":
        return None
    if not numbering.in_stations:
        return SlowPath("the nodes of the wires are too many or too few to form stations", LIBRARY)
    reason = slow_method(problem.numerics)
    return SlowPath(reason, PARTS) if reason else None


def single_steps_of(problem: Problem, in_loop: bool = True) -> SlowPath | None:
    """Reason why steps of a problem leave the compiled kernels on one rank, None if they do not.

    ``in_loop`` is whether their rows of channels are filled there. Not collective. A scheme other
    than ``one_solve``, and a coupling that is not implicit, step in their own way, which is
    reported elsewhere.
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
    if not in_loop:
        return SlowPath("a channel is a Python function, called after each step", 3.0)
    return None


def slow_method(numerics: Numerics) -> str:
    """Reason why a method cannot take steps in two passes, "" if it can."""
    if numerics.coupling == "explicit":
        return 'numerics.coupling = "explicit" needs heights of the wire within a step'
    return ""


def slow_load(model: Model) -> str:
    """Reason why loads of a model take longer than they could, "" if they do not."""
    names = [load.name for load in model.loads if isinstance(load, FunctionLoad)]
    return f"the load {names[0]} is a Python function, called for each step" if names else ""
