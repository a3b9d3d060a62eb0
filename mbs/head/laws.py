"""Laws of a pantograph that are not linear: forces over heights or velocities, as tables.

A law acts between a mass and what is below it, or between a mass and the base. It pulls the mass
down, and what is below it up, by a force over the extension between the two, or over its rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from catenary.solver.kernels import native


@dataclass(frozen=True)
class Law:
    """A force over an extension, straight between its points and beyond its ends.

    Extensions between two masses count from where all springs are relaxed. Those between a mass and
    the base count from where the mass stands with the head at its nominal height under the static
    force, where the base spring of a chain is relaxed.

    Attributes
    ----------
    mass : which mass it holds, the head being 0
    below : which one it holds it to; the number of masses stands for the base
    of_rate : whether its points are rates
    points : extensions [m] or their rates [m/s], which grow
    forces : [N] at these, which never fall
    """

    mass: int
    below: int
    of_rate: bool
    points: tuple[float, ...]
    forces: tuple[float, ...]


@dataclass(frozen=True)
class LawsInPlace:
    """Laws on the coordinates of a pantograph that stands.

    Attributes
    ----------
    laws : tuple of Law
    ways : (m, n) the extension of each by each coordinate
    by_base : (m,) by the height of the base
    zero : (m,) the extension where each counts from [m]
    """

    laws: tuple[Law, ...]
    ways: np.ndarray
    by_base: np.ndarray
    zero: np.ndarray

    def arrays(self, n_contacts: int) -> native.HeadLaws:
        """Arrays of the laws for kernels, with room for the forces of so many contacts."""
        law = np.zeros(len(self.laws), dtype=native.HEAD_LAW)
        counts = np.array([len(one.points) for one in self.laws], dtype=np.int64)
        law["by_base"], law["zero"] = self.by_base, self.zero
        law["of_rate"] = [one.of_rate for one in self.laws]
        law["end"] = np.cumsum(counts)
        law["begin"] = law["end"] - counts
        points = [pair for one in self.laws for pair in zip(one.points, one.forces, strict=True)]
        return native.HeadLaws(
            self.ways, law, np.array(points, dtype=native.HEAD_LAW_POINT), np.zeros(n_contacts)
        )


def in_place(
    laws: Sequence[Law], numbers: Sequence[int], n: int, rest: Sequence[float]
) -> LawsInPlace:
    """Laws on n coordinates.

    Parameters
    ----------
    laws : sequence of Law
        Laws of the pantograph.
    numbers : sequence of int
        Coordinates of its masses.
    n : int
        Number of all coordinates.
    rest : sequence of float
        Heights of the masses at rest under the static force, at the nominal height [m].
    """
    ways, by_base, zero = np.zeros((len(laws), n)), np.zeros(len(laws)), np.zeros(len(laws))
    for j, law in enumerate(laws):
        ways[j, numbers[law.mass]] = 1.0
        if law.below < len(numbers):
            ways[j, numbers[law.below]] = -1.0
        else:
            by_base[j], zero[j] = -1.0, rest[law.mass]
    return LawsInPlace(tuple(laws), ways, by_base, zero)
