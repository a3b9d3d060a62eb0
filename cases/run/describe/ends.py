"""Sentences on how the line ends: plan, check, result file."""

from __future__ import annotations

from catenary.postproc.evaluate.wording import counted
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Periodic
from catenary.solver.problem.problem import Problem

SIDES = ("start", "end")


def end_sentences(problem: Problem) -> tuple[str, str]:
    """How the line begins and how it ends, in words."""
    start, end = (
        f"{side} {_sentence(kind)}" for side, kind in zip(SIDES, problem.ends, strict=True)
    )
    return start, end


def lets_waves_out(end: EndCondition) -> bool:
    """Whether an end sends back so little that no wave from there is looked for."""
    return isinstance(end, AbsorbingLayer | Periodic)


def end_warnings(problem: Problem) -> list[str]:
    """What about the ends may spoil a run, in sentences."""
    line, train = problem.line, problem.train
    masts, n = line.support_positions, line.n_spans
    start, end = problem.ends
    rear = train.start - max(place.behind for place in train.placements)
    said = []
    if isinstance(start, AbsorbingLayer) and rear < masts[start.n_spans]:
        said.append(_inside("start", f"starts at {rear:g} m", float(masts[start.n_spans])))
    if isinstance(end, AbsorbingLayer) and train.end > masts[n - end.n_spans]:
        said.append(_inside("end", f"runs to {train.end:g} m", float(masts[n - end.n_spans])))
    return said


def _inside(side: str, how: str, inner: float) -> str:
    return (
        f"The train {how}, inside the absorbing layer at the {side} of the line, which begins at "
        f"{inner:g} m: there waves are damped that run beside the pantograph."
    )


def _sentence(end: EndCondition) -> str:
    if isinstance(end, AbsorbingLayer):
        return (
            f"{counted(end.n_spans, 'span')} that absorb waves (damping up to {end.damping:g} 1/s),"
            " then fixed"
        )
    if isinstance(end, Periodic):
        return "as if the line went on for ever like its last span, without slack droppers there"
    return "fixed"
