"""The mean wind along a line: exposure by place, parts along and across, load on wires."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catenary.mbs.air.airflow import Tunnel
from catenary.meshgen.wires import Wire
from catenary.solver.problem.wind import Wind


def exposure(wind: Wind, places: np.ndarray, tunnels: Sequence[Tunnel] = ()) -> np.ndarray:
    """Speeds of mean and gusts at places [m] over those outside of stretches, shape as ``places``.

    In tunnels there is no wind.
    """
    found = np.ones(places.shape)
    for stretch in wind.stretches:
        inside = (places >= stretch.start) & (places < stretch.end)
        height = wind.height if stretch.height is None else stretch.height
        found[inside] = stretch.factor * float(wind.profile.growth(height, wind.height))
    for tunnel in tunnels:
        found *= 1.0 - tunnel.depth(places)
    return found


def directions(wind: Wind) -> tuple[float, float]:
    """Parts of a unit of mean wind with the train and to the left of it."""
    along, across = math.cos(wind.direction), math.sin(wind.direction)
    # Of a wind straight across nothing is left along the track but round-off, and so the other way.
    return (0.0 if abs(along) < 1e-12 else along), (0.0 if abs(across) < 1e-12 else across)


def across_at(wind: Wind, tunnels: tuple[Tunnel, ...], places: np.ndarray) -> np.ndarray:
    """Mean wind to the left of the track at places [m/s], shape as ``places``."""
    return directions(wind)[1] * wind.mean * exposure(wind, places, tunnels)


def mean_load(
    wind: Wind, tunnels: tuple[Tunnel, ...], wire: Wire, places: np.ndarray
) -> np.ndarray:
    """Mean lateral load on a wire at places [N/m], shape as ``places``; to the left positive."""
    speed = across_at(wind, tunnels, places)
    return np.asarray(0.5 * wind.density * drag_width(wire) * np.abs(speed) * speed)


def drag_width(wire: Wire) -> float:
    """Diameter times drag coefficient of a wire [m]."""
    assert wire.diameter is not None  # check_wind has refused scenes without
    return wire.diameter * wire.drag_coefficient
