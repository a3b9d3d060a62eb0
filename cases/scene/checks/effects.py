"""Whether the effects of a scene exist, find what they require, and have the data they need."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator

from catenary.cases.scene.input.faults import Fault, shown
from catenary.cases.scene.line.line_data import hanging_table
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Limit

# Effects that are off by default and need a value in the scene: the key that holds it.
_DATA_OF = {"residual_dropper_stiffness": "line.dropper.residual_stiffness_ratio"}


def check_effect_names(scene: Scene) -> Iterator[Fault]:
    """Unknown effects, and what is always simulated but switched off."""
    known = effects.registry()
    for name, on in scene.effects.items():
        key = f"effects.{name}"
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean effects.{near[0]}?" if near else f"known are {', '.join(known)}"
            yield Fault(key, f"{shown(key)[1:-1]} {scene.origin.of(key)} is unknown; {hint}")
        elif known[name].always and not on:
            yield scene.refused(key, "it is part of every scene and cannot be left out")


def check_requirements_of_chosen(scene: Scene) -> Iterator[Fault]:
    """Effects that the scene switches on without the effects that they require."""
    for name in scene.effects:
        yield from _requirements(scene, name, "on", f"effects.{name}")


def check_chosen_act(scene: Scene) -> Iterator[Fault]:
    """Effects that the scene switches on without anything for them to act on.

    One that lifts a limit is a permission, of which a scene need not make use. In a calm, such as
    a variant of a sweep, effects of the wind may stay on.
    """
    if scene.origin.recorded:
        return
    problem = functools.cache(lambda: problem_of(scene))
    calmed = _calmed(scene)
    for name, on in scene.effects.items():
        effect = effects.registry()[name]
        needs = on and effect.data and not effect.lifts and name not in calmed
        if needs and not effect.applies(problem()):
            lacking = f"it acts only with {effect.data}; give that, or leave the effect out"
            why = effect.instead(problem()) or lacking
            yield scene.refused(f"effects.{name}", why)


def _calmed(scene: Scene) -> set[str]:
    """Effects whose tables are there, but have nothing to do in a calm."""
    wind = scene.wind
    if wind is None or wind.speed_m_per_s > 0.0:
        return set()
    return {"wind"} if wind.gusts is None else {"wind", "gusts"}


def check_requirements_of_defaults(scene: Scene) -> Iterator[Fault]:
    """Of effects that are on by default, unless the scene holds nothing for them to act on."""
    problem = functools.cache(lambda: problem_of(scene))
    for name, effect in effects.registry().items():
        if name in scene.effects:
            continue
        for fault in _requirements(scene, name, "on by default", ""):
            if effect.applies(problem()):
                yield fault


def _requirements(scene: Scene, name: str, how: str, key: str) -> Iterator[Fault]:
    switches = scene.switches()
    for required in effects.registry()[name].requires if switches.get(name) else ():
        if not switches[required]:
            at = key or f"effects.{required}"
            yield Fault(
                at,
                f"effects.{name} is {how} and requires effects.{required}, which is off "
                f"{scene.origin.of(at)}; switch both on or both off",
            )


def check_effect_data(scene: Scene) -> Iterator[Fault]:
    """Effects without the value that they need, and values without their effect."""
    hung = hanging_table(scene.line)
    values = {"residual_dropper_stiffness": 0.0 if hung is None else hung.residual_stiffness_ratio}
    switches = scene.switches()
    for name, value in values.items():
        key = _DATA_OF[name]
        if switches.get(name) and value == 0:
            yield scene.refused(key, f"effects.{name} is on and needs a value greater than 0")
        if value > 0 and name not in scene.effects and switches.get(name) is False:
            yield scene.needs_effect(key, name)
    n = len(scene.train.pantographs)
    if n > 1 and scene.holds(Limit.ONE_PANTOGRAPH):
        key = "effects.several_pantographs"
        why = f"train.pantographs has {n} entries; leave one or switch it on"
        yield scene.refused(key, why)
