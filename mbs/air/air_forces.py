"""Forces of the air on one pantograph under way, at any time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from catenary.mbs.air.airflow import Airflow
from catenary.mbs.air.uplift import Uplift
from catenary.mbs.head.newmark_head import Raising, parts_of

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

    Parameters
    ----------
    flow : Airflow
    uplift : of head and frame, None if only bodies of a mechanism meet the air
    raise_time : [s] in which the pantograph is raised
    """

    def __init__(self, flow: Airflow, uplift: Uplift | None, raise_time: float) -> None:
        self._flow, self._uplift, self._part = flow, uplift, Raising(raise_time)
        self._steady = self._acting(np.zeros(1))[0] if flow.steady else None
        self._latest = (np.nan, np.zeros(3))

    def at(self, times: Sequence[float]) -> np.ndarray:
        """Upward forces on head and on what carries it [N], and the forces on bodies in parts of
        those at the train's speed in still air; (len(times), 3) at growing ``times`` [s]."""
        parts = parts_of(self._part, times)[:, None]
        if self._steady is not None:
            return np.asarray(parts * self._steady)
        return np.asarray(parts * self._acting(np.asarray(times, dtype=float)))

    def now(self, time: float) -> np.ndarray:
        """The same at one ``time`` [s], (3,)."""
        if self._latest[0] != time:
            self._latest = time, self.at([time])[0]
        return self._latest[1]

    def _acting(self, times: np.ndarray) -> np.ndarray:
        speed, factor = self._flow.at(times)
        forces = np.zeros((times.size, 3))
        if self._uplift is not None:
            on_head, on_frame = self._uplift.at(speed)
            forces[:, ON_HEAD], forces[:, ON_FRAME] = factor * on_head, factor * on_frame
        forces[:, SQUARE] = factor * (speed / self._flow.speed) ** 2
        return forces
