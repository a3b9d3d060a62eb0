"""All effects: the registry with the shipped ones in it, and what those of a problem set."""

from __future__ import annotations

from collections.abc import Iterable

from catenary.solver.effects import vertical_effects  # noqa: F401  (registers on import)
from catenary.solver.effects.effect import Effect, registered
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.simulated import Simulated


def registry() -> dict[str, Effect]:
    """All effects by name, in the order in which they are built."""
    return registered()


def active(problem: Problem) -> list[Effect]:
    """The effects that ``problem`` asks for and has something for, in building order."""
    return [e for e in registry().values() if e.name in problem.effects and e.applies(problem)]


def simulated(problem: Problem) -> Simulated:
    """The laws of a problem: each active effect sets its own, in building order."""
    laws = Simulated(problem.contact.without_damping())
    for effect in active(problem):
        if effect.law is not None:
            laws = effect.law(laws, problem)
    return laws


def unknowns_per_node(effects: Iterable[Effect]) -> tuple[str, ...]:
    """Unknowns that a set of effects needs at each wire node, without repetition."""
    return tuple(name for group in unknown_groups(effects) for name in group)


def unknown_groups(effects: Iterable[Effect]) -> list[tuple[str, ...]]:
    """The same in groups: what an effect is the first to need."""
    groups: list[tuple[str, ...]] = []
    for effect in effects:
        known = {name for group in groups for name in group}
        new = tuple(name for name in dict.fromkeys(effect.unknowns) if name not in known)
        groups += [new] if new else []
    return groups
