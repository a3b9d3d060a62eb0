"""Collector strips that bend: modes of a free beam, which its suspension joins.

A strip is a beam of constant section. Its height and, with the head, its roll are those of a rigid
one; bending adds q_1 f_1(y) + q_2 f_2(y) + .. with the modes of a beam whose ends are free. These
are orthogonal to both rigid motions and to each other. The strip stands on two springs, each half
of its suspension, which resist what the modes move them by: with modes enough the beam on its
springs is exact (Ritz). f_k is normalised to the strip's whole mass.

Source: any book on vibrations: cosh(b) cos(b) = 1, f = cosh + cos - s (sinh + sin).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from catenary.mbs.head.head_arrays import SplineTables

# Points of the tables of modes along half a wave of the highest one.
_POINTS_A_WAVE = 100


class Bending(NamedTuple):
    """Strips that bend: tables of their modes over the place on a strip [m]; the first coordinate,
    the modes of a strip being one after the other; wires that may touch each strip."""

    tables: SplineTables
    first: int
    wires: int


@dataclass(frozen=True)
class Flexure:
    """Bending of a strip.

    ``stiffness`` EI [N m2]; ``spring_distance`` [m] across the track between the two springs below;
    ``n_modes`` that are followed; ``damping_ratio`` of each as a free beam.
    """

    stiffness: float
    spring_distance: float
    n_modes: int
    damping_ratio: float = 0.0

    def rates(self, mass: float, length: float) -> np.ndarray:
        """Natural frequencies of a free strip [rad/s], (n_modes,)."""
        roots = np.array([_root(number) for number in range(self.n_modes)])
        return np.asarray(roots**2 * np.sqrt(self.stiffness / (mass * length**3)))


def shapes(n_modes: int, length: float, places: np.ndarray) -> np.ndarray:
    """Shapes of the modes at places from the strip's middle [m], (n_modes, len(places))."""
    x = places / length + 0.5
    found = []
    for number in range(n_modes):
        root = _root(number)
        ratio = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
        argument = root * x
        # cosh - s sinh, with s close to 1: by exponentials, which do not cancel.
        grown = 0.5 * (1.0 - ratio) * np.exp(argument) + 0.5 * (1.0 + ratio) * np.exp(-argument)
        found.append(grown + np.cos(argument) - ratio * np.sin(argument))
    return np.array(found)


def mode_tables(n_modes: int, length: float) -> SplineTables:
    """The shapes as tables over the whole strip."""
    from scipy.interpolate import CubicSpline  # not loaded for strips that are rigid

    places = np.linspace(-0.5 * length, 0.5 * length, _POINTS_A_WAVE * (n_modes + 1) + 1)
    spline = CubicSpline(places, shapes(n_modes, length, places).T)
    return SplineTables(places, np.ascontiguousarray(np.moveaxis(spline.c, 0, 2)))


@lru_cache(maxsize=32)
def _root(number: int) -> float:
    """Root of cosh(b) cos(b) = 1, the first being 4.73."""
    from scipy.optimize import brentq  # not loaded for strips that are rigid

    near = (number + 1.5) * np.pi
    return float(brentq(lambda b: np.cos(b) - 1.0 / np.cosh(b), near - 0.2, near + 0.2, xtol=1e-13))
