"""Where the wire crosses a pantograph's strips under way: the stagger less the vehicle's sway."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.mbs.vehicle import curves
from catenary.mbs.vehicle.base_motion import BaseMotion


class LateralPath:
    """Lateral places of the wire on the strips of a pantograph as functions of time.

    The wire runs straight from support to support.

    Parameters
    ----------
    support_x, stagger : (n,) places of the supports along the track and of the wire across it [m]
    start : of the pantograph at time 0 [m]
    offsets : (s,) places of its strips ahead of it [m]
    speed : of the train [m/s]
    base : how the vehicle moves, None if it does not

    Attributes
    ----------
    place, rate : (s,) [m] and [m/s] to the left of the strips' middle, as ``move_to`` left them
    """

    def __init__(
        self,
        support_x: np.ndarray,
        stagger: Sequence[float] | np.ndarray,
        start: float,
        offsets: Sequence[float],
        speed: float,
        base: BaseMotion | None = None,
    ) -> None:
        self._x = np.array(support_x, dtype=float)
        self._y = np.array(stagger, dtype=float)
        self._start = start + np.array(offsets, dtype=float)
        self._along = self._start.copy()
        self._speed = speed
        self._base = base
        self.place, self.rate = np.zeros((2, len(offsets)))

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        np.add(self._start, self._speed * time, out=self._along)
        curves.polyline_at(self._x, self._y, self._along, self.place, self.rate)
        self.rate *= self._speed
        if self._base is not None:
            sway = self._base.lateral(time)
            self.place -= sway.place
            self.rate -= sway.velocity


class SeveralPaths:
    """Lateral places of several contact wires on the strips of a pantograph.

    ``place`` and ``rate`` (s w,) are those of `LateralPath` for w wires, strip by strip.
    """

    def __init__(self, paths: Sequence[LateralPath]) -> None:
        self._paths = tuple(paths)
        n_strips = len(paths[0].place)
        self._by_strip = np.zeros((2, n_strips, len(paths)))
        self.place, self.rate = self._by_strip.reshape(2, -1)

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        for number, path in enumerate(self._paths):
            path.move_to(time)
            self._by_strip[:, :, number] = path.place, path.rate
