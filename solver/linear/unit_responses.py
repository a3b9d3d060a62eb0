"""Short columns of A^-1: the line's answer within one step to unit forces on wire and droppers.

A column vanishes beyond the reach of the operator, so only a window of it is stored. Forces far
enough apart do not see each other, so many columns come from one solve.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from catenary.solver.base.errors import RunBroken
from catenary.solver.model.partition import Ownership
from catenary.solver.model.unknowns.registry import Unknowns

# What may stand outside the windows, relative to the peak: round-off of one solve.
_LEAK = 1e-13


class Windows(NamedTuple):
    """Where along the line unknowns stand, and which of them a force at x can move.

    Attributes
    ----------
    numbering : Unknowns, which says where they stand
    reach : half width of a window [m]
    """

    numbering: Unknowns
    reach: float

    def around(self, x_low: float, x_high: float) -> tuple[int, int]:
        """Range of unknowns within reach of [x_low, x_high]."""
        return self.numbering.within(x_low - self.reach, x_high + self.reach)


class ShortColumns:
    """Owned parts of the columns A^-1 b_j for sparse right-hand sides b_j.

    Attributes
    ----------
    start : (n,) local number of the first unknown of each column's owned window
    values : list of n arrays, the owned window of each column, possibly empty
    """

    def __init__(self, start: np.ndarray, values: list[np.ndarray]) -> None:
        self.start = start
        self.values = values

    def packed(self) -> PackedColumns:
        """The same in one array."""
        sizes = np.array([values.size for values in self.values], dtype=np.int64)
        offset = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
        return PackedColumns(self.start, offset, np.concatenate([*self.values, np.zeros(0)]))


class PackedColumns(NamedTuple):
    """Columns one after the other: that of number i is ``data[offset[i] : offset[i + 1]]``.

    ``start`` (n,) holds the local number of the first unknown of each.
    """

    start: np.ndarray
    offset: np.ndarray
    data: np.ndarray


def compute(
    comm: Any,
    solve_for: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ownership: Ownership,
    windows: Windows,
    dofs: np.ndarray,
    coefficients: np.ndarray,
    x: np.ndarray,
    half_length: np.ndarray | None = None,
) -> ShortColumns:
    """Columns for the right-hand sides with ``coefficients`` on ``dofs``, both (n, m). Collective.

    ``x`` (n,) [m] is where each of them stands, ``half_length`` (n,) [m] how far they reach to both
    sides of it, zero if left out; ``solve_for`` that of ``LineOperators``.
    """
    n = x.size
    start = np.zeros(n, dtype=np.int64)
    values: list[np.ndarray] = [np.zeros(0)] * n
    half = np.zeros(n) if half_length is None else half_length
    groups = _groups_apart(x, 2.0 * (windows.reach + half.max(initial=0.0)))
    largest = np.zeros((2, len(groups)))
    for number, group in enumerate(groups):
        array = solve_for(dofs[group].ravel(), coefficients[group].ravel())
        largest[0, number] = np.abs(array).max(initial=0.0)
        for column in group:
            low, high = windows.around(x[column] - half[column], x[column] + half[column])
            low = min(max(low, ownership.first), ownership.last) - ownership.first
            high = min(max(high, ownership.first), ownership.last) - ownership.first
            start[column] = low
            values[column] = array[low:high].copy()
            array[low:high] = 0.0
        largest[1, number] = np.abs(array).max(initial=0.0)
        array[:] = 0.0
    comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
    peak, leak = largest
    if (leak > _LEAK * peak).any():
        raise RunBroken(
            "the response to a point load does not decay within "
            f"{windows.reach:.0f} m; give the scene a smaller numerics.dt_s"
        )
    return ShortColumns(start, values)


def _groups_apart(x: np.ndarray, distance: float) -> list[np.ndarray]:
    """Split positions into few groups in each of which all are further apart than ``distance``."""
    groups: list[list[int]] = []
    ends: list[tuple[float, int]] = []
    for i in np.argsort(x, kind="stable"):
        if ends and x[i] - ends[0][0] > distance + 1e-6:
            _, group = heapq.heappop(ends)
        else:
            group = len(groups)
            groups.append([])
        groups[group].append(int(i))
        heapq.heappush(ends, (float(x[i]), group))
    return [np.array(group) for group in groups]
