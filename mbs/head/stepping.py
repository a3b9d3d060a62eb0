"""Steps in which a pantograph runs, and what moves it in them besides its contact forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.mbs.head.wire_crossing import CrossingPath
from catenary.mbs.vehicle.base_motion import BaseMotion

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
