"""The task of an identification, and the measurement that it describes.

``task.toml`` says what was measured, and what is looked for. A measurement has samples at places
from a CSV file, and their noise, which a filter correlates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field, field_validator, model_validator
from scipy import linalg
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline

from catenary.base.errors import InputError
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.measured import (
    LEAST_SAMPLES,
    NAME,
    POSITIVE,
    Force,
    Height,
    Measured,
    column_of,
    places_of,
)
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.filters import power_kept

# The slowest pole decays with sin(pi/12) 2 pi fc, so that 1e-8 is left after so many periods.
_REMEMBERED = 12.0
FORCE, HEIGHT = "force", "head height"
UNITS = {FORCE: "N", HEIGHT: "m"}
_MOST_SAMPLES = 8000  # their covariance takes half a gigabyte
# Raw samples that half a period of the filter takes at least. Of fewer all would be kept, and the
# filter leaves nothing at half of their rate: the covariance of their noise is singular.
_RAW = 2.0
# Of what is faster than so many cut-offs the filter leaves 0.8 %, of the noise's deviation 0.2 %;
# values with more than these parts, of their deviation and of the noise's, have not passed it.
_FAST, _OF_VALUES, _OF_NOISE = 1.5, 0.01, 0.1


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


def correlation(lags: np.ndarray, cut_off: float, dt: float | None = None) -> np.ndarray:
    """Correlation (n,) of white noise that passed the filter of `filters.low_pass`.

    The filter runs both ways, so that its gain is G(f) = 1 / (1 + (f/fc)^12) and the power of the
    noise G^2. The first value of lags [s] zero is one.

    Parameters
    ----------
    lags : (n,) between two samples [s]
    cut_off : fc [Hz]
    dt : time between the samples that were filtered [s]; None if they were very dense
    """
    frequency, gain_squared = power_kept(cut_off, dt)
    found = np.zeros(np.shape(lags))
    near = np.abs(lags) * cut_off < _REMEMBERED
    waves = np.cos(2.0 * np.pi * np.multiply.outer(lags[near], frequency))
    found[near] = trapezoid(waves * gain_squared, axis=-1) / trapezoid(gain_squared)
    return found


class Whitening:
    """Makes samples of a signal independent, with deviation one.

    Parameters
    ----------
    lags : (n,) times of equidistant samples since the first one [s]
    deviation : standard deviation of each sample
    cut_off, dt : as for ``correlation``
    """

    def __init__(
        self, lags: np.ndarray, deviation: float, cut_off: float, dt: float | None
    ) -> None:
        covariance = linalg.toeplitz(correlation(lags, cut_off, dt))
        self._factor = deviation * np.linalg.cholesky(covariance)

    def of(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, m), divided by the square root of their covariance."""
        return np.asarray(linalg.solve_triangular(self._factor, values, lower=True))


@dataclass(frozen=True)
class Signal:
    """Samples of a quantity.

    Attributes
    ----------
    name : FORCE or HEIGHT
    values : (n,) as far as they are compared [N or m]
    whitening : makes them independent
    deviation : standard deviation of their noise
    bias : standard deviation of an unknown constant in them, zero if there is none
    unit, factor : unit of the file, in which the constant is told, and its factor to N or m
    hint : sentence if the values should have passed a filter and do not look so, else empty
    """

    name: str
    values: np.ndarray
    whitening: Whitening
    deviation: float
    bias: float
    unit: str
    factor: float
    hint: str = ""


class Measurement:
    """Samples of a passage, and the same samples of a march.

    Attributes
    ----------
    place : (n,) of the samples that are compared [m]
    signals : that were measured there
    pantograph : its number on the train, from 0

    Parameters
    ----------
    table : of a CSV file, see ``measured.read_table``
    path : its name in sentences
    task : description of its columns
    speed : of the train [m/s]
    start : place of the pantograph at time zero [m]
    stretch : begin and end of the scene's evaluation [m]

    Raises
    ------
    InputError
        If the file is no table with these columns, or its samples are not equidistant or too few.
    """

    def __init__(
        self,
        table: pd.DataFrame,
        path: str,
        task: Measured,
        speed: float,
        start: float,
        stretch: tuple[float, float],
    ) -> None:
        self.pantograph = task.pantograph - 1
        self._cut_off, self._is_filtered = task.filter_Hz, task.is_filtered
        places = places_of(table, path, task, speed, start)
        self._spacing = dt = float(places[-1] - places[0]) / ((len(places) - 1) * speed)
        self._dt = None if task.is_filtered else dt
        begin = stretch[0] if task.from_m is None else task.from_m
        end = stretch[1] if task.to_m is None else task.to_m
        within = np.flatnonzero((begin <= places) & (places <= end))
        margin = 0
        # Samples in half a period of the filter.
        dense = 0.5 / (task.filter_Hz * dt)
        if dense <= 1.0 or not task.is_filtered and dense < _RAW - 1e-6:
            least = f"more than {2 * task.filter_Hz:g}"
            if not task.is_filtered:
                least = f"at least {2 * _RAW * task.filter_Hz:g} of values that are not filtered"
            raise InputError(
                f"{path} has {1.0 / dt:.4g} samples a second at the train's {3.6 * speed:g} km/h; "
                f"measured.filter_Hz = {task.filter_Hz:g} takes {least}"
            )
        if not task.is_filtered:
            margin = int(np.ceil(filters.SETTLED / (task.filter_Hz * dt)))
            within = within[(within >= margin) & (within < len(places) - margin)]
        # A signal of this bandwidth is known from samples half a period of it apart.
        kept = within[:: max(1, int(dense + 1e-6))]
        if not LEAST_SAMPLES <= kept.size <= _MOST_SAMPLES:
            raise InputError(
                f"{path} reaches from {places[0]:.1f} to {places[-1]:.1f} m of the line and has "
                f"{kept.size} samples, half a period of the filter apart, in the compared stretch "
                f"from {begin:g} to {end:g} m; an identification takes {LEAST_SAMPLES} to "
                f"{_MOST_SAMPLES}"
            )
        # Rows of the file from the first sample to the last, and of a filter's reach beside them.
        self._rows = slice(int(kept[0]) - margin, int(kept[-1]) + margin + 1)
        self._places, self._kept = places[self._rows], kept - self._rows.start
        self.place = self._places[self._kept]
        lags = (self.place - self.place[0]) / speed
        self.signals = [
            self._signal(table, path, name, column, lags)
            for name, column in ((FORCE, task.force), (HEIGHT, task.head_height))
            if column is not None
        ]

    def _signal(
        self, table: pd.DataFrame, path: str, name: str, column: Force | Height, lags: np.ndarray
    ) -> Signal:
        own = column_of(table, path, column.column)[self._rows] * column.factor
        values = self._sampled(own)
        assert column.noise is not None  # the task was checked
        deviation = column.noise * column.factor
        if self._dt is not None:
            deviation *= np.sqrt(filters.kept_variance(self._cut_off, self._dt))
        whitening = Whitening(lags, deviation, self._cut_off, self._dt)
        bias = column.bias * column.factor
        hint = self._hint(name, own, deviation) if self._is_filtered else ""
        return Signal(name, values, whitening, deviation, bias, column.unit, column.factor, hint)

    def _hint(self, name: str, values: np.ndarray, noise: float) -> str:
        """Sentence on values (n,) of the file that vary faster than a filter leaves, with ``noise``
        as their stated deviation; empty if they do not, or are too coarse to show it."""
        fast = _FAST * self._cut_off
        if 2.0 * fast * self._spacing >= 1.0:
            return ""
        rest = values - filters.low_pass(values, self._spacing, fast)
        margin = int(np.ceil(filters.SETTLED / (fast * self._spacing)))
        inside = rest[margin : rest.size - margin]
        deviation = float(np.std(inside if inside.size else rest))
        if deviation < max(_OF_VALUES * float(np.std(values)), _OF_NOISE * noise):
            return ""
        return (
            f"The measured {name} varies by {deviation:.2g} {UNITS[name]} faster than {fast:g} Hz, "
            f"more than the filter of {self._cut_off:g} Hz leaves: if the values are raw, "
            "measured.is_filtered is false."
        )

    def _sampled(self, values: np.ndarray) -> np.ndarray:
        """Filter values (n, ...) at the file's places, and keep the values that are compared."""
        if self._dt is not None:
            values = filters.low_pass(values, self._dt, self._cut_off)
        return np.asarray(values[self._kept])

    def of_march(self, position: np.ndarray, values: np.ndarray, dt: float) -> np.ndarray:
        """Values of a march, filtered and sampled at the places of the measured samples.

        ``values`` (n_steps, ...) are at ascending ``position`` (n_steps,) [m], ``dt`` [s] apart.

        Raises
        ------
        InputError
            If the march does not cover the samples.
        """
        needed = self.place if self._is_filtered else self._places
        if not position[0] <= needed[0] <= needed[-1] <= position[-1]:
            raise InputError(
                f"the measurement is compared from {needed[0]:.1f} to {needed[-1]:.1f} m, and the "
                f"pantograph of the scene runs from {position[0]:.1f} to {position[-1]:.1f} m: "
                "give measured.from_m and to_m, or cut the file"
            )
        if self._is_filtered:
            values = filters.low_pass(values, dt, self._cut_off)
            return np.asarray(CubicSpline(position, values)(needed))
        return self._sampled(np.asarray(CubicSpline(position, values)(needed)))

    def curve_of_march(self, position: np.ndarray, values: np.ndarray, dt: float) -> np.ndarray:
        """Places and filtered values, shape (2, k), of the steps of a march between the first
        sample that is compared and the last.

        Parameters are those of ``of_march``, with values (n_steps,).
        """
        within = (self.place[0] <= position) & (position <= self.place[-1])
        filtered = filters.low_pass(values, dt, self._cut_off)
        return np.stack([position, filtered])[:, within]
