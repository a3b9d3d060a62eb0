"""The mean wind along a line: exposure by place, parts with the train and across the track."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catenary.mbs.air.airflow import Tunnel
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
