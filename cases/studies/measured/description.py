"""The description of a measurement: columns, units and noise of a CSV file, as tables of TOML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.task_files import read_task

_UNITS = {"N": 1.0, "kN": 1e3, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "s": 1.0, "ms": 1e-3}
POSITIVE = Annotated[float, Field(gt=0.0, le=1e9)]
_NOT_NEGATIVE = Annotated[float, Field(ge=0.0, le=1e9)]
NAME = Annotated[str, Field(min_length=1, max_length=100)]
_NUMBER = Annotated[int, Field(ge=1, le=100)]


class _Column(Table):
    column: NAME

    @property
    def factor(self) -> float:
        """From the column's unit to SI."""
        return _UNITS[self.unit]  # type: ignore[attr-defined, no-any-return]


class Place(_Column):
    """The column of places along the track.

    Attributes
    ----------
    zero_m : place by the file's count at the begin of the run's line [m]
    direction : whether it counts with the run's train, or against it
    """

    unit: Literal["m", "km"] = "m"
    zero_m: float = 0.0
    direction: Literal["with", "against"] = "with"

    def on_line(self, values: np.ndarray) -> np.ndarray:
        """Places (n,) along the run's line [m] of the column's values."""
        sign = 1.0 if self.direction == "with" else -1.0
        return sign * (values * self.factor - self.zero_m)


class Time(_Column):
    """The column of times since the start of the march."""

    unit: Literal["s", "ms"] = "s"


class _Signal(_Column):
    noise: POSITIVE | None = None
    bias: _NOT_NEGATIVE = 0.0


class Force(_Signal):
    """The column of contact forces; ``noise`` and ``bias`` in its unit."""

    unit: Literal["N", "kN"] = "N"


class Height(_Signal):
    """The column of head heights above top of rail; ``noise`` and ``bias`` in its unit."""

    unit: Literal["m", "cm", "mm"] = "m"


class Measured(Table):
    """Measured quantities and their noise.

    Attributes
    ----------
    place, time : column of places, or of times, one of them; place is start + speed time
    force, head_height : columns of the signals, at least one of them
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
    pantograph: _NUMBER = 1
    filter_Hz: Annotated[float, Field(ge=1e-3, le=1e3)] = 20.0
    is_filtered: bool = True
    from_m: float | None = None
    to_m: float | None = None

    @model_validator(mode="after")
    def _columns(self) -> Measured:
        if (self.place is None) == (self.time is None):
            raise ValueError("must name the column of one of place and time")
        if self.force is None and self.head_height is None:
            raise ValueError("must name the column of force, of head_height, or of both")
        if self.from_m is not None and self.to_m is not None and self.to_m <= self.from_m:
            raise ValueError(
                f"must have to_m greater than from_m, but they are {self.to_m:g} and "
                f"{self.from_m:g}"
            )
        return self


class OtherPantograph(Table):
    """Columns of a further pantograph of the same passage, at the same places or times."""

    pantograph: _NUMBER
    force: Force


class Largest(_Column):
    """The column of largest uplifts; ``noise`` in its unit."""

    unit: Literal["m", "cm", "mm"] = "m"
    noise: POSITIVE | None = None


class Uplift(Table):
    """A CSV file of largest uplifts at supports, beside the description.

    Attributes
    ----------
    file : its name
    place : of the supports along the track
    largest : uplift of the contact wire there in the passage
    """

    file: NAME
    place: Place
    largest: Largest


class Tolerances(Table):
    """Tolerances of a run against the measurement, in place of the usual ones."""

    mean_N: POSITIVE | None = None
    std_percent: POSITIVE | None = None
    maximum_N: POSITIVE | None = None
    minimum_N: POSITIVE | None = None
    uplift_mm: POSITIVE | None = None
    contact_height_range_mm: POSITIVE | None = None


class Description(Table):
    """Measured passage of a line test, for a comparison with a run."""

    measured: Measured
    others: Annotated[list[OtherPantograph], Field(max_length=20)] = []
    uplift: Uplift | None = None
    tolerances: Tolerances = Tolerances()

    @model_validator(mode="after")
    def _forces(self) -> Description:
        if self.measured.force is None:
            raise ValueError("must name the column measured.force, by which a run is aligned")
        numbers = [self.measured.pantograph, *(one.pantograph for one in self.others)]
        if len(set(numbers)) < len(numbers):
            raise ValueError("must name each pantograph once")
        return self


def read_description(path: Path) -> Description:
    """The description in a TOML file. Not collective.

    Raises
    ------
    InputError
        If it is none.
    """
    return read_task(path, Description)
