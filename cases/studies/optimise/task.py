"""The task of an optimisation: what FILE.toml may hold."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Seed
from catenary.cases.studies.scene_sets import (
    BoundTable,
    SetTable,
    Statistic,
    refuse_contradictions,
)

GRADIENT, CMA = "gradient", "cma"
Bounds = Annotated[list[float], Field(min_length=2, max_length=2)]
_Number = Annotated[int, Field(ge=1, le=10_000)]
_Alike = Annotated[list[_Number], Field(min_length=1)]


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
