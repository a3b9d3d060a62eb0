"""Aerodynamic uplift of a pantograph as a function of the air's speed, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
