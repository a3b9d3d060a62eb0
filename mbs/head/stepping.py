"""Steps in which a pantograph runs, and what moves it in them besides its contact forces.

It is raised and may be lowered, its base moves, and the wire crosses its strips: at its own lateral
place less the vehicle's sway.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.mbs.vehicle import BaseMotion
from catenary.solver.kernels import native

# Part of the lift that acts at times [s], shape as these.
Part = Callable[[float | np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Raising:
    """Part of the lift that acts: a half cosine from 0 to 1 over ``raise_time`` [s]."""

    raise_time: float

    def __call__(self, times: float | np.ndarray) -> np.ndarray:
        """The parts at ``times`` [s], shape as these."""
        if self.raise_time <= 0.0:
            return np.ones(np.shape(times))
        early = np.minimum(times, self.raise_time)
        return np.asarray(0.5 * (1.0 - np.cos(np.pi * early / self.raise_time)))

    def rates(self, times: np.ndarray) -> np.ndarray:
        """Rates of the parts at ``times`` (n,) [s], shape (n,) [1/s]."""
        found = np.zeros(times.size)
        rising = times < self.raise_time  # never, if it is raised at once
        if rising.any():
            turned = np.pi * times[rising] / self.raise_time
            found[rising] = np.pi / (2.0 * self.raise_time) * np.sin(turned)
        return found


@dataclass(frozen=True)
class Lowering:
    """Lowering of a pantograph from ``time`` [s] on.

    The static force goes over to ``force`` [N] over ``within`` [s] by half a cosine; a negative one
    pulls down. The head is caught ``drop`` [m] below where it was at ``time``, as models have no
    housing of their own: its speed relative to the base falls to zero at once, and it moves with
    the base.
    """

    time: float
    force: float
    within: float
    drop: float

    def course(self, static_force: float, raise_time: float) -> Part:
        """Part of the lift that acts, after a raising over ``raise_time`` [s] to ``static_force``
        [N]."""
        rising, falling = Raising(raise_time), Raising(self.within)
        before = rising(self.time)
        last = self.force / static_force

        def part(times: float | np.ndarray) -> np.ndarray:
            since = np.maximum(times - np.float64(self.time), 0.0)
            lowered = before + (last - before) * falling(since)
            return np.where(since > 0.0, lowered, rising(times))

        return part


class Stepping(NamedTuple):
    """Steps of a pantograph, whatever its model.

    Attributes
    ----------
    raise_time : time over which its lift grows from zero [s]
    dt : step of the line [s]
    beta, gamma : the line's parameters of Newmark's method
    lateral : where the wire crosses the strips; without it the head does not roll
    base : how the vehicle moves; without it the base stays
    """

    raise_time: float
    dt: float
    beta: float = 0.25
    gamma: float = 0.5
    lateral: CrossingPath | None = None
    base: BaseMotion | None = None


class CrossingPath:
    """Lateral positions of wires on the strips of a pantograph.

    Attributes
    ----------
    place, rate : (n,) of the contacts [m] and [m/s], to the left of the strips' middle, strip by
        strip

    Parameters
    ----------
    n : number of contacts
    base : how the vehicle moves, None if it does not
    """

    def __init__(self, n: int, base: BaseMotion | None) -> None:
        self._n, self._base = n, base
        self._row = np.zeros((1, 2 * n))
        self.place, self.rate = self._row.reshape(2, n)

    def fill_ahead(self, times: np.ndarray, rows: np.ndarray) -> None:
        """Fill in what is known of ``times`` (t,) [s] ahead of their steps: ``rows`` (t, 2 n),
        places, then rates."""
        rows[:] = 0.0
        if self._base is not None:
            sways = np.array([self._base.lateral(time)[:2] for time in times.tolist()])
            rows -= np.repeat(sways, self._n, axis=1)

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        self.fill_ahead(np.array([time]), self._row)


class LateralPath(CrossingPath):
    """Lateral positions of wires that do not move sideways, as functions of time.

    Parameters
    ----------
    courses : of each wire places along the track and across it (n,) [m], straight in between
    start : of the pantograph at time 0 [m]
    offsets : (s,) places of its strips ahead of it [m]
    speed : of the train [m/s]
    base : how the vehicle moves, None if it does not
    """

    def __init__(
        self,
        courses: Sequence[tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]],
        start: float,
        offsets: Sequence[float],
        speed: float,
        base: BaseMotion | None = None,
    ) -> None:
        super().__init__(len(offsets) * len(courses), base)
        self._start, self._speed = start + np.array(offsets, dtype=float), speed
        self._courses = [(np.array(x, dtype=float), np.array(y, dtype=float)) for x, y in courses]

    def fill_ahead(self, times: np.ndarray, rows: np.ndarray) -> None:
        """Fill in all there is."""
        super().fill_ahead(times, rows)
        along = self._start + self._speed * times[:, None]
        place, slope = np.empty((2, *along.shape))
        for wire, course in enumerate(self._courses):
            native.polyline_at(*course, along.ravel(), place.ravel(), slope.ravel())
            rows[:, wire : self._n : len(self._courses)] += place
            rows[:, self._n + wire :: len(self._courses)] += self._speed * slope


class FollowedPath(CrossingPath):
    """Lateral positions of wires that move sideways, whose motion each step finds.

    Parameters
    ----------
    across : (2, n) where the wires are across the track [m] and how fast that changes where the
        strips are [m/s]; kept by reference
    base : how the vehicle moves, None if it does not
    """

    def __init__(self, across: np.ndarray, base: BaseMotion | None = None) -> None:
        super().__init__(across.shape[1], base)
        self._across = across

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        super().move_to(time)
        self.place += self._across[0]
        self.rate += self._across[1]
