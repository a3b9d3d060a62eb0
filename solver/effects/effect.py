"""The registry of effects: each is declared once, and what a scene leaves out does not exist.

An effect names the unknowns that it needs at each wire node and carries one function that adds
its terms to a model under construction. The scene schema, the plan, the report and the model all
read this one table. To add an effect, write a module with such a function and ``register`` it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder
    from catenary.solver.problem.problem import Problem


@dataclass(frozen=True)
class Effect:
    """One effect.

    Attributes
    ----------
    name : key in the scene's ``[effects]`` table
    title : what is simulated, for the plan and the report
    adds : the terms that it adds, in words
    source : paper, standard or equation number
    default : whether a scene that says nothing simulates it
    unknowns : unknowns per wire node, e.g. ("w", "theta_y")
    requires : effects without which it makes no sense
    always : True for what no scene can leave out
    applies : whether the problem holds anything for it to act on
    build : adds its terms to the model; None where it only selects a law elsewhere
    """

    name: str
    title: str
    adds: str
    source: str
    default: bool
    unknowns: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    always: bool = False
    applies: Callable[[Problem], bool] = lambda problem: True
    build: Callable[[ModelBuilder], None] | None = None


_REGISTRY: dict[str, Effect] = {}


def register(effect: Effect) -> Effect:
    """Add an effect to the table and return it; a second one of the same name is an error."""
    if effect.name in _REGISTRY:
        raise ValueError(f"effect {effect.name} is registered already")
    _REGISTRY[effect.name] = effect
    return effect


def unregister(name: str) -> None:
    """Take an effect out of the table again."""
    del _REGISTRY[name]


def registered() -> dict[str, Effect]:
    """The effects registered so far by name, in the order in which they are built."""
    return dict(_REGISTRY)
