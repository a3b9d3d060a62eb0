"""The air as a pantograph under way meets it: the train's speed, tunnels, wind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# Wind [m/s] with the train and across it, (n,) each, at places [m] and times [s], (n,) each.
WindAt = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Tunnel:
    """A tunnel from ``start`` to ``end`` [m] in which aerodynamic forces are ``factor`` times as
    large; ``portal`` [m] behind each portal they go over to that by half a cosine."""

    start: float
    end: float
    factor: float
    portal: float

    def depth(self, places: np.ndarray) -> np.ndarray:
        """How far places [m] are inside, from 0 before the portals to 1, shape as ``places``."""
        inside = np.minimum(places - self.start, self.end - places)
        if self.portal <= 0.0:
            return np.where(inside > 0.0, 1.0, 0.0)
        return 0.5 - 0.5 * np.cos(np.pi * np.clip(inside / self.portal, 0.0, 1.0))


@dataclass(frozen=True)
class Airflow:
    """The air around one pantograph, which is at ``start`` [m] at time 0 and has ``speed`` [m/s].

    ``wind`` is that at a place and a time, None in still air; ``crosswind_factor`` says how far the
    square of its part across the track counts in that of the air's speed.
    """

    speed: float
    start: float = 0.0
    tunnels: tuple[Tunnel, ...] = ()
    wind: WindAt | None = None
    crosswind_factor: float = 0.0

    @property
    def steady(self) -> bool:
        """Whether it is the same at all times."""
        return self.wind is None and not self.tunnels

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Speed of the air relative to the pantograph [m/s] and factor of its forces, (n,) each.

        It is sqrt((V - W_x)^2 + c W_y^2): what lies across the track, such as strips, is lifted by
        the flow along the track alone, so that c is zero unless it was measured (independence of
        flows across a slender body and along it, S. F. Hoerner, *Fluid-Dynamic Drag*, 1965). In
        tunnels there is no wind.

        Parameters
        ----------
        times : (n,) [s]
        """
        speed, factor = np.full(times.size, self.speed), np.ones(times.size)
        if self.steady:
            return speed, factor
        places = self.start + self.speed * times
        sheltered = np.zeros(times.size)
        for tunnel in self.tunnels:
            depth = tunnel.depth(places)
            factor += (tunnel.factor - 1.0) * depth
            np.maximum(sheltered, depth, out=sheltered)
        if self.wind is not None:
            along, across = self.wind(places, times)
            left = 1.0 - sheltered
            counted = np.sqrt(self.crosswind_factor) * left * across
            speed = np.hypot(self.speed - left * along, counted)
        return speed, factor
