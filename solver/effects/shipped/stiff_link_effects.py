"""Numerical damping of one-sided links that are stiff for the time step.

Average acceleration reflects the force of a spring with omega dt >> 1 from step to step (its
amplification factor goes to -1) and does the work (T_n + T_n+1) / 2 times the stretch of a step. A
link that slackens from a stretch a to a gap b thereby returns k a (a + b) / 2, though only
k a^2 / 2 was stored, and a stiff link switches in every other step: the line gains energy. A damper
alpha k in the link makes the factor (2 alpha - dt) / (2 alpha + dt): with alpha = dt it is 1/3, and
a link that slackens returns less than it stored (docs/theory/droppers.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import hardware_effects  # noqa: F401  (built before)
from catenary.solver.problem.problem import Damping, Problem, Simulated
from catenary.solver.problem.watched_links import UPLIFT_STOPS

NAME = "stiff_link_damping"
# A link is stiff from k dt^2 = 4 kappa m on, with some 0.25 kg of wire that move with its ends
# within a step: kappa = 0.2. Undamped lines gained energy at 0.25, over 4 km (docs/hard_cases.md).
STIFF = 0.22  # k dt^2 [N s2/m]
# Length of droppers whose stiffness goes with it and which are not cut yet, a short one [m].
_SHORT = 0.3


def _one_sided(problem: Problem) -> Iterator[tuple[str, float]]:
    """Components whose links act one way, and the largest stiffness of each [N/m]."""
    line = problem.line
    if "dropper_slackening" in problem.effects:
        for group in line.droppers:
            yield group.name, group.kind.stiffest_at(_SHORT)
    if "uplift_stops" in problem.effects:
        kinds = [arms.kind for arms in line.steady_arms if arms.kind.uplift_stop is not None]
        if kinds:
            yield UPLIFT_STOPS, max(kind.stop_stiffness for kind in kinds)


def _given(problem: Problem) -> Damping:
    return problem.damping if "structural_damping" in problem.effects else Damping(0.0, 0.0)


def _added(problem: Problem) -> dict[str, float]:
    """Alpha [s] by component that its links lack to have dt."""
    given, dt = _given(problem), problem.numerics.dt
    found = {}
    for name, stiffness in _one_sided(problem):
        alpha, _ = given.per_component.get(name, (given.alpha, given.beta))
        if stiffness * dt**2 > STIFF and alpha < dt:
            found[name] = dt - alpha
    return found


def _damped(laws: Simulated, problem: Problem) -> Simulated:
    own, added = laws.damping, _added(problem)
    pairs = dict(own.per_component)
    for name, more in added.items():
        alpha, beta = pairs.get(name, (own.alpha, own.beta))
        pairs[name] = alpha + more, beta
    return replace(laws, damping=replace(own, per_component=pairs), added_alpha=added)


register(
    Effect(
        NAME,
        "numerical damping of droppers and stops that are stiff for the time step",
        "a damper alpha k in each link that acts one way, with alpha = dt",
        "amplification factor of average acceleration for omega dt >> 1; docs/theory/droppers.md",
        applies=lambda p: bool(_added(p)),
        law=_damped,
        data="droppers that slacken, or stops, with k dt^2 above 0.22 N s2/m and less damping",
    )
)
