"""Which effects of a scene can be switched, and what is switched with them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from catenary.cases.scene.checks.twins import RELATIVE_MOTION, needs_relative_motion
from catenary.cases.scene.problem import problem_of
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Effect

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

# What an effect without data lacks, where it does not say so itself.
_NO_DATA = "the scene has no data for it"


@dataclass(frozen=True)
class Switch:
    """One effect switched the other way.

    Attributes
    ----------
    name, title : of the effect
    on : whether the scene simulates it
    keys : all effects that are written into the scene, each with whether it is then on
    together : further effects that begin or end with it, since one requires the other
    """

    name: str
    title: str
    on: bool
    keys: dict[str, bool]
    together: tuple[str, ...]

    @property
    def assignments(self) -> list[str]:
        """The keys as after ``--set``."""
        return [f"effects.{name}={str(on).lower()}" for name, on in self.keys.items()]


@dataclass(frozen=True)
class SwitchableEffects:
    """Which effects of a scene can be switched, and why others cannot.

    Attributes
    ----------
    switches : effects that can be switched, those that are simulated first
    always : names of those that no scene leaves out
    lacking : what a scene lacks for the others, by their names
    """

    switches: list[Switch]
    always: list[str]
    lacking: dict[str, str]


def switchable_effects(scene: Scene) -> SwitchableEffects:
    """Which effects of a scene can be switched. Not collective."""
    problem, known = problem_of(scene), effects.registry()
    active = {effect.name for effect in effects.active(problem)}
    is_on = scene.switches()
    switches, lacking = [], {}
    for name, effect in known.items():
        if effect.always:
            continue
        if name in active:
            others = _with(name, {n: e for n, e in known.items() if is_on[n]}, _requiring)
            ended = tuple(n for n in others if n in active)
            switches.append(Switch(name, effect.title, True, _keys(name, others, False), ended))
        elif effect.applies(problem):
            others = _with(name, {n: e for n, e in known.items() if not is_on[n]}, _required)
            if needs_relative_motion(problem, name):
                others.append(RELATIVE_MOTION)
            keys = _keys(name, others, True)
            switches.append(Switch(name, effect.title, False, keys, tuple(others)))
        else:
            lacking[name] = effect.data or _NO_DATA
    switches.sort(key=lambda switch: not switch.on)
    return SwitchableEffects(switches, [n for n, e in known.items() if e.always], lacking)


def _keys(name: str, others: list[str], on: bool) -> dict[str, bool]:
    return dict.fromkeys([name, *others], on)


def _requiring(name: str, among: dict[str, Effect]) -> list[str]:
    return [other for other, effect in among.items() if name in effect.requires]


def _required(name: str, among: dict[str, Effect]) -> list[str]:
    return [other for other in effects.registry()[name].requires if other in among]


def _with(name: str, among: dict[str, Effect], of: object) -> list[str]:
    """All that an effect takes along, directly and through others, in the registry's order."""
    assert callable(of)
    found, ahead = set(), [name]
    while ahead:
        new = [other for other in of(ahead.pop(), among) if other not in found and other != name]
        found.update(new)
        ahead += new
    return [other for other in among if other in found]
