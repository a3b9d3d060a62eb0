"""The scene: everything a run is made of, as it is written in ``case.toml``.

``load_scene`` is the one way in. A loaded scene is valid: types, bounds, geometry and effects
have been checked, so that what follows meets no surprise.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator
from functools import cached_property
from typing import Any

from pydantic import Field, PrivateAttr

from catenary.cases.scene.input.faults import Fault, Origin
from catenary.cases.scene.input.toml_input import value_at
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Defect, IrregularitiesTable
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.line_data import line_data
from catenary.cases.scene.run.case import CaseTable, EvaluationTable, OutputTable
from catenary.cases.scene.run.contact import ContactTable
from catenary.cases.scene.run.incidents import Incident
from catenary.cases.scene.run.numerics import MeshTable, NumericsTable, WindowTable
from catenary.cases.scene.run.petsc import PetscTable
from catenary.cases.scene.run.wind import WindTable
from catenary.cases.scene.train.mechanism import Name
from catenary.cases.scene.train.pantograph import PantographTable
from catenary.cases.scene.train.train import TrainTable, VehicleTable
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.effects import all_effects as effect_registry
from catenary.solver.effects.effect import Limit


class Scene(Table):
    """All tables of a case."""

    case: CaseTable = Field(default_factory=CaseTable, description="what the case is")
    line: LineTable = Field(description="the line from anchor to anchor")
    irregularities: IrregularitiesTable = Field(
        default_factory=IrregularitiesTable, description="what is irregular about the line"
    )
    defects: list[Defect] = Field(
        default_factory=list, max_length=10_000, description="what is wrong with the line"
    )
    mesh: MeshTable = Field(default_factory=MeshTable, description="the finite-element mesh")
    pantographs: dict[Name, PantographTable] = Field(
        min_length=1, max_length=100, description="the kinds of pantograph, by name"
    )
    train: TrainTable = Field(description="the train and its pantographs")
    vehicle: VehicleTable | None = Field(
        None, description="how the vehicle moves its pantographs' bases"
    )
    wind: WindTable | None = Field(None, description="wind over the line")
    contact: ContactTable = Field(
        default_factory=ContactTable, description="contact between head and wire"
    )
    numerics: NumericsTable = Field(default_factory=NumericsTable, description="time stepping")
    window: WindowTable = Field(
        default_factory=WindowTable, description="the part of the line that moves with the train"
    )
    evaluation: EvaluationTable = Field(description="the stretch whose statistics are judged")
    incidents: list[Incident] = Field(
        default_factory=list, max_length=1000, description="what happens during the run"
    )
    output: OutputTable = Field(default_factory=OutputTable, description="what is written")
    effects: dict[str, bool] = Field(
        default_factory=dict, description="what is simulated; see `catenary plan`"
    )
    petsc: PetscTable = Field(
        default_factory=PetscTable, description="PETSc's solver options; those after -- win"
    )
    test: dict[str, Any] = Field(
        default_factory=dict, description="keys and values that shorten the case for tests"
    )

    _origin: Origin = PrivateAttr(default=Origin("the scene"))

    @property
    def origin(self) -> Origin:
        """Origin of the keys, for sentences about them."""
        return self._origin

    @cached_property
    def line_data(self) -> LineData:
        """The line as topologies take it, made once: all checks look at it.

        Raises
        ------
        InputError
            If the droppers are not declared for one of the span lengths.
        """
        return line_data(self.line, self._origin)

    @cached_property
    def _tables(self) -> dict[str, Any]:
        """The scene as tables, made once: checks look values up by their keys."""
        return self.model_dump()

    def refused(self, key: str, why: str, *, value: object = None) -> Fault:
        """The fault of a key: its value, where it was written, and why it cannot be.

        ``value`` is a part of the key's value, if that part alone cannot be.
        """
        value = self._at(key) if value is None else value
        return refusal(self._origin, key, value, why, by_default=not self._is_given(key))

    def among(
        self, key: str, known: Collection[str], has: str = "", *, name: str | None = None
    ) -> Iterator[Fault]:
        """The fault of a key whose name is unknown.

        Parameters
        ----------
        key : dotted key whose value is the name
        known : allowed names
        has : words that introduce them in the sentence, such as their owner
        name : the name, if the key has several
        """
        name = str(self._at(key)) if name is None else name
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            meant = f"did you mean {near[0]}?" if near else ""
            names = ", ".join(known)
            why = f"{meant} {has} {names}".strip() if has else meant or f"it must be one of {names}"
            yield self.refused(key, why, value=name)

    def _at(self, key: str) -> object:
        """The value of a dotted key, which exists; of an effect whether it is on."""
        if key.startswith("effects."):
            return self.switches()[key.removeprefix("effects.")]
        return value_at(self._tables, key)

    def _is_given(self, key: str) -> bool:
        """Whether a dotted key is written somewhere, and has no default value."""
        here: Any = self
        for part in key.split("."):
            below = _written(here)
            if part not in below:
                return False
            here = below[part]
        return True

    def fault(self, key: str, sentence: str) -> Fault:
        """The fault of a key; ``sentence`` continues after the key's name and place."""
        return Fault(key, f"{key} {self._origin.of(key)} {sentence}")

    def missing(self, key: str, meaning: str, why: str = "", *, of: str = "") -> Fault:
        """The fault of a key that is not there; ``of`` is the table that is, ``why`` a sentence's
        end."""
        end = f": {why}" if why else ""
        named = f"{key} ({meaning})" if meaning else key
        return Fault(key, f"{named} is missing {self._origin.of(of or key)}{end}")

    def needs_effect(self, key: str, effect: str) -> Fault:
        """The fault of a key that acts only with an effect that is off by default."""
        why = f"it acts only with effects.{effect} = true; write that, or false to leave it out"
        return self.refused(key, why)

    def switches(self) -> dict[str, bool]:
        """Every effect of the registry and whether it is on, in the registry's order."""
        return {
            name: effect.always or self.effects.get(name, effect.default)
            for name, effect in effect_registry.registry().items()
        }

    def holds(self, limit: Limit) -> bool:
        """Whether no effect that is on lifts a limit."""
        known, switches = effect_registry.registry(), self.switches()
        return not any(limit in known[name].lifts for name, on in switches.items() if on)


def _written(value: Any) -> dict[str, Any]:
    """What is written in a table or list, by keys or numbers."""
    if isinstance(value, Table):
        return {name: getattr(value, name) for name in value.model_fields_set}
    if isinstance(value, list | tuple):
        return {str(number): one for number, one in enumerate(value)}
    return value if isinstance(value, dict) else {}
