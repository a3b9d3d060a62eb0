"""Measured passages: what a CSV file holds, described in TOML, and its columns.

The description has columns, units and noise. From the CSV files of a measurement come columns, and
a passage in SI units.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.csv_files import DECIMAL_COMMAS
from catenary.cases.scene.input.plain_text import plain, read_text
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.task_files import checked_table, read_task
from catenary.postproc.measurements.passage import MeasuredForce, MeasuredUplift, Passage
from catenary.postproc.read.results import Results

_UNITS = {"N": 1.0, "kN": 1e3, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "s": 1.0, "ms": 1e-3}
POSITIVE = Annotated[float, Field(gt=0.0, le=1e9)]
_NOT_NEGATIVE = Annotated[float, Field(ge=0.0, le=1e9)]
NAME = Annotated[str, Field(min_length=1, max_length=100)]
_NUMBER = Annotated[int, Field(ge=1, le=100)]
LEAST_SAMPLES = 20
# Samples are equidistant if none is further from even steps than this part of a step. Places in
# whole centimetres may be up to one off, as far as this is at most the second part.
_EVEN, _CENTIMETRE, _ROUNDED = 0.05, 0.0101, 0.1
# Names of columns that need no description, with their units.
_USUAL = {
    "place": {"place_m": "m", "place_km": "km"},
    "time": {"time_s": "s"},
    "force": {"force_N": "N", "force_kN": "kN"},
    "head_height": {"head_height_m": "m", "head_height_mm": "mm"},
}


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

    def in_si(self, table: pd.DataFrame, path: str) -> tuple[np.ndarray, float, float]:
        """Values (n,), NaN where there is none, noise and bias of a table's column."""
        values = column_of(table, path, self.column, may_lack=True) * self.factor
        return values, (self.noise or 0.0) * self.factor, self.bias * self.factor


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


def read_table(path: Path) -> pd.DataFrame:
    """The table of a CSV file, with commas or with semicolons or tabs and decimal commas or points.

    Separators at the end of a line make no column.

    Raises
    ------
    InputError
        If it is none.
    """
    lines = [line.partition("#")[0].rstrip() for line in read_text(path, str(path)).splitlines()]
    separator = next((one for one in ";\t" if any(one in line.strip() for line in lines)), ",")
    text = "\n".join(line.rstrip(separator) for line in lines)
    if not text.strip():
        raise InputError(f"{path} is no table of CSV: it is empty")
    try:
        table = pd.read_csv(
            io.StringIO(text if separator == "," else text.replace(",", ".")),
            sep=separator,
            skipinitialspace=True,
        )
    except ValueError as error:  # pandas' ParserError is one
        why = str(error).strip().removeprefix("Error tokenizing data. C error: ")
        raise InputError(f"{path} is no table of CSV: {plain(why, 200)}") from error
    if not isinstance(table.index, pd.RangeIndex):  # pandas takes the values in excess as names
        raise InputError(
            f"{path} has more values in a row than the names of columns, {columns_in(table)}: "
            f"{DECIMAL_COMMAS}"
        )
    return table


def columns_in(table: pd.DataFrame) -> str:
    """Names of the first columns of a table, for a sentence."""
    return ", ".join(plain(str(column), 40) for column in table.columns[:12])


def column_of(table: pd.DataFrame, path: str, name: str, may_lack: bool = False) -> np.ndarray:
    """The numbers (n,) of a column in the file's unit.

    Parameters
    ----------
    path : name of the table in sentences
    may_lack : whether a cell without a finite number is NaN, not an error

    Raises
    ------
    InputError
        If there is no such column, several, or a cell without a number.
    """
    if name not in table:
        raise InputError(f'{path} has no column "{plain(name, 100)}": it has {columns_in(table)}')
    if list(table.columns).count(name) > 1 or f"{name}.1" in table:  # as pandas names the second
        raise InputError(f'{path} has several columns "{plain(name, 100)}"; give each its own name')
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float, copy=True)
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size and not may_lack:
        cell = table[name].iloc[wrong[0]]
        has = "no number" if pd.isna(cell) else f'"{plain(str(cell), 40)}"'
        needs = "each row needs a finite number there"
        if "," in str(cell):  # where semicolons or tabs stand between columns there is none left
            needs = DECIMAL_COMMAS
        raise InputError(
            f'{path} has {has} in column "{plain(name, 100)}", row {wrong[0] + 1} below its names; '
            f"{needs}"
        )
    values[wrong] = np.nan
    return np.asarray(values)


def places_of(
    table: pd.DataFrame, path: str, measured: Measured, speed: float, start: float
) -> np.ndarray:
    """Places (n,) of all samples of the file [m], evened out.

    Parameters
    ----------
    table : of the file
    path : name of the table in sentences
    measured : columns of place or time
    speed : of the train [m/s]
    start : place of the pantograph at time zero [m]

    Raises
    ------
    InputError
        If they are not equidistant, or too few.
    """
    if measured.place is not None:
        places = measured.place.on_line(column_of(table, path, measured.place.column))
    else:
        assert measured.time is not None
        times = column_of(table, path, measured.time.column) * measured.time.factor
        places = start + speed * times
    return evened_out(places, path)


def evened_out(places: np.ndarray, path: str, is_described: bool = True) -> np.ndarray:
    """Places (n,) at equal distances [m], from rounded ``places`` (n,).

    Parameters
    ----------
    places : as the file has them [m]
    path : name of the table in sentences
    is_described : whether a description may say that places count against the train

    Raises
    ------
    InputError
        If they are not equidistant, or too few.
    """
    if len(places) < LEAST_SAMPLES:
        raise InputError(f"{path} has {len(places)} rows; at least {LEAST_SAMPLES} are needed")
    even = np.linspace(places[0], places[-1], len(places))
    spacing, spacings = even[1] - even[0], np.diff(places)
    usual = float(np.median(spacings))
    if usual < 0.0:
        hint = "; place.direction in a description says whether places count with the train or "
        raise InputError(
            f"{path} has places that fall along the line, from {places[0]:.1f} to {places[-1]:.1f} "
            "m: rows must stand in the order of the passage"
            + (f"{hint}against it" if is_described else "")
        )
    # Small differences of spacings add up where the speed varies.
    off = np.abs(places - even)
    if spacing <= 0.0 or off.max() > max(_EVEN * spacing, min(_CENTIMETRE, _ROUNDED * spacing)):
        if spacing > 0.0 and np.abs(spacings - usual).max() < 0.5 * usual:
            row = int(off.argmax())
            raise InputError(
                f"{path} must have equidistant samples: row {row + 1} below its names is at "
                f"{places[row]:.2f} m, and even steps from the first row to the last lead to "
                f"{even[row]:.2f} m; resample it at even steps of place or time"
            )
        row = int(np.abs(spacings - usual).argmax()) + 2
        raise InputError(
            f"{path} must have equidistant samples in ascending order: from row {row - 1} to row "
            f"{row} below its names the place goes on by {spacings[row - 2]:.4g} m, between others "
            f"by {usual:.4g} m; resample it at even steps of place or time, or cut it at gaps"
        )
    return even


def usual_description(table: pd.DataFrame, path: Path) -> Description:
    """The description of a file whose columns have the usual names: forces below 20 Hz.

    Raises
    ------
    InputError
        If it lacks one that is needed, or has several of a signal.
    """
    measured = {}
    for key, names in _USUAL.items():
        there = [name for name in names if name in table]
        _refuse_several(table, path, key, there)
        if there and not (key == "time" and "place" in measured):
            measured[key] = {"column": there[0], "unit": names[there[0]]}
    if "force" not in measured or len(measured.keys() & {"place", "time"}) != 1:
        raise InputError(
            f"{path} has no columns of the usual names, place_m or time_s and force_N: describe "
            "its columns with --description"
        )
    return checked_table({"measured": measured}, Description, str(path))


def _refuse_several(table: pd.DataFrame, path: Path, key: str, there: list[str]) -> None:
    """Raise InputError if a table has further columns of a signal beside the usual one.

    Two columns of one name are left to `column_of`, whose second pandas names with a point.
    """
    if not there or key not in ("force", "head_height"):
        return
    named = [name for name in map(str, table.columns) if name.lower().startswith(key)]
    several = [name for name in named if not name.startswith(f"{there[0]}.")]
    if len(several) > 1:
        rest = ", and by [[others]] whose the others are" if key == "force" else ""
        raise InputError(
            f"{path} has {len(several)} columns of a {key.replace('_', ' ')}, "
            f"{', '.join(plain(name, 40) for name in several[:12])}: say which one is of the "
            f"pantograph by measured.{key}.column in a description, given with --description{rest}"
        )


def passage_of(
    table: pd.DataFrame, path: Path, description: Description, folder: Path, results: Results
) -> Passage:
    """The passage of a table, as a run of the same train places it. Not collective.

    Parameters
    ----------
    table : of a CSV file
    path : of that file, for its name and sentences
    description : of its columns
    folder : of further files that the description names
    results : of the run; with a column of times it has start and speed

    Raises
    ------
    InputError
        If a column or file is not there, or no table of this kind.
    """
    own = description.measured
    assert own.force is not None  # the description was checked
    columns: list[tuple[int, Force]] = [(own.pantograph, own.force)]
    columns += [(other.pantograph, other.force) for other in description.others]
    forces = []
    for number, force in columns:
        start = _start(results, number - 1) if own.time is not None else 0.0
        places = places_of(table, str(path), own, results.fact("speed"), start)
        values, noise, bias = force.in_si(table, str(path))
        signal = own.head_height if number == own.pantograph else None
        of_head = (None, 0.0, 0.0) if signal is None else signal.in_si(table, str(path))
        height, of_noise, of_bias = of_head
        one = MeasuredForce(number - 1, places, values, height, noise, of_noise, bias, of_bias)
        forces.append(one)
    begin, end = results.evaluation
    return Passage(
        path.name,
        forces,
        own.filter_Hz,
        own.is_filtered,
        own.time is not None,
        (begin if own.from_m is None else own.from_m, end if own.to_m is None else own.to_m),
        None if description.uplift is None else _uplift(description.uplift, folder),
        _tolerances(description.tolerances),
    )


def _start(results: Results, number: int) -> float:
    """Place of a pantograph at time zero [m], of the first one if there are not so many."""
    number = number if number < results.n_pantographs else 0
    position = results.column("contact_position", number, slice(0, 1))
    return float(position[0]) - results.fact("speed") * results.time_at(0)


def _uplift(own: Uplift, folder: Path) -> MeasuredUplift:
    if Path(own.file).name != own.file:
        raise InputError(f"uplift.file is {own.file!r}: name a file beside the description")
    path = folder / own.file
    table = read_table(path)
    place = own.place.on_line(column_of(table, str(path), own.place.column))
    largest = column_of(table, str(path), own.largest.column) * own.largest.factor
    return MeasuredUplift(place, largest, (own.largest.noise or 0.0) * own.largest.factor)


def _tolerances(given: Tolerances) -> dict[str, float]:
    """Tolerances in SI units, that of the standard deviation as a share, by the figure."""
    factors = {"N": 1.0, "percent": 1e-2, "mm": 1e-3}
    found = {}
    for name, value in given:
        figure, _, unit = name.rpartition("_")
        if value is not None:
            found[figure] = float(np.float64(value) * factors[unit])
    return found
