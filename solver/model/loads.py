"""Loads in time: forces on unknowns of a line beside those of contacts and droppers.

By what is known ahead of the march: a shape times a function of time, a field sampled in space and
time, past accelerations of an end, and a function in Python. Compiled loops evaluate all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from scipy import sparse  # not loaded for lists of keys and checks, which make no load

CONSTANT, TABLE, HARMONICS = range(3)


class TimeFunction(NamedTuple):
    """A function of time as numbers; made by ``constant``, ``table`` and ``harmonics``.

    Attributes
    ----------
    kind : one of CONSTANT, TABLE, HARMONICS
    numbers : of a constant its value; of a table all times, then all values; of harmonics the mean,
        then angular frequency, amplitude and phase of each
    """

    kind: int
    numbers: np.ndarray


def constant(value: float = 1.0) -> TimeFunction:
    """A constant ``value`` at all times."""
    return TimeFunction(CONSTANT, np.array([value], dtype=float))


def table(times: Sequence[float], values: Sequence[float]) -> TimeFunction:
    """Linear between ``values`` at ascending ``times`` [s], the first before and the last after."""
    at, found = np.array(times, dtype=float), np.array(values, dtype=float)
    if at.size == 0 or at.shape != found.shape or (np.diff(at) <= 0.0).any():
        raise ValueError("a table needs as many values as times, which ascend")
    return TimeFunction(TABLE, np.concatenate([at, found]))


def harmonics(
    frequencies: Sequence[float],
    amplitudes: Sequence[float],
    phases: Sequence[float],
    mean: float = 0.0,
) -> TimeFunction:
    """``mean`` + sum of amplitude cos(2 pi frequency t + phase).

    ``frequencies`` [Hz], ``amplitudes`` and ``phases`` [rad] have one entry for each term;
    amplitudes have the unit of the function.
    """
    omega = 2.0 * np.pi * np.array(frequencies, dtype=float)
    waves = np.column_stack([omega, np.array(amplitudes, float), np.array(phases, float)])
    return TimeFunction(HARMONICS, np.concatenate([[mean], waves.ravel()]))


@dataclass(frozen=True)
class ShapeLoad:
    """``forces`` times a function of time.

    Attributes
    ----------
    unknowns : (n,) numbers of unknowns, which may repeat
    forces : (n,) [N], [N m]
    factor : TimeFunction
    """

    unknowns: np.ndarray
    forces: np.ndarray
    factor: TimeFunction = constant()


@dataclass(frozen=True)
class FieldLoad:
    """A field of points along the line and of time, such as a gust.

    It is linear in time between slices at multiples of ``interval``. Slices are made by blocks,
    ahead of the steps that need them; each rank makes those of the points along its own part.

    Attributes
    ----------
    unknowns : (n,) numbers of unknowns
    weights : (n, n_points) forces [N], [N m] of a unit of the field at each point, see ``along``
    interval : between slices [s]
    fill : ``fill(first, points, slices)`` fills ``slices`` (m, k) with the field at the points of
        the slice ``points`` and at the times (first + i) ``interval``. It may be called for any
        part in any order, and gives the same each time
    """

    unknowns: np.ndarray
    weights: sparse.csr_matrix
    interval: float
    fill: Callable[[int, slice, np.ndarray], None]


@dataclass(frozen=True)
class FunctionLoad:
    """A function in Python, called once a step: slow, which log and report state.

    Attributes
    ----------
    name : its name in messages
    unknowns : (n,) numbers of unknowns
    values : forces [N], [N m] (n,) at a time [s]; depends on nothing else, since it may be called
        ahead of the step, and on ranks that own any of the unknowns
    """

    name: str
    unknowns: np.ndarray
    values: Callable[[float], np.ndarray]


@dataclass(frozen=True)
class MemoryLoad:
    """Forces -sum over j >= 1 of Q_j b_(n - j) by past accelerations b, such as of a line beyond.

    The matrices contain the term of the latest acceleration. Accelerations are those that balance
    the forces at the ends of steps of ``dt``.

    Attributes
    ----------
    unknowns : (m,) numbers of unknowns, all owned by one rank
    dt : time step [s]
    n_steps : largest number of steps of a march
    numbers : ``numbers(n)`` returns Q_0 to Q_(n - 1), (n, m, m) [N s2/m], with Q_0 = 0
    """

    unknowns: np.ndarray
    dt: float
    n_steps: int
    numbers: Callable[[int], np.ndarray]


Load = ShapeLoad | FieldLoad | FunctionLoad | MemoryLoad
