"""Wind at moving places, and the airflow at the pantographs of the train."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catenary.mbs.air import Airflow, Tunnel, WindAt
from catenary.meshgen.wires import Wire
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.problem.simulated import Simulated
from catenary.solver.problem.wind import Wind
from catenary.solver.wind.gust_field import GustField
from catenary.solver.wind.spectra import ACROSS, ALONG


def exposure(wind: Wind, places: np.ndarray, tunnels: Sequence[Tunnel] = ()) -> np.ndarray:
    """Mean speed at places [m] over that outside of stretches, shape as ``places``.

    In tunnels there is no wind.
    """
    found = gust_exposure(wind, places, tunnels)
    for stretch in wind.stretches:
        if stretch.height is not None:
            inside = (places >= stretch.start) & (places < stretch.end)
            found[inside] *= float(wind.profile.growth(stretch.height, wind.height))
    return found


def gust_exposure(wind: Wind, places: np.ndarray, tunnels: Sequence[Tunnel] = ()) -> np.ndarray:
    """Speed of the gusts at places [m] over that outside of stretches, shape as ``places``.

    The mean grows with the height, the friction velocity, of which gusts are a multiple, does not.
    """
    found = np.ones(places.shape)
    for stretch in wind.stretches:
        found[(places >= stretch.start) & (places < stretch.end)] = stretch.factor
    for tunnel in tunnels:
        found *= 1.0 - tunnel.depth(places)
    return found


def directions(wind: Wind) -> tuple[float, float]:
    """Parts of a unit of mean wind with the train and to the left of it."""
    along, across = math.cos(wind.direction), math.sin(wind.direction)
    # Of a wind straight across nothing is left along the track but round-off, and so the other way.
    return (0.0 if abs(along) < 1e-12 else along), (0.0 if abs(across) < 1e-12 else across)


def across_at(wind: Wind, tunnels: tuple[Tunnel, ...], places: np.ndarray) -> np.ndarray:
    """Mean wind to the left of the track [m/s] at ``places`` [m], of the same shape; 0 in
    ``tunnels``."""
    return directions(wind)[1] * wind.mean * exposure(wind, places, tunnels)


def mean_load(
    wind: Wind, tunnels: tuple[Tunnel, ...], wire: Wire, places: np.ndarray
) -> np.ndarray:
    """Mean lateral load on a wire [N/m] at ``places`` [m], of the same shape; to the left positive,
    0 in ``tunnels``."""
    speed = across_at(wind, tunnels, places)
    return np.asarray(0.5 * wind.density * drag_width(wire) * np.abs(speed) * speed)


def drag_width(wire: Wire) -> float:
    """Diameter times drag coefficient of a wire [m]."""
    assert wire.diameter is not None  # check_wind has refused scenes without
    return wire.diameter * wire.drag_coefficient


def gust_points(spacing: float, start: float, end: float) -> np.ndarray:
    """Points of a gust field at most ``spacing`` apart from ``start`` to ``end`` [m]."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / spacing)) + 1))


def horizontal_gusts(
    wind: Wind, points: np.ndarray, spread: float | None = None
) -> tuple[GustField, GustField]:
    """Gusts at ``points`` (n,) [m] along the mean wind and across it to the left; ``spread`` as in
    ``GustField``."""
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
        exposed = gust_exposure(wind, places)
        u, v = wind.mean * exposure(wind, places) + exposed * u, exposed * v
        return with_train * u - across * v, across * u + with_train * v

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


def airflow(problem: Problem, simulated: Simulated, placement: Placement) -> Airflow | None:
    """The air that a pantograph meets on its way, None if it has no forces. Not collective."""
    if not (simulated.meets_air and placement.data.meets_air):
        return None
    train, wind = problem.train, simulated.wind
    masts = problem.line.support_positions
    blowing = None if wind is None else wind_at(wind, float(masts[0]), float(masts[-1]))
    return Airflow(
        train.speed,
        train.start - placement.behind,
        problem.tunnels,
        blowing,
        placement.data.crosswind_factor,
        sheltered=wind is not None and bool(wind.stretches),
    )
