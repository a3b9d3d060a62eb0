"""The wind at moving places, such as those of pantographs."""

from __future__ import annotations

import numpy as np

from catenary.mbs.air.airflow import WindAt
from catenary.solver.problem.wind import Wind
from catenary.solver.wind.gust_field import GustField
from catenary.solver.wind.mean_wind import directions, exposure
from catenary.solver.wind.spectra import ACROSS, ALONG


def gust_points(spacing: float, start: float, end: float) -> np.ndarray:
    """Points of a gust field at most ``spacing`` apart from ``start`` to ``end`` [m]."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / spacing)) + 1))


def horizontal_gusts(
    wind: Wind, points: np.ndarray, spread: float | None = None
) -> tuple[GustField, GustField]:
    """Gusts along the mean wind and across it to the left; ``spread`` as of ``GustField``."""
    return GustField(wind, ALONG, points, spread), GustField(wind, ACROSS, points, spread)


def wind_at(wind: Wind, start: float, end: float) -> WindAt:
    """Wind [m/s] with the train and across it to the left, at any places and times.

    ``start`` and ``end`` [m] of the line, beyond which gusts are as at its ends. Tunnels are left
    to whoever meets the wind.
    """
    with_train, across = directions(wind)
    if wind.gusts is None:

        def steady(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            speed = wind.mean * exposure(wind, places)
            return with_train * speed, across * speed

        return steady
    points = gust_points(wind.gusts.spacing, start, end)
    fields = horizontal_gusts(wind, points)

    def gusty(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = (_sampled(field, points, places, times) for field in fields)
        exposed, u = exposure(wind, places), u + wind.mean
        return exposed * (with_train * u - across * v), exposed * (across * u + with_train * v)

    return gusty


def _sampled(
    field: GustField, points: np.ndarray, places: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """A field linear between its points and slices, at places [m] and times [s], (n,) each."""
    row = np.floor(times / field.interval).astype(np.int64)
    column = np.clip(np.searchsorted(points, places, side="right") - 1, 0, points.size - 2)
    first, low = int(row.min()), int(column.min())
    slices = np.empty((int(row.max()) + 2 - first, int(column.max()) + 2 - low))
    field.fill(first, slice(low, low + slices.shape[1]), slices)
    later = times / field.interval - row
    share = np.clip((places - points[column]) / (points[column + 1] - points[column]), 0.0, 1.0)
    row, column = row - first, column - low
    now = (1.0 - share) * slices[row, column] + share * slices[row, column + 1]
    then = (1.0 - share) * slices[row + 1, column] + share * slices[row + 1, column + 1]
    return np.asarray((1.0 - later) * now + later * then)
