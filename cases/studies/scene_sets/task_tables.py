"""Tables that files of studies over sets of scenes share, and how such a file is read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, Field, ValidationError, model_validator

from catenary.cases.scene.input.faults import Origin, SceneError, text_faults
from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.scene.keys.error_sentences import schema_faults
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.sweep.jobs import STATISTICS

OwnTable = TypeVar("OwnTable", bound=Table)


def _is_statistic(name: str) -> str:
    if name not in STATISTICS:
        raise ValueError(f"must be one of {', '.join(STATISTICS)}")
    return name


Statistic = Annotated[str, AfterValidator(_is_statistic)]


class BoundTable(Table):
    """What every pantograph of every scene must keep."""

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
        """By how much a value is within the bound, in its unit; negative beyond."""
        if self.at_least is not None:
            return value - self.at_least
        assert self.at_most is not None
        return self.at_most - value

    @property
    def scale(self) -> float:
        """What margins may be divided by: the bound, or 100 if that is smaller than 1."""
        bound = self.at_most if self.at_least is None else self.at_least
        assert bound is not None
        return abs(bound) if abs(bound) >= 1.0 else 100.0


def read_task(task: Path | Mapping[str, Any], model: type[OwnTable]) -> OwnTable:
    """The checked content of a task: a TOML file, or its nested tables.

    Raises
    ------
    InputError
        If the file cannot be read, or with all faults of its keys.
    """
    if isinstance(task, Mapping):
        raw, origin = dict(task), Origin("the table of the task")
    else:
        raw, origin = read_toml(task), Origin(str(task))
    faults, more = text_faults(raw, origin), 0
    try:
        table = model.model_validate(raw)
    except ValidationError as failed:
        of_schema, more = schema_faults(failed, raw, model, origin)
        faults += of_schema
    if faults:
        raise SceneError(faults, more)
    return table
