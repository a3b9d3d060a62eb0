"""Where a window cannot follow the train, and the sentence about it."""

from __future__ import annotations

from catenary.base.errors import InputError
from catenary.solver.problem.ends import Periodic
from catenary.solver.problem.problem import Problem


def why_no_window(problem: Problem) -> str:
    """Why the steps of a problem take on the whole line, empty if they need not. Not collective."""
    numerics = problem.numerics
    if numerics.scheme != "one_solve":
        return f"numerics.scheme is {numerics.scheme}"
    if numerics.coupling == "explicit":
        return "numerics.coupling is explicit"
    if numerics.adaptive_tolerance is not None:
        return "numerics.adaptive_tolerance_N lets steps be halved"
    if any(isinstance(end, Periodic) for end in problem.ends):
        return "an end of the line is periodic, and remembers every step"
    return ""


def refuse_window(problem: Problem, n_ranks: int, by_stations: bool) -> None:
    """Raise InputError if a problem wants a window that is not possible.

    Parameters
    ----------
    problem : Problem
        Problem of the run.
    n_ranks : int
        Number of ranks that step the line.
    by_stations : bool
        Whether steps are taken in two passes over stations.
    """
    why = why_no_window(problem)
    if not why and n_ranks > 1:
        why = f"the run has {n_ranks} ranks, and all that moves is on one: start it without mpirun"
    if not why and not by_stations:
        why = "this line, or an option of PETSc, does not let it be stepped by stations"
    if why:
        raise InputError(f"window.mode is {problem.window.mode}, which cannot be here, as {why}")
