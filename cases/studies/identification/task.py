"""The task of an identification, ``task.toml``: what was measured, and what is looked for."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.measured.description import NAME, POSITIVE, Measured


class Sought(Table):
    """A parameter that is looked for.

    Attributes
    ----------
    key : of the scene, as `catenary sensitivity` takes it
    deviation : standard deviation of the prior, in the unit of the key
    mean : of the prior; the scene's value if absent
    """

    key: NAME
    deviation: POSITIVE
    mean: float | None = None


class Droppers(Table):
    """Errors of lengths of all droppers in some spans; ``spans`` counts from 1, ``deviation_mm`` is
    the standard deviation of their prior."""

    spans: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=1, max_length=1000)]
    deviation_mm: POSITIVE

    @field_validator("spans")
    @classmethod
    def _differ(cls, given: list[int]) -> list[int]:
        if len(set(given)) < len(given):
            raise ValueError("must name each span once")
        return given


class Supports(Table):
    """Heights of the contact wire at some supports; ``supports`` counts from 0 at the start of the
    line, ``deviation_mm`` is the standard deviation of their prior."""

    supports: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1, max_length=1000)]
    deviation_mm: POSITIVE


class Task(Table):
    """The whole file; ``starts`` is the number of searches, the first from the means of the priors,
    others from draws of them, of which the best is taken. None: one, and two more if that leaves a
    residual that is unlikely."""

    measured: Measured
    starts: Annotated[int, Field(ge=1, le=100)] | None = None
    parameters: Annotated[list[Sought], Field(max_length=1000)] = []
    droppers: Droppers | None = None
    heights: Supports | None = None

    @model_validator(mode="after")
    def _something(self) -> Task:
        if not self.parameters and self.droppers is None and self.heights is None:
            raise ValueError("must have [[parameters]], [droppers] or [heights] to look for")
        for name in ("force", "head_height"):
            signal = getattr(self.measured, name)
            if signal is not None and signal.noise is None:
                raise ValueError(f"must have measured.{name}.noise, which weighs the samples")
        return self
