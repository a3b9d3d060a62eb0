"""The task of an identification, ``task.toml``: what was measured, and what is looked for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table

_UNITS = {"N": 1.0, "kN": 1e3, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "s": 1.0, "ms": 1e-3}
_POSITIVE = Annotated[float, Field(gt=0.0, le=1e9)]
_NOT_NEGATIVE = Annotated[float, Field(ge=0.0, le=1e9)]
_NAME = Annotated[str, Field(min_length=1, max_length=100)]


class _Column(Table):
    column: _NAME

    @property
    def factor(self) -> float:
        """From the column's unit to SI."""
        return _UNITS[self.unit]  # type: ignore[attr-defined, no-any-return]


class Place(_Column):
    """The column of places along the track."""

    unit: Literal["m", "km"] = "m"


class Time(_Column):
    """The column of times since the start of the march."""

    unit: Literal["s", "ms"] = "s"


class _Signal(_Column):
    noise: _POSITIVE
    bias: _NOT_NEGATIVE = 0.0


class Force(_Signal):
    """The column of contact forces; ``noise`` and ``bias`` in its unit."""

    unit: Literal["N", "kN"] = "N"


class Height(_Signal):
    """The column of head heights above top of rail; ``noise`` and ``bias`` in its unit."""

    unit: Literal["m", "cm", "mm"] = "m"


class Measured(Table):
    """What was measured, and how well.

    Attributes
    ----------
    place, time : which of the two columns there is; place is start + speed time
    force, head_height : at least one of them
    pantograph : number of the pantograph on the train, from 1
    filter_Hz : bandwidth of force and height, the cut-off of the filter of EN 50317
    is_filtered : whether the values in the file have passed this filter, and noise is theirs;
        otherwise noise is that of each sample, independent of others, and the filter is applied
    from_m, to_m : stretch that is compared; that of the scene's evaluation if absent
    """

    place: Place | None = None
    time: Time | None = None
    force: Force | None = None
    head_height: Height | None = None
    pantograph: Annotated[int, Field(ge=1, le=100)] = 1
    filter_Hz: Annotated[float, Field(gt=0.0, le=1e3)] = 20.0
    is_filtered: bool = True
    from_m: float | None = None
    to_m: float | None = None

    @model_validator(mode="after")
    def _columns(self) -> Measured:
        if (self.place is None) == (self.time is None):
            raise ValueError("must name the column of one of place and time")
        if self.force is None and self.head_height is None:
            raise ValueError("must name the column of force, of head_height, or of both")
        return self


class Sought(Table):
    """A parameter that is looked for.

    Attributes
    ----------
    key : of the scene, as `catenary sensitivity` takes it
    deviation : standard deviation of the prior, in the unit of the key
    mean : of the prior; the scene's value if absent
    """

    key: _NAME
    deviation: _POSITIVE
    mean: float | None = None


class Droppers(Table):
    """Errors of lengths of all droppers in some spans; ``spans`` counts from 1, ``deviation_mm`` is
    the standard deviation of their prior."""

    spans: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=1, max_length=1000)]
    deviation_mm: _POSITIVE


class Task(Table):
    """The whole file."""

    measured: Measured
    parameters: Annotated[list[Sought], Field(max_length=1000)] = []
    droppers: Droppers | None = None

    @model_validator(mode="after")
    def _something(self) -> Task:
        if not self.parameters and self.droppers is None:
            raise ValueError("must have [[parameters]] or [droppers] to look for")
        return self
