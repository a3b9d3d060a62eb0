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
from catenary.solver.kernels import compiled, in_line, tension_of
from catenary.solver.station_blocks import BLOCK, StationProduct, multiply_row, multiply_rows
from catenary.solver.station_factors import (
    StationFactors,
    eliminate,
    substitute,
    substitute_outside,
)

# Stations of a stretch: large enough for memory to be read ahead, 64 kB of each array, of which a
# cache next to a processor, of 1 MB, holds the six that both ends need.
_STRETCH = 2048


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
        n = high - low
        # As many at both ends, at least one: the others are predicted under way, from there on.
        told_ahead = min(max(*told, 1), n)
        acceleration, work = answer[BLOCK * low :], read[BLOCK * (product.first + low) :]
        own = displacement, velocity, acceleration, work
        factored = factors.kinds, factors.blocks, low, high
        multiplied = product.kinds, product.blocks, product.first, read
        self._tell = n, told_ahead, own, steps[:4]
        self._forth = multiplied, factored, told_ahead, own, answer, steps[:4]
        self._back = factored, own, answer, steps[4:]

    def tell(self) -> None:
        """Predict the stations that others read."""
        tell(*self._tell)

    def forth(self) -> None:
        """Predict all others, and eliminate, after ``tell`` and what others told."""
        forth(*self._forth)

    def back(self, droppers: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
        """Find the accelerations, correct, and fill the tension of ``droppers``: their ends, laws
        and tension, as ``LineMotion.look_at`` takes them."""
        back(*self._back, droppers)


# Kernels take what belongs together as tuples, named as in ``StationPasses``.
_BLOCK = np.uint64(BLOCK)


@in_line
def predict(station, own, coefficients):
    """As ``kernels.predict`` for one of the rank's own stations: what the product reads of it."""
    displacement, velocity, acceleration, _ = own
    dt, c_position, c_velocity, c_work = coefficients
    at = _BLOCK * np.uint64(station)
    d, v, a = load(displacement, at), load(velocity, at), load(acceleration, at)
    d = add_scaled(add_scaled(d, dt, v), c_position, a)
    v = add_scaled(v, c_velocity, a)
    store(displacement, at, d)
    store(velocity, at, v)
    return add_scaled(add_scaled(zero(), -1.0, d), -c_work, v)


@in_line
def predict_all(begin, end, own, coefficients):
    """Predict the rank's own stations from ``begin`` to ``end``, and keep what is read of them."""
    for i in range(begin, end):
        store(own[3], _BLOCK * np.uint64(i), predict(i, own, coefficients))


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
def tell(n, ahead, own, coefficients):
    """Predict the first and last stations of a rank's own n, ``ahead`` each."""
    predict_all(0, ahead, own, coefficients)
    predict_all(max(ahead, n - ahead), n, own, coefficients)


@in_line
def station_of(array, number):
    """What an array holds of a station."""
    return load(array, _BLOCK * np.uint64(number))


@in_line
def eliminate_both(factored, begin, end, x, y, answer):
    """Eliminate own stations from ``begin`` to ``end``, counted from both ends."""
    kinds, blocks, low, high = factored
    for k in range(begin, end):
        x = eliminate(kinds, blocks, answer, low + k, x, answer)
        y = eliminate(kinds, blocks, answer, high - 1 - k, y, answer)
    return x, y


@in_line
def forth_outside(multiplied, factored, ahead, answer):
    """Multiply and eliminate what is outside of the rank's own stations, and the first ``ahead`` of
    these at both ends."""
    product_kinds, product_blocks, first, read = multiplied
    kinds, blocks, low, high = factored
    multiply_rows(product_kinds, product_blocks, first, read, 0, low + ahead, answer)
    multiply_rows(product_kinds, product_blocks, first, read, high - ahead, kinds.size, answer)
    x, y = zero(), zero()
    for i in range(low):
        x = eliminate(kinds, blocks, answer, i, x, answer)
    for j in range(kinds.size - 1, high - 1, -1):
        y = eliminate(kinds, blocks, answer, j, y, answer)
    return eliminate_both(factored, 0, ahead, x, y, answer)


@in_line
def forth_on_the_left(multiplied, low, begin, end, out, here, own, answer, coefficients):
    """Predict own stations and multiply those one further out, ``begin`` to ``end``.

    ``out`` and ``here`` are what is read of the last two that are predicted.
    """
    kinds, blocks, _, _ = multiplied
    for k in range(begin, end):
        inward = predict(k + 1, own, coefficients)
        row = multiply_row(kinds, blocks, low + k, out, here, inward)
        store(answer, _BLOCK * np.uint64(low + k), row)
        out, here = here, inward
    return out, here


@in_line
def forth_on_the_right(multiplied, high, n, begin, end, out, here, own, answer, coefficients):
    """As on the left, counted from the other end of the rank's own n stations."""
    kinds, blocks, _, _ = multiplied
    for k in range(begin, end):
        inward = predict(n - 2 - k, own, coefficients)
        row = multiply_row(kinds, blocks, high - 1 - k, inward, here, out)
        store(answer, _BLOCK * np.uint64(high - 1 - k), row)
        out, here = here, inward
    return out, here


@compiled
def forth(multiplied, factored, ahead, own, answer, coefficients):
    """Leave in ``answer`` what elimination leaves of the right-hand side; see ``StationPasses``.

    Of the rank's own stations, ``ahead`` at both ends are predicted.
    """
    product_kinds, product_blocks, first, read = multiplied
    kinds, blocks, low, high = factored
    n, middle, pairs = high - low, (low + high) // 2, (high - low - 1) // 2
    begin = max(min(ahead, pairs) - 1, 0)
    end = max(begin, pairs - 1)
    x, y = forth_outside(multiplied, factored, begin, answer)
    # Under way, what is predicted goes from station to station without being stored.
    left, right = first + low + begin, first + high - 1 - begin
    left_out, left_here = station_of(read, left - 1), station_of(read, left)
    right_out, right_here = station_of(read, right + 1), station_of(read, right)
    for start in range(begin, end, _STRETCH):
        stop = min(start + _STRETCH, end)
        left_out, left_here = forth_on_the_left(
            multiplied, low, start, stop, left_out, left_here, own, answer, coefficients
        )
        right_out, right_here = forth_on_the_right(
            multiplied, high, n, start, stop, right_out, right_here, own, answer, coefficients
        )
        x, y = eliminate_both(factored, start, stop, x, y, answer)
    # Rows in the middle read stations of both sides.
    left, right = first + low + end, first + high - 1 - end
    store(read, _BLOCK * np.uint64(left - 1), left_out)
    store(read, _BLOCK * np.uint64(left), left_here)
    store(read, _BLOCK * np.uint64(right + 1), right_out)
    store(read, _BLOCK * np.uint64(right), right_here)
    predict_all(max(ahead, end + 1), min(n - ahead, n - 1 - end), own, coefficients)
    multiply_rows(product_kinds, product_blocks, first, read, low + end, high - end, answer)
    x, y = eliminate_both(factored, end, pairs, x, y, answer)
    # One more towards the start of the line, if there is an even number of them.
    for i in range(low + pairs, middle + 1):
        x = eliminate(kinds, blocks, answer, i, x, answer)
    substitute(kinds, blocks, middle, y, answer)


@in_line
def both_within(begin, end, ends, dropper):
    """Whether both ends of a dropper are among the unknowns from ``begin`` to ``end``."""
    upper, lower = ends[dropper, 0], ends[dropper, 1]
    return (upper >= begin) & (lower >= begin) & (upper < end) & (lower < end)


@in_line
def pull(low, high, left, right, own, droppers):
    """Find the tension of droppers with both ends among own stations from ``low`` to ``high``.

    Those from ``left`` to ``right`` have theirs; returns the like after this.
    """
    displacement, velocity, _, _ = own
    ends, laws, tension = droppers
    begin, end = BLOCK * low, BLOCK * high
    while left > 0 and both_within(begin, end, ends, left - 1):
        left -= 1
        tension[left] = tension_of(left, displacement, velocity, ends, laws)
    while right < tension.size and both_within(begin, end, ends, right):
        tension[right] = tension_of(right, displacement, velocity, ends, laws)
        right += 1
    return left, right


@compiled
def back(factored, own, answer, factors, droppers):
    """Fill ``answer`` with the solution, correct the rank's own, and find the tension of its
    droppers; after ``forth``."""
    kinds, blocks, low, high = factored
    middle, pairs = (low + high) // 2, (high - low - 1) // 2
    x = y = load(answer, _BLOCK * np.uint64(middle))
    correct(middle - low, x, own, factors)
    left = right = np.searchsorted(droppers[0][:, 0], BLOCK * (middle - low))
    for start in range(1, pairs + 1, _STRETCH):
        stop = min(start + _STRETCH, pairs + 1)
        for k in range(start, stop):
            x = substitute(kinds, blocks, middle - k, x, answer)
            y = substitute(kinds, blocks, middle + k, y, answer)
            correct(middle - k - low, x, own, factors)
            correct(middle + k - low, y, own, factors)
        left, right = pull(middle + 1 - stop - low, middle + stop - low, left, right, own, droppers)
    for i in range(middle - pairs - 1, low - 1, -1):
        x = substitute(kinds, blocks, i, x, answer)
        correct(i - low, x, own, factors)
    pull(0, high - low, left, right, own, droppers)
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
    passes.back((np.zeros((0, 2), np.int64), np.zeros((0, 4)), np.zeros(0)))
