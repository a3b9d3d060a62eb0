"""Masts of a line, between which of them trains run, and a curve of the track beneath."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


def read_only(values: np.ndarray) -> np.ndarray:
    """An array that nothing may write into, as it is shared."""
    values.flags.writeable = False
    return values


@dataclass(frozen=True)
class Spans:
    """Spans from anchor to anchor.

    Attributes
    ----------
    span_lengths : (n_spans,) [m]
    n_transition : spans at the start and at the end in which contact wires rise to the tensioner
    """

    span_lengths: tuple[float, ...]
    n_transition: tuple[int, int]

    @property
    def n_spans(self) -> int:
        return len(self.span_lengths)

    @cached_property
    def support_positions(self) -> np.ndarray:
        """Positions of all masts, both anchors included, shape (n_spans + 1,) [m]; read-only."""
        return read_only(np.concatenate([[0.0], np.cumsum(self.span_lengths)]))

    @property
    def running_range(self) -> tuple[float, float]:
        """Range in which a pantograph may run: from the end of the first transition to the start
        of the last one [m]."""
        masts = self.support_positions
        return float(masts[self.n_transition[0]]), float(masts[self.n_spans - self.n_transition[1]])


@dataclass(frozen=True)
class Curve:
    """A stretch of the line in which the track is a circle, with transitions at both ends.

    Attributes
    ----------
    curvature : 1/R of the circle, > 0 where its centre is to the left, in the sense of y [1/m]
    tilt : of the canted track towards the centre, >= 0 [rad]
    stretch : from and to, transitions included; infinite for the whole line [m]
    transition : length at both ends over which curvature and cant grow linearly [m]
    """

    curvature: float
    tilt: float = 0.0
    stretch: tuple[float, float] = (-np.inf, np.inf)
    transition: float = 0.0

    def share(self, x: np.ndarray) -> np.ndarray:
        """Share of curvature and cant at places ``x`` [m], 0 to 1, shape as ``x``."""
        x = np.asarray(x, dtype=float)
        first, last = self.stretch
        inside = np.minimum(x - first, last - x)
        if self.transition == 0.0:
            return np.where(inside >= 0.0, 1.0, 0.0)
        return np.clip(inside / self.transition, 0.0, 1.0)

    def curvature_at(self, x: np.ndarray) -> np.ndarray:
        """1/R at places ``x`` [m], > 0 to the left, shape as ``x`` [1/m]."""
        return self.curvature * self.share(x)

    def upright_curvature_at(self, x: np.ndarray) -> np.ndarray:
        """Part of 1/R across the canted plane at places ``x`` [m], >= 0 upwards, shape as ``x``
        [1/m]: a straight wire runs inside of the curve, above the inner rail, which is low."""
        share = self.share(x)
        return np.asarray(abs(self.curvature) * share * np.sin(self.tilt * share))

    def upright_part_at(self, x: np.ndarray) -> np.ndarray:
        """Part across the canted plane of a level force to the left at places ``x`` [m], > 0
        upwards, shape as ``x`` [-]."""
        return np.sin(self.roll_at(x))

    def roll_at(self, x: np.ndarray) -> np.ndarray:
        """Cant angle at places ``x`` [m], > 0 where the left rail is low, shape as ``x`` [rad]."""
        return np.asarray(np.sign(self.curvature) * self.tilt * self.share(x))

    def sideways_pull_at(self, x: np.ndarray) -> np.ndarray:
        """Share of a weight that pulls sideways across the canted track at places ``x`` [m], > 0 to
        the left, shape as ``x`` [-]."""
        return np.tan(self.roll_at(x))
