"""All effects: the registry with the shipped ones, and the laws that those of a problem set."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import replace
from functools import wraps
from typing import TypeVar

from catenary.solver.effects.effect import Effect, NamedWire, register, registered
from catenary.solver.effects.shipped import (
    defect_effects,
    line_effects,
    motion_effects,
    train_effects,
)
from catenary.solver.model.unknowns import Group
from catenary.solver.problem.problem import Problem, Simulated

# In the order in which they are built.
register(
    *line_effects.VERTICAL,
    *train_effects.AIR,
    *motion_effects.ALONG_TRACK,
    *line_effects.HARDWARE,
    *defect_effects.DEFECTS,
    motion_effects.LATERAL,
    *motion_effects.ENDS,
    *train_effects.PANTOGRAPHS,
    line_effects.STIFF_LINKS,
)


def registry() -> dict[str, Effect]:
    """All effects by name, in the order in which they are built."""
    return registered()


T = TypeVar("T")


def _of_latest(function: Callable[[Problem], T]) -> Callable[[Problem], T]:
    """A function of a problem that keeps its result for the latest one, which several ask for."""
    latest: list[tuple[Problem, dict[str, Effect], T]] = []

    @wraps(function)
    def of(problem: Problem) -> T:
        effects = registry()
        found = latest[0] if latest else None  # as threads of a program may put others there
        if found is None or found[0] is not problem or found[1] != effects:
            found = problem, effects, function(problem)
            latest[:] = [found]
        return found[2]

    return of


@_of_latest
def active(problem: Problem) -> tuple[Effect, ...]:
    """The effects of ``problem`` that have something to act on, in building order."""
    own = problem.effects
    return tuple(e for name, e in registry().items() if name in own and e.applies(problem))


def needs_form(problem: Problem) -> bool:
    """Whether matrices of any active effect depend on the shape at rest."""
    return any(effect.of_form for effect in active(problem))


def after_cutting(problem: Problem) -> list[Effect]:
    """The active effects on a line whose droppers have been cut, in building order."""
    return [effect for effect in active(problem) if effect.after_cutting]


def as_cut(problem: Problem, but: Set[str] = frozenset()) -> Problem:
    """A problem whose line is the sound one, for which droppers are cut, with effects ``but``
    others."""
    acting = {effect.name for effect in after_cutting(problem)} - but
    return replace(problem, effects=problem.effects - acting) if acting else problem


def with_defects(problem: Problem) -> Problem:
    """The problem with defects applied to its wires."""
    for effect in after_cutting(problem):
        if effect.hangs is not None:
            problem = replace(problem, line=effect.hangs(problem.line, problem))
    return problem


@_of_latest
def simulated(problem: Problem) -> Simulated:
    """The laws of a problem: each active effect sets its own, in building order."""
    laws = Simulated(problem.contact.without_damping())
    for effect in active(problem):
        if effect.law is not None:
            laws = effect.law(laws, problem)
    return laws


def move_together(problem: Problem) -> dict[str, str]:
    """Wires that move with another one, by name: second ones of twins without relative motion."""
    twins = dict(problem.line.twins)
    return {} if not twins or simulated(problem).relative_motion else twins


def unknown_groups(effects: Iterable[Effect], wires: Iterable[NamedWire]) -> list[Group]:
    """Unknowns of each wire that a set of effects needs, a group for each effect that adds some.

    An unknown belongs to the group of the first effect that needs it on any wire.
    """
    wires = tuple(wires)
    groups: list[dict[str, tuple[str, ...]]] = []
    place: dict[str, int] = {}
    for effect in effects:
        if effect.unknowns_of_wire is None:
            continue
        asked = {wire.name: effect.unknowns_of_wire(wire) for wire in wires}
        new = dict.fromkeys(name for own in asked.values() for name in own if name not in place)
        place.update(dict.fromkeys(new, len(groups)))
        if new:
            groups.append(dict.fromkeys(asked, ()))
        for wire, own in asked.items():
            for name in own:
                group = groups[place[name]]
                group[wire] = tuple(dict.fromkeys((*group[wire], name)))
    return list(groups)
