"""The task of an optimisation: what FILE.toml may hold, and the variables of a case by it.

Variables are changes of keys of a scene, entry by entry of their lists.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import (
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.case_files import value_at
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Seed
from catenary.cases.scene.scene import Scene, resolved
from catenary.cases.studies.scene_sets import (
    BoundTable,
    SetTable,
    Statistic,
    refuse_contradictions,
)
from catenary.cases.studies.sweep.variants import check_key, is_number, share_a_value

GRADIENT, CMA = "gradient", "cma"
Bounds = Annotated[list[float], Field(min_length=2, max_length=2)]
_Number = Annotated[int, Field(ge=1, le=10_000)]
_Alike = Annotated[list[_Number], Field(min_length=1)]
# Keys whose entries are places along a span: of two that are symmetric one moves against the other.
_PLACES = "positions_m"
# Finite differences take this share of the width of the bounds.
_USUAL_STEP = 0.02


def _in_one_sentence(given: Any, check: ValidatorFunctionWrapHandler) -> Any:
    try:
        return check(given)
    except ValidationError as error:
        raise ValueError(
            "must be symmetric, free, together or lists of the numbers, from 1, of entries that "
            "change alike, such as [[1, 9], [2, 8]]"
        ) from error


Entries = Annotated[
    Literal["symmetric", "free", "together"] | Annotated[list[_Alike], Field(min_length=1)],
    WrapValidator(_in_one_sentence),
]


class VariableTable(Table):
    """A key of the scene that is varied: a number, or the entries of a list."""

    key: str = Field(min_length=1, max_length=200, description="dotted key of the scene")
    entries: Entries = Field(
        "symmetric",
        description="of a list: symmetric entries about its middle change alike, each is free, all "
        "change together, or lists of the numbers, from 1, of entries that change alike",
    )
    change: Bounds | None = Field(
        None, description="least and greatest change from the case's value, in the key's unit"
    )
    bounds: Bounds | None = Field(None, description="in place of it, bounds of the value itself")
    step: float | None = Field(
        None, gt=0, description="of finite differences; a fiftieth of the bounds' width if absent"
    )
    round_to: float | None = Field(
        None, gt=0, description="the optimum's changes are whole multiples of it"
    )

    @model_validator(mode="after")
    def _bounded(self) -> VariableTable:
        if (self.change is None) == (self.bounds is None):
            raise ValueError("needs change or bounds, one of both")
        low, high = self.change or self.bounds or (0.0, 0.0)
        if high <= low:
            raise ValueError(f"must have a greater second bound, but has {low:g} and {high:g}")
        if self.change is not None and not low <= 0.0 <= high:
            raise ValueError(
                f"must have 0 within change, which is the case as it stands, but has {low:g} and "
                f"{high:g}"
            )
        return self


class ObjectiveTable(Table):
    """Statistic that is minimised."""

    statistic: Statistic = Field("std_N", description="statistic of a run")
    over: Literal["worst", "mean"] = Field(
        "worst", description="the greatest value of all pantographs of all scenes, or their mean"
    )
    speeds_km_h: list[float] | None = Field(
        None, min_length=1, description="of the set's speeds those that count; all if absent"
    )


class ConstraintTable(BoundTable):
    """A bound of every pantograph of every scene, or of their change."""

    of_shipped: Literal["each", "speed"] | None = Field(
        None,
        description="the bound is a share of the value as shipped: of each pantograph of each "
        "scene, or of the worst one at its speed",
    )


class SearchTable(Table):
    """Search for the optimum."""

    methods: list[Literal["gradient", "cma"]] = Field(
        ["gradient"],
        min_length=1,
        max_length=2,
        description="sequential quadratic programming on finite differences, evolution strategy",
    )
    most_runs: int = Field(
        2000, ge=1, le=10**6, description="runs of each method after which it ends with the best"
    )
    precision: float = Field(
        1e-3, gt=0, le=0.1, description="relative change of the objective that ends a search"
    )
    short: bool = Field(
        False, description="search on the case shortened by its [test] table, and check on all"
    )
    values: list[str] = Field(
        default_factory=list,
        max_length=100,
        description="key=value of the search alone, such as a longer step; checks have the case's",
    )
    seed: Seed = Field(1, description="of the evolution strategy")


class ChecksTable(Table):
    """Errors with which each optimum is run that no search has seen."""

    dropper_lengths_mm: float = Field(
        5.0, gt=0, le=200, description="standard deviation of errors of dropper lengths"
    )
    n_seeds: int = Field(3, ge=0, le=1000, description="number of lines with such errors")


class OptimiseTask(Table):
    """Variables, objective and constraints, and the scenes over which they are meant."""

    set: SetTable = Field(default_factory=SetTable, description="the scenes")
    variables: list[VariableTable] = Field(
        min_length=1, max_length=100, description="what is chosen"
    )
    objective: ObjectiveTable = Field(
        default_factory=ObjectiveTable, description="what is made least"
    )
    constraints: list[ConstraintTable] = Field(
        default_factory=list, max_length=100, description="what must be kept"
    )
    least_dropper_force_N: float = Field(
        10.0, ge=0, le=1000, description="tension that every dropper of the line keeps at rest"
    )
    search: SearchTable = Field(default_factory=SearchTable, description="the search")
    checks: ChecksTable = Field(default_factory=ChecksTable, description="checks of the optimum")

    @model_validator(mode="after")
    def _of_the_set(self) -> OptimiseTask:
        known = self.set.speeds_km_h or []
        for speed in self.objective.speeds_km_h or []:
            if speed not in known:
                raise ValueError(
                    f"must have the speeds of its objective in set.speeds_km_h, which has no "
                    f"{speed:g}"
                )
        return self

    @model_validator(mode="after")
    def _can_be_kept(self) -> OptimiseTask:
        for kind in (None, "each", "speed"):
            own = [one for one in self.constraints if one.of_shipped == kind]
            refuse_contradictions(own, "constraints", are_shares=kind is not None)
        return self


class Component(NamedTuple):
    """One number that a search chooses: by how much some entries change.

    Attributes
    ----------
    key : dotted key
    entries : numbers of the entries of its list, from 0; none of a single number
    signs : of each entry's change, 1 or -1
    low, high : bounds of the change, in the key's unit
    step : of finite differences, in the key's unit
    round_to : the unit of its changes, 0 for any
    """

    key: str
    entries: tuple[int, ...]
    signs: tuple[int, ...]
    low: float
    high: float
    step: float
    round_to: float

    @property
    def name(self) -> str:
        """Key and numbers of entries, from 1."""
        if not self.entries:
            return self.key
        return f"{self.key} {', '.join(str(entry + 1) for entry in self.entries)}"


@dataclass(frozen=True)
class Variables:
    """All components, and the values of their keys as the case has them.

    A change of all is an array, shape (n,), each component in the unit of its key.
    """

    components: Sequence[Component]
    shipped: dict[str, Any]

    @property
    def low(self) -> np.ndarray:
        """Lower bounds of the change, shape (n,)."""
        return np.array([one.low for one in self.components])

    @property
    def high(self) -> np.ndarray:
        """Upper bounds of the change, shape (n,)."""
        return np.array([one.high for one in self.components])

    @property
    def steps(self) -> np.ndarray:
        """Steps of finite differences, shape (n,)."""
        return np.array([one.step for one in self.components])

    def values(self, change: np.ndarray) -> dict[str, Any]:
        """Values by dotted keys after a change, shape (n,)."""
        found = {
            key: list(value) if isinstance(value, list) else value
            for key, value in self.shipped.items()
        }
        for one, by in zip(self.components, change.tolist(), strict=True):
            if not one.entries:
                found[one.key] += by
            for entry, sign in zip(one.entries, one.signs, strict=True):
                found[one.key][entry] += sign * by
        return found

    def rounded(self, change: np.ndarray) -> np.ndarray:
        """The change with each component a whole multiple of its unit, within bounds."""
        found = change.copy()
        for i, one in enumerate(self.components):
            if one.round_to:
                # Whole units from the case's value, so that a change can be measured off.
                least, most = np.ceil(one.low / one.round_to), np.floor(one.high / one.round_to)
                found[i] = one.round_to * np.clip(np.round(change[i] / one.round_to), least, most)
        return found


def variables_of(tables: Sequence[VariableTable], scene: Scene) -> Variables:
    """The variables of a task for a case.

    Raises
    ------
    InputError
        If a key has no number or list of numbers in the scene, or is varied twice, or if its
        entries are not there, or its value is out of its bounds.
    """
    components: list[Component] = []
    shipped: dict[str, Any] = {}
    tables_of_scene = resolved(scene)
    for number, table in enumerate(tables):
        where = f"variables.{number}.key"
        for other in shipped:
            if share_a_value(table.key, other):
                by = "" if table.key == other else f", also by {other}"
                raise InputError(f"{where} is {table.key}, which is varied twice{by}; name it once")
        value = _value(tables_of_scene, table.key, where)
        shipped[table.key] = value
        entries = _classes(table, len(value), number) if isinstance(value, list) else [()]
        for own in entries:
            components.append(_component(table, own, value, number))
    return Variables(components, shipped)


def _value(tables: dict[str, Any], key: str, where: str) -> Any:
    check_key(key, f"in {where}")
    found = value_at(tables, key)
    numbers = found if isinstance(found, list) and found else [found]
    if not all(is_number(one) for one in numbers):
        raise InputError(
            f"{where} is {key}, which has no number or list of numbers in the scene; give it there "
            f"first, e.g. by {option('--set', 'replace()')}"
        )
    return [float(one) for one in found] if isinstance(found, list) else float(found)


def _classes(table: VariableTable, n: int, number: int) -> list[tuple[int, ...]]:
    """Entries that change alike, numbers from 0."""
    if table.entries == "free":
        return [(i,) for i in range(n)]
    if table.entries == "together":
        return [tuple(range(n))]
    if table.entries == "symmetric":
        pairs: list[tuple[int, ...]] = [(i, n - 1 - i) for i in range(n // 2)]
        is_place = table.key.endswith(_PLACES)  # the one in the middle stays there
        return pairs if is_place or n % 2 == 0 else [*pairs, (n // 2,)]
    given = [entry for own in table.entries for entry in own]
    if len(set(given)) < len(given) or max(given) > n:
        raise InputError(
            f"variables.{number}.entries must name each entry of {table.key} once at most, from 1 "
            f"to {n}"
        )
    return [tuple(entry - 1 for entry in own) for own in table.entries]


def _component(
    table: VariableTable, entries: tuple[int, ...], value: Any, number: int
) -> Component:
    mirrored = table.key.endswith(_PLACES) and table.entries == "symmetric"
    signs = (1, -1) if mirrored else (1,) * len(entries)
    if table.change is not None:
        low, high = table.change
    else:
        assert table.bounds is not None
        own = np.array([value[entry] for entry in entries] if entries else [value])
        least, most = table.bounds
        outside = own[(own < least) | (own > most)]
        if outside.size:
            raise InputError(
                f"variables.{number}.bounds are {least:g} and {most:g}, but {table.key} has "
                f"{outside[0]:g} in the case, where the search begins"
            )
        up = np.array(signs or (1,)) > 0
        low = -float(np.where(up, own - least, most - own).min())
        high = float(np.where(up, most - own, own - least).min())
        if high <= low:
            raise InputError(f"variables.{number}.bounds leave {table.key} no change")
    if table.round_to is not None and table.round_to > max(-low, high):
        raise InputError(
            f"variables.{number}.round_to is {table.round_to:g}, but {table.key} may change by "
            f"{max(-low, high):g} at most, so that 0 is its only multiple left"
        )
    step = table.step or _USUAL_STEP * (high - low)
    if step > 0.5 * (high - low):  # so that one fits, up or down, wherever a search is
        raise InputError(
            f"variables.{number}.step is {step:g}, but the bounds of {table.key} are "
            f"{high - low:g} apart: it may be half of that at most"
        )
    return Component(table.key, entries, signs, low, high, step, table.round_to or 0.0)
