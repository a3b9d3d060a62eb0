"""A CSV file of a measurement, and the columns of it."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd

from catenary.base.errors import InputError
from catenary.cases.scene.input.plain_text import plain, read_text
from catenary.cases.studies.measured.description import Measured

LEAST_SAMPLES = 20
# Samples are equidistant if their spacings differ by less than this part.
_EVEN = 0.02


def read_table(path: Path) -> pd.DataFrame:
    """The table of a CSV file, with commas or with semicolons and decimal commas or points.

    Raises
    ------
    InputError
        If it is none.
    """
    text = read_text(path, str(path))
    semicolons = any(";" in line.partition("#")[0] for line in text.splitlines())
    try:
        return pd.read_csv(
            io.StringIO(text.replace(",", ".") if semicolons else text),
            sep=";" if semicolons else ",",
            comment="#",
            skipinitialspace=True,
        )
    except ValueError as error:  # pandas' ParserError is one
        why = str(error).strip().removeprefix("Error tokenizing data. C error: ")
        raise InputError(f"{path} is no table of CSV: {plain(why, 200)}") from error


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
        If there is no such column, or a cell without a number.
    """
    if name not in table:
        raise InputError(f'{path} has no column "{plain(name, 100)}": it has {columns_in(table)}')
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float, copy=True)
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size and not may_lack:
        raise InputError(
            f'{path} has in row {wrong[0] + 1} of column "{plain(name, 100)}" no finite number'
        )
    values[wrong] = np.nan
    return np.asarray(values)


def places_of(
    table: pd.DataFrame, path: str, measured: Measured, speed: float, start: float
) -> np.ndarray:
    """Places (n,) of all samples of the file [m], evened out.

    Parameters
    ----------
    path : name of the table in sentences
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


def evened_out(places: np.ndarray, path: str) -> np.ndarray:
    """Places (n,) that were rounded, at equal distances [m].

    Parameters
    ----------
    path : name of the table in sentences

    Raises
    ------
    InputError
        If they are not equidistant, or too few.
    """
    if len(places) < LEAST_SAMPLES:
        raise InputError(f"{path} has {len(places)} rows; at least {LEAST_SAMPLES} are needed")
    even = np.linspace(places[0], places[-1], len(places))
    spacing, spacings = even[1] - even[0], np.diff(places)
    if spacing <= 0.0 or np.abs(spacings - spacing).max() > _EVEN * spacing + 1e-4:
        usual = float(np.median(spacings))
        row = int(np.abs(spacings - usual).argmax()) + 2
        raise InputError(
            f"{path} must have equidistant samples in ascending order, but row {row} stands "
            f"{spacings[row - 2]:.4g} m behind the row before, and others {usual:.4g} m; resample "
            "it at even steps of place or time, or cut it at gaps"
        )
    return even
