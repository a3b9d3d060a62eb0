"""How many spans of a line move with the train, and what that costs in accuracy."""

from __future__ import annotations

from catenary.solver.problem.problem import Problem
from catenary.solver.problem.window import BOUNDED, EXACT, ROUND_OFF, WindowChoice


def window_sentence(problem: Problem) -> str:
    """Which part of the line moves, in words; empty if all of it does. Not collective."""
    window = problem.window
    if not window.moves:
        return ""
    if window.mode == EXACT:
        return (
            "whatever a wave has reached moves, down to "
            f"{ROUND_OFF:g} of the largest motion (window.mode = exact)"
        )
    if window.tolerance is not None:
        return (
            f"stations rest whose motion is below {window.tolerance:g} of the largest "
            "(window.mode = bounded)"
        )
    return (
        f"{window.spans_ahead:g} spans move ahead of the train and {window.spans_behind:g} behind "
        "(window.mode = bounded)"
    )


def spans_of_window(
    problem: Problem, ahead: float | None = None, behind: float | None = None
) -> WindowChoice:
    """A window of so many spans, by default of those that the line's damping asks for."""
    return WindowChoice(BOUNDED, None, ahead or 0.0, behind or 0.0)
