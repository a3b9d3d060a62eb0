"""Sets of scenes: directions, speeds, trains and samples of errors, each with each; bounds."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, field_validator, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.toml_input import parse_assignment
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Seed
from catenary.cases.scene.load import Draft
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.turned import FORWARD, turned
from catenary.cases.studies.sweep.jobs import STATISTICS

Direction = Literal["forward", "backward"]
MOST_SCENES = 1000
_LENGTHS = "irregularities.dropper_lengths"
_WHERE = "in the set of scenes"


def _is_statistic(name: str) -> str:
    if name not in STATISTICS:
        raise ValueError(f"must be one of {', '.join(STATISTICS)}")
    return name


Statistic = Annotated[str, AfterValidator(_is_statistic)]


class BoundTable(Table):
    """Bound that every pantograph of every scene must keep."""

    statistic: Statistic = Field(description="statistic of a run")
    at_least: float | None = Field(None, description="least value allowed")
    at_most: float | None = Field(None, description="greatest value allowed")

    @model_validator(mode="after")
    def _bounded(self) -> BoundTable:
        if (self.at_least is None) == (self.at_most is None):
            raise ValueError("needs at_least or at_most, one of both")
        return self

    @property
    def says(self) -> str:
        """The bound in words."""
        if self.at_least is not None:
            return f"{self.statistic} >= {self.at_least:g}"
        return f"{self.statistic} <= {self.at_most:g}"

    def margin(self, value: float) -> float:
        """Distance of a value from the bound, in its unit; negative beyond."""
        if self.at_least is not None:
            return value - self.at_least
        assert self.at_most is not None
        return self.at_most - value

    @property
    def scale(self) -> float:
        """Scale of margins: the absolute bound, or 100 if that is smaller than 1."""
        bound = self.at_most if self.at_least is None else self.at_least
        assert bound is not None
        return abs(bound) if abs(bound) >= 1.0 else 100.0


class ErrorSamples(Table):
    """Lines whose droppers are cut with random errors, beside the one without."""

    dropper_lengths_mm: float = Field(
        gt=0, le=200, description="standard deviation of the errors of dropper lengths"
    )
    seeds: list[Seed] = Field(
        min_length=1, max_length=1000, description="one line with errors for each"
    )


class SetTable(Table):
    """The scenes of a study: all combinations of what is given."""

    directions: list[Direction] = Field(
        ["forward", "backward"], min_length=1, max_length=2, description="forward, backward"
    )
    speeds_km_h: list[Annotated[float, Field(ge=1, le=1000)]] | None = Field(
        None, min_length=1, max_length=100, description="train speeds; the case's if absent"
    )
    trains: dict[str, list[str]] = Field(
        default_factory=dict,
        max_length=100,
        description="trains by name, each a list of key=value; the case's train if absent",
    )
    errors: ErrorSamples | None = Field(None, description="samples of installation errors")

    @field_validator("directions")
    @classmethod
    def _differ(cls, given: list[str]) -> list[str]:
        if len(set(given)) < len(given):
            raise ValueError("must name a direction once")
        return given

    @property
    def seeds(self) -> Sequence[int | None]:
        """Seeds of the samples; None stands for the line without errors, which comes first."""
        return [None] if self.errors is None else [None, *self.errors.seeds]


class Member(NamedTuple):
    """A scene of a set: in what it differs from the case.

    Attributes
    ----------
    direction : "forward" or "backward"
    speed : [km/h], None for that of the case
    train : name, empty for that of the case
    seed : of the errors, None without errors
    values : pairs of dotted key and value, which the case's values give way to
    """

    direction: str
    speed: float | None
    train: str
    seed: int | None
    values: tuple[tuple[str, Any], ...]

    @property
    def name(self) -> str:
        """Distinguishing label: direction, and speed, train and seed as far as they are given."""
        parts = [self.direction]
        parts += [] if self.speed is None else [f"{self.speed:g} km/h"]
        parts += [self.train] if self.train else []
        parts += [] if self.seed is None else [f"seed {self.seed}"]
        return ", ".join(parts)


def members_of(table: SetTable) -> list[Member]:
    """All scenes of a set.

    Raises
    ------
    InputError
        If there are more than ``MOST_SCENES``, or an assignment of a train is none.
    """
    trains = {
        name: [parse_assignment(text, f"train {name}:") for text in texts]
        for name, texts in (table.trains or {"": []}).items()
    }
    speeds: Sequence[float | None] = table.speeds_km_h or [None]
    combined = itertools.product(table.directions, speeds, trains, table.seeds)
    found = [
        _member(table, direction, speed, train, seed, tuple(trains[train]))
        for direction, speed, train, seed in combined
    ]
    if len(found) > MOST_SCENES:
        raise InputError(f"the set has {len(found)} scenes; at most {MOST_SCENES} are allowed")
    return found


def _member(
    table: SetTable,
    direction: str,
    speed: float | None,
    train: str,
    seed: int | None,
    of_train: tuple[tuple[str, Any], ...],
) -> Member:
    values = [*of_train]
    if speed is not None:
        values.append(("train.speed_km_h", speed))
    if seed is not None:
        assert table.errors is not None
        values.append((f"{_LENGTHS}.standard_deviation_mm", table.errors.dropper_lengths_mm))
        values.append((f"{_LENGTHS}.seed", seed))
    return Member(direction, speed, train, seed, tuple(values))


@dataclass(frozen=True)
class SceneSet:
    """A case and the members that are made of it.

    Attributes
    ----------
    draft : the case
    members : at least one
    """

    draft: Draft
    members: Sequence[Member]

    def scene(self, member: Member, values: Mapping[str, Any] | None = None) -> Scene:
        """The scene of a member, with further values by dotted keys, which win. Not collective.

        Raises
        ------
        InputError
            If it is wrong, or cannot be run in its direction.
        """
        own: Iterable[tuple[str, Any]] = (*member.values, *(values or {}).items())
        scene = self.draft.assigned((key, value, _WHERE) for key, value in own).scene()
        return scene if member.direction == FORWARD else turned(scene)

    def checked(self) -> SceneSet:
        """This set, all scenes of which can be made as the case has them.

        Raises
        ------
        InputError
            With the name of the member whose scene is wrong.
        """
        for member in self.members:
            try:
                self.scene(member)
            except InputError as error:
                raise InputError(f"scene {member.name}: {error}") from error
        return self
