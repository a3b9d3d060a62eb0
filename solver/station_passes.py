"""A line's step without contacts in two passes over its state, for Newmark's method.

Forth, from both ends of the line to its middle: prediction, product with K, elimination. Back:
substitution and correction. A step that does these one after the other reads the state from memory
as often as there are of them, which is what long lines wait for; here a stretch of the line is in
the nearest cache until a pass is through with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.fours import add_scaled, load, store, zero
from catenary.solver.kernels import compiled, in_line
from catenary.solver.station_blocks import BLOCK, StationProduct, multiply_rows
from catenary.solver.station_factors import (
    StationFactors,
    eliminate,
    substitute,
    substitute_outside,
)

# Stations of a stretch: large enough for memory to be read ahead, 32 kB of each array, of which a
# cache next to a processor, of 1 MB, holds eight.
_STRETCH = 1024


class Steps(NamedTuple):
    """What a step of Newmark's method is made of; see ``kernels.predict`` and ``correct``."""

    dt: float
    predict_position: float
    predict_velocity: float
    work_velocity: float
    position_factor: float
    velocity_factor: float
    damping_share: float


class StationPasses:
    """Takes free steps. Not collective.

    Parameters
    ----------
    product : with K
    factors : of the step operator
    read : what ``product`` reads; it holds -(d + c v) of others' stations before ``forth``
    answer : (4 n,) of all that is solved for; the rank's own part is the acceleration
    told : how many of the rank's first and last stations other ranks read
    displacement, velocity : of the rank's own stations, (n_local,)
    """

    def __init__(
        self,
        product: StationProduct,
        factors: StationFactors,
        read: np.ndarray,
        answer: np.ndarray,
        told: tuple[int, int],
        displacement: np.ndarray,
        velocity: np.ndarray,
        steps: Steps,
    ) -> None:
        low, high = factors.low, factors.high
        first = min(told[0], high - low)
        # What is not to be told is predicted under way.
        ready = first, max(first, high - low - told[1])
        acceleration, work = answer[BLOCK * low :], read[BLOCK * (product.first + low) :]
        own = displacement, velocity, acceleration, work
        factored = factors.kinds, factors.blocks, low, high
        multiplied = product.kinds, product.blocks, product.first, read
        self._tell = ready, own, steps[:4]
        self._forth = multiplied, factored, ready, own, answer, steps[:4]
        self._back = factored, own, answer, steps[4:]

    def tell(self) -> None:
        """Predict the stations that others read."""
        tell(*self._tell)

    def forth(self) -> None:
        """Predict all others, and eliminate, after ``tell`` and what others told."""
        forth(*self._forth)

    def back(self) -> None:
        """Find the accelerations and correct."""
        back(*self._back)


# Kernels take what belongs together as tuples, named as in ``StationPasses``.
_BLOCK = np.uint64(BLOCK)


@in_line
def predict(station, own, coefficients):
    """As ``kernels.predict`` for one of the rank's own stations."""
    displacement, velocity, acceleration, work = own
    dt, c_position, c_velocity, c_work = coefficients
    at = _BLOCK * np.uint64(station)
    d, v, a = load(displacement, at), load(velocity, at), load(acceleration, at)
    d = add_scaled(add_scaled(d, dt, v), c_position, a)
    v = add_scaled(v, c_velocity, a)
    store(displacement, at, d)
    store(velocity, at, v)
    store(work, at, add_scaled(add_scaled(zero(), -1.0, d), -c_work, v))


@in_line
def correct(station, x, own, factors):
    """As ``kernels.correct`` for one of the rank's own stations, whose solution is x."""
    displacement, velocity, acceleration, _ = own
    position_factor, velocity_factor, damping_share = factors
    at = _BLOCK * np.uint64(station)
    v = load(velocity, at)
    a = add_scaled(x, -damping_share, v)
    store(acceleration, at, a)
    store(velocity, at, add_scaled(v, velocity_factor, a))
    store(displacement, at, add_scaled(load(displacement, at), position_factor, a))


@compiled
def tell(ready, own, coefficients):
    """Predict the rank's own stations but those between ``ready``."""
    begin, end = ready
    for i in range(begin):
        predict(i, own, coefficients)
    for i in range(end, own[0].size // BLOCK):
        predict(i, own, coefficients)


@compiled
def forth(multiplied, factored, ready, own, answer, coefficients):
    """Leave in ``answer`` what elimination leaves of the right-hand side; see ``StationPasses``.

    The rank's own stations between ``ready`` are still to be predicted.
    """
    product_kinds, product_blocks, first, read = multiplied
    kinds, blocks, low, high = factored
    begin, end = ready
    n, middle, pairs = high - low, (low + high) // 2, (high - low - 1) // 2
    # Rows take the place of accelerations, and read what is predicted on both sides of them.
    multiply_rows(product_kinds, product_blocks, first, read, 0, low, answer)
    multiply_rows(product_kinds, product_blocks, first, read, high, kinds.size, answer)
    x, y = zero(), zero()
    for i in range(low):
        x = eliminate(kinds, blocks, answer, i, x, answer)
    for j in range(kinds.size - 1, high - 1, -1):
        y = eliminate(kinds, blocks, answer, j, y, answer)
    for start in range(0, pairs, _STRETCH):
        stop = min(start + _STRETCH, pairs)
        for i in range(begin, min(stop + 1, end)):
            predict(i, own, coefficients)
        begin = max(begin, min(stop + 1, end))
        for j in range(max(n - 1 - stop, begin), end):
            predict(j, own, coefficients)
        end = max(begin, min(n - 1 - stop, end))
        i, j = low + start, high - stop
        multiply_rows(product_kinds, product_blocks, first, read, i, low + stop, answer)
        multiply_rows(product_kinds, product_blocks, first, read, j, high - start, answer)
        for k in range(start, stop):
            x = eliminate(kinds, blocks, answer, low + k, x, answer)
            y = eliminate(kinds, blocks, answer, high - 1 - k, y, answer)
    for i in range(begin, end):
        predict(i, own, coefficients)
    # One more towards the start of the line, if there is an even number of them.
    i = low + pairs
    multiply_rows(product_kinds, product_blocks, first, read, i, middle + 1, answer)
    for i in range(low + pairs, middle + 1):
        x = eliminate(kinds, blocks, answer, i, x, answer)
    substitute(kinds, blocks, middle, y, answer)


@compiled
def back(factored, own, answer, factors):
    """Fill ``answer`` with the solution, and correct the rank's own; after ``forth``."""
    kinds, blocks, low, high = factored
    middle, pairs = (low + high) // 2, (high - low - 1) // 2
    x = y = load(answer, _BLOCK * np.uint64(middle))
    correct(middle - low, x, own, factors)
    for k in range(1, pairs + 1):
        x = substitute(kinds, blocks, middle - k, x, answer)
        y = substitute(kinds, blocks, middle + k, y, answer)
        correct(middle - k - low, x, own, factors)
        correct(middle + k - low, y, own, factors)
    for i in range(middle - pairs - 1, low - 1, -1):
        x = substitute(kinds, blocks, i, x, answer)
        correct(i - low, x, own, factors)
    substitute_outside(kinds, blocks, low, high, x, y, answer)


def warm_up() -> None:
    """Compile the kernels, or load them from Numba's cache, before the clock of a march starts."""
    kinds, station = np.zeros(1, dtype=np.int32), np.zeros(BLOCK)
    product = StationProduct(kinds, np.zeros(2 * BLOCK**2), 1)
    factors = StationFactors(kinds, np.zeros(3 * BLOCK**2), 0, 1)
    read, own = np.zeros(3 * BLOCK), (station.copy(), station.copy())
    steps = Steps(*[0.0] * len(Steps._fields))
    passes = StationPasses(product, factors, read, station, (0, 0), *own, steps)
    passes.tell()
    passes.forth()
    passes.back()
