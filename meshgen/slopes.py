"""Forces of springs as tables of slopes: piecewise linear over the stretch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Slopes(NamedTuple):
    """Tables of n springs with m pieces each; the first one goes on below its begin, the last one
    for ever.

    Attributes
    ----------
    begin : (n, m) stretch at which each piece begins [m], zero of the first one
    force : (n, m) there [N], zero of the first one
    slope : (n, m) of each piece [N/m]
    """

    begin: np.ndarray
    force: np.ndarray
    slope: np.ndarray

    def piece_under(self, force: np.ndarray) -> np.ndarray:
        """Pieces that have forces (n,) [N]; where one ends, the next one."""
        return np.asarray((force[:, None] >= self.force[:, 1:]).sum(axis=1))

    def at(self, piece: np.ndarray) -> Slopes:
        """One piece of each."""
        each = np.arange(piece.size), piece
        return Slopes(self.begin[each], self.force[each], self.slope[each])

    def stretch_under(self, force: np.ndarray) -> np.ndarray:
        """Stretch (n,) under forces (n,) [N] [m]."""
        on = self.at(self.piece_under(force))
        return np.asarray(on.begin + (force - on.force) / on.slope)

    def force_at(self, stretch: np.ndarray) -> np.ndarray:
        """Forces (n,) at stretches (n,) [m] [N]."""
        on = self.at((stretch[:, None] >= self.begin[:, 1:]).sum(axis=1))
        return np.asarray(on.force + on.slope * (stretch - on.begin))

    def energy_under(self, force: np.ndarray) -> np.ndarray:
        """What springs store under forces (n,) [N] [J]."""
        piece = self.piece_under(force)
        mean = 0.5 * (self.force[:, 1:] + self.force[:, :-1])
        work = np.cumsum(mean * np.diff(self.begin, axis=1), axis=1)
        on, below = self.at(piece), np.pad(work, ((0, 0), (1, 0)))[np.arange(piece.size), piece]
        return np.asarray(below + (force**2 - on.force**2) / (2.0 * on.slope))


def steepness(curve: Sequence[tuple[float, float]]) -> np.ndarray:
    """Slopes (m,) between the points (m + 1,) of a curve."""
    rise = np.diff(np.array(curve), axis=0)
    return np.asarray(rise[:, 1] / rise[:, 0])
