"""The registry of effects: each is declared once, and what a scene leaves out does not exist.

An effect declares all that it contributes: unknowns of each wire, terms of the model
(matrices, weights, loads in time), laws of the time loop and of the line at rest, limits of a scene
that it lifts. The scene schema, the plan, the report and the model all read this one table. To add
an effect, write a module that makes one and give it its place where all are registered.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from catenary.meshgen.line import Line
    from catenary.meshgen.wires import Role
    from catenary.solver.model.builder import ModelBuilder
    from catenary.solver.problem.problem import Problem, Simulated


class Limit(Enum):
    """A limit of all scenes without an effect that lifts it."""

    WAVE_SPEED = "the train is slower than the slowest wave of the contact wire"
    ONE_PANTOGRAPH = "the train has one pantograph"


class NamedWire(Protocol):
    """Interface of a wire to effects, such as ``meshgen.wires.Wire``."""

    @property
    def name(self) -> str: ...

    @property
    def role(self) -> Role: ...


@dataclass(frozen=True)
class Effect:
    """One effect.

    Attributes
    ----------
    name : key in the scene's ``[effects]`` table
    title : the simulated effect in words, for the plan and the report
    adds : the terms that it adds, in words
    source : paper, standard or equation number
    default : whether scenes simulate it by default
    unknowns_of_wire : unknowns that it needs at the nodes of a wire, by its name and role; those of
        one plane together, e.g. ("w", "theta_y")
    requires : effects without which it makes no sense
    always : True for an effect that no scene can switch off
    applies : whether the problem has data for it to act on
    instead : reason why it does not act on the data that a problem has for it; "" if it acts or the
        problem has no such data
    build : adds matrices, weights, held unknowns and loads in time to the model
    components : names of components that ``build`` adds beside wires and groups of the line, to
        which a scene may give damping
    law : returns the record of laws with the fields that the effect sets. Effects are applied in
        building order, so that an effect may change fields set by one that it requires
    of_form : whether ``build`` reads the shape at rest, ``Model.form``
    lifts : limits of a scene that do not hold with the effect
    data : keys of the scene's data that it acts on; empty if it acts on any scene
    after_cutting : True for an effect on a line whose droppers are cut: form finding leaves it out,
        and the line then hangs with it (`rest_nearby.hang`)
    cut_for : of an effect after cutting, True where droppers are cut for it
    hangs : of an effect after cutting, what the line's wires become with it
    """

    name: str
    title: str
    adds: str
    source: str
    default: bool = True
    unknowns_of_wire: Callable[[NamedWire], tuple[str, ...]] | None = None
    requires: tuple[str, ...] = ()
    always: bool = False
    applies: Callable[[Problem], bool] = lambda problem: True
    instead: Callable[[Problem], str] = lambda problem: ""
    build: Callable[[ModelBuilder], None] | None = None
    components: tuple[str, ...] = ()
    law: Callable[[Simulated, Problem], Simulated] | None = None
    lifts: tuple[Limit, ...] = ()
    data: str = ""
    of_form: bool = False
    after_cutting: bool = False
    cut_for: bool = False
    hangs: Callable[[Line, Problem], Line] | None = None

    @property
    def n_laws(self) -> int:
        """Contributions that are no terms of the model: a law, wires that change, limits lifted."""
        return int(self.law is not None) + int(self.hangs is not None) + len(self.lifts)


_REGISTRY: dict[str, Effect] = {}


def register(*effects: Effect) -> None:
    """Add effects to the table, in building order.

    Raises
    ------
    ValueError
        If there is one of that name, or if an effect contributes nothing.
    """
    for effect in effects:
        if effect.name in _REGISTRY:
            raise ValueError(f"effect {effect.name} is registered already")
        if not (effect.unknowns_of_wire or effect.build or effect.n_laws):
            raise ValueError(f"effect {effect.name} has no unknowns, build, law or lifted limit")
        _REGISTRY[effect.name] = effect


def unregister(name: str) -> None:
    """Take an effect out of the table again."""
    del _REGISTRY[name]


def registered() -> dict[str, Effect]:
    """The effects registered so far by name, in the order in which they are built."""
    return dict(_REGISTRY)
