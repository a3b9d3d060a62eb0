"""Air at a pantograph: the airflow from train speed, tunnels and wind, and the forces of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.mbs.head.stepping import Raising

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
        """Depth of places [m] inside, from 0 before the portals to 1, shape as ``places``."""
        inside = np.minimum(places - self.start, self.end - places)
        if self.portal <= 0.0:
            return np.where(inside > 0.0, 1.0, 0.0)
        return 0.5 - 0.5 * np.cos(np.pi * np.clip(inside / self.portal, 0.0, 1.0))


@dataclass(frozen=True)
class Airflow:
    """The air around one pantograph, which is at ``start`` [m] at time 0 and has ``speed`` [m/s].

    ``wind`` is that at a place and a time, None in still air; ``crosswind_factor`` says how far the
    square of its part across the track counts in that of the air's speed. ``sheltered`` says
    whether the wind is another one in some stretches.
    """

    speed: float
    start: float = 0.0
    tunnels: tuple[Tunnel, ...] = ()
    wind: WindAt | None = None
    crosswind_factor: float = 0.0
    sheltered: bool = False

    @property
    def along_track(self) -> bool:
        """Whether it depends on the place along the track."""
        return bool(self.tunnels) or self.sheltered

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
        times : ndarray, shape (n,)
            Times, ascending [s].
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


@dataclass(frozen=True)
class Polynomial:
    """A force [N] as a polynomial of the air's speed [m/s], the constant of it first."""

    coefficients: tuple[float, ...]

    def __call__(self, speed: np.ndarray) -> np.ndarray:
        """Forces [N] at speeds [m/s], shape as ``speed``."""
        return np.polynomial.polynomial.polyval(speed, self.coefficients)


@dataclass(frozen=True)
class Table:
    """A force [N] from ``forces`` at growing ``speeds`` [m/s], linear in between.

    Beyond its ends a force goes on with the square of the speed, from that at the end.
    """

    speeds: tuple[float, ...]
    forces: tuple[float, ...]

    def __call__(self, speed: np.ndarray) -> np.ndarray:
        """Forces [N] at speeds [m/s], shape as ``speed``."""
        inside = np.clip(speed, self.speeds[0], self.speeds[-1])
        beyond = np.divide(speed, inside, out=np.ones_like(inside), where=inside > 0.0)
        return np.asarray(np.interp(inside, self.speeds, self.forces) * beyond**2)


@dataclass(frozen=True)
class Uplift:
    """Upward force of the air on a pantograph.

    ``force`` [N] by the air's speed [m/s]; ``head_share`` of it acts on the head, the rest on what
    carries the head: the last of lumped masses, or the arm of a mechanism.
    """

    force: Polynomial | Table
    head_share: float = 1.0

    def at(self, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces [N] on the head and on what carries it at speeds [m/s], shape as ``speed``."""
        whole = self.force(speed)
        return self.head_share * whole, (1.0 - self.head_share) * whole


# Columns of what acts at a time.
ON_HEAD, ON_FRAME, SQUARE = range(3)


class SteadyForces(NamedTuple):
    """Forces in still air on the open line [N]: upward on the head, and on what carries it."""

    on_head: float
    on_frame: float

    @property
    def whole(self) -> float:
        """Their sum, what they add to the mean contact force [N]."""
        return self.on_head + self.on_frame


class AirForces:
    """Forces of the air on one pantograph.

    They grow from zero while the pantograph is raised, and act on while it is lowered.

    Attributes
    ----------
    is_steady : whether they stay as they are from then on

    Parameters
    ----------
    flow : Airflow
    uplift : of head and frame, None if only bodies of a mechanism meet the air
    raise_time : [s] in which the pantograph is raised
    """

    def __init__(self, flow: Airflow, uplift: Uplift | None, raise_time: float) -> None:
        self._flow, self._uplift, self._part = flow, uplift, Raising(raise_time)
        self.is_steady = flow.steady
        self._steady = self._acting(np.zeros(1))[0] if flow.steady else None
        self._latest = (np.nan, np.zeros(3))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Upward forces on head and on what carries it [N], and the forces on bodies in parts of
        those at the train's speed in still air; (n, 3) at growing ``times`` (n,) [s]."""
        acting = self._acting(times) if self._steady is None else self._steady
        return np.asarray(self._part(times)[:, None] * acting)

    def now(self, time: float) -> np.ndarray:
        """Forces at one ``time`` [s], (3,), as ``at`` returns them."""
        if self._latest[0] != time:
            self._latest = time, self.at(np.array([time]))[0]
        return self._latest[1]

    def _acting(self, times: np.ndarray) -> np.ndarray:
        speed, factor = self._flow.at(times)
        forces = np.zeros((times.size, 3))
        if self._uplift is not None:
            on_head, on_frame = self._uplift.at(speed)
            forces[:, ON_HEAD], forces[:, ON_FRAME] = factor * on_head, factor * on_frame
        forces[:, SQUARE] = factor * (speed / self._flow.speed) ** 2
        return forces
