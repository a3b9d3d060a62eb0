"""Lateral place of the wire on a pantograph's strips under way: its own less the vehicle's sway."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from catenary.mbs.vehicle.base_motion import BaseMotion
from catenary.solver.kernels import native


class CrossingPath(ABC):
    """Lateral positions of wires on the strips of a pantograph.

    Attributes
    ----------
    place, rate : (s,) of the contacts [m] and [m/s], to the left of the strips' middle
    """

    place: np.ndarray
    rate: np.ndarray

    @abstractmethod
    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""

    def ahead(self, time: float) -> None:
        """Put into both what is known of ``time`` [s] ahead of its step: mostly all."""
        self.move_to(time)

    def fill_ahead(self, times: np.ndarray, rows: np.ndarray) -> None:
        """Fill in the same for ``times`` [s]: ``rows`` (len(times), 2 s), places then rates."""
        s = self.place.size
        for row, time in zip(rows, times.tolist(), strict=True):
            self.ahead(time)
            row[:s], row[s:] = self.place, self.rate


class LateralPath(CrossingPath):
    """Lateral positions of the wire on the strips of a pantograph as functions of time.

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
        self._start = start + np.array(offsets, dtype=float)
        self._along = self._start.copy()
        self._speed = speed
        self._base = base
        self.place, self.rate = np.zeros((2, len(offsets)))
        course = np.array(support_x, dtype=float), np.array(stagger, dtype=float)
        self._find = native.polyline_at.bound(*course, self._along, self.place, self.rate)

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        np.add(self._start, self._speed * time, out=self._along)
        self._find()
        self.rate *= self._speed
        if self._base is not None:
            sway = self._base.lateral(time)
            self.place -= sway.place
            self.rate -= sway.velocity


class SeveralPaths(CrossingPath):
    """Lateral positions of several contact wires on the strips of a pantograph.

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


class FollowedPath(CrossingPath):
    """Lateral positions of wires that move sideways, whose motion each step finds.

    Parameters
    ----------
    across : (2, s) where the wires are across the track [m] and how fast that changes where the
        strips are [m/s]; kept by reference
    base : how the vehicle moves, None if it does not
    """

    def __init__(self, across: np.ndarray, base: BaseMotion | None = None) -> None:
        self._across, self._base = across, base
        self.place, self.rate = np.zeros((2, across.shape[1]))

    def move_to(self, time: float) -> None:
        """Put ``place`` and ``rate`` to ``time`` [s]."""
        self.ahead(time)
        self.place += self._across[0]
        self.rate += self._across[1]

    def ahead(self, time: float) -> None:
        """Put into both what the vehicle's sway makes of them at ``time`` [s]."""
        self.place[:] = self.rate[:] = 0.0
        if self._base is not None:
            sway = self._base.lateral(time)
            self.place -= sway.place
            self.rate -= sway.velocity

    def fill_ahead(self, times: np.ndarray, rows: np.ndarray) -> None:
        """See ``CrossingPath``: zeros, mostly."""
        if self._base is None:
            rows[:] = 0.0
        else:
            super().fill_ahead(times, rows)
