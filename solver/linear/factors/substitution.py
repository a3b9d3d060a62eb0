"""A solve with the factors: elimination of the right-hand side, then back substitution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import compiled, inner
from catenary.solver.base.kernels.pointers import borrowed
from catenary.solver.linear.stations.lane_products import (
    add_beside,
    add_symmetric,
    add_whole,
    numbers_from,
    sums_from,
    total_of,
)
from catenary.solver.linear.stations.lanes import (
    beside_size,
    half_size,
    is_sparse,
    load,
    narrowed,
    store,
    whole_size,
    widened,
    zero,
)
from catenary.solver.linear.stations.make_ups import (
    Places,
    block_at,
    by_make_up,
    make_up_of,
    start_of,
)
from catenary.solver.linear.stations.station_layout import Layout


class Factored(NamedTuple):
    """What kernels read of ``StationFactors``, whose attributes these are."""

    layout: Layout
    places: Places
    kinds: np.ndarray
    blocks: np.ndarray
    beside_kinds: np.ndarray
    besides: np.ndarray
    low: int
    ends: np.ndarray


@inner
def factors_of(part, factored, station):
    """Where the blocks of a station are; ``part`` is the layout of its make-up."""
    size = np.uint64(3) * whole_size(part)
    if is_sparse(part):
        size = half_size(part)
    return numbers_from(factored.blocks, block_at(part, factored.kinds, station, size))


@inner
def add_joined(part, factored, sums, station, towards_end, x):
    """Add to sums what a station gets from the one beside it, ``towards_end`` of the line or else
    its start, which holds ``x``: the block of the matrix between both, negative, times x."""
    size = beside_size(part)
    at = block_at(part, factored.beside_kinds, station, np.uint64(2) * size)
    numbers = numbers_from(factored.besides, at)
    return add_beside(part, sums, numbers, size if towards_end else np.uint64(0), x)


@inner
def divided(part, factored, station, left):
    """What is ``left`` of a station's right-hand side, divided by its block after elimination."""
    numbers, sums = factors_of(part, factored, station), sums_from(part, zero(part))
    if is_sparse(part):
        return total_of(part, add_symmetric(part, sums, numbers, left))
    return total_of(part, add_whole(part, sums, numbers, np.uint64(0), left))


@inner
def first_of(factored, station):
    """First unknown of a station."""
    return start_of(factored.layout, factored.places, station)


@inner
def make_up_at(factored, station):
    """Make-up of a station."""
    return make_up_of(factored.layout, factored.places, station)


@inner
def eliminate(part, factored, sums, station, before, outward, answer):
    """Leave in ``answer`` what the right-hand side of a station, as ``sums``, is after those
    outwards of it are eliminated, of which ``before`` is the last; ``part`` is the layout of its
    make-up.

    Returns what the station inwards of it takes as ``outward``.
    """
    outward = narrowed(part, outward)
    if is_sparse(part):
        sums = add_joined(part, factored, sums, station, before > station, outward)
        left = total_of(part, sums)
        store(part, answer, first_of(factored, station), left)
        return widened(part, divided(part, factored, station, left))
    numbers, skipped = factors_of(part, factored, station), np.uint64(2) * whole_size(part)
    left = total_of(part, add_whole(part, sums, numbers, skipped, outward))
    store(part, answer, first_of(factored, station), left)
    return widened(part, left)


@inner
def _eliminate_right(part, factored, right, station, before, outward, answer):
    sums = sums_from(part, load(part, right, first_of(factored, station)))
    return eliminate(part, factored, sums, station, before, outward, answer)


eliminate_in = by_make_up(_eliminate_right)


@inner
def eliminate_right(factored, right, station, before, outward, answer):
    """``eliminate`` with the right-hand side of an array."""
    make_up = make_up_at(factored, station)
    layout = factored.layout
    return eliminate_in(layout, make_up, factored, right, station, before, outward, answer)


@inner
def _meet(part, factored, middle, towards_end, answer):
    here = first_of(factored, middle)
    left, towards_end = load(part, answer, here), narrowed(part, towards_end)
    if is_sparse(part):
        sums = sums_from(part, left)
        left = total_of(part, add_joined(part, factored, sums, middle, True, towards_end))
    else:
        numbers, sums = factors_of(part, factored, middle), sums_from(part, left)
        left = total_of(part, add_whole(part, sums, numbers, whole_size(part), towards_end))
    own = divided(part, factored, middle, left)
    store(part, answer, here, own)
    return widened(part, own)


meet_in = by_make_up(_meet)


@inner
def meet(factored, middle, towards_end, answer):
    """Unknowns of the middle station from what ``answer`` holds of it and what is left of the one
    beside it, ``towards_end`` of the line."""
    make_up = make_up_at(factored, middle)
    return meet_in(factored.layout, make_up, factored, middle, towards_end, answer)


@inner
def solved(part, factored, station, inward, answer):
    """Unknowns of a station, in lanes of ``part``, from what ``answer`` holds of it and those
    ``inward`` of it."""
    left = load(part, answer, first_of(factored, station))
    inward = narrowed(part, inward)
    if is_sparse(part):
        sums, towards_end = sums_from(part, left), station < factored.ends[4]
        left = total_of(part, add_joined(part, factored, sums, station, towards_end, inward))
        return divided(part, factored, station, left)
    numbers = factors_of(part, factored, station)
    sums = add_whole(part, sums_from(part, zero(part)), numbers, np.uint64(0), left)
    return total_of(part, add_whole(part, sums, numbers, whole_size(part), inward))


@inner
def _substitute_into(part, factored, station, inward, answer):
    own = solved(part, factored, station, inward, answer)
    store(part, answer, first_of(factored, station), own)
    return widened(part, own)


substitute_in = by_make_up(_substitute_into)


@inner
def substitute_into(factored, station, inward, answer):
    """``solved`` in lanes of a whole cross-section, left in ``answer``, too."""
    make_up = make_up_at(factored, station)
    return substitute_in(factored.layout, make_up, factored, station, inward, answer)


@compiled
def solve(factored, right, answer):
    """Fill ``answer`` from ``right``, for all stations; see ``Factored``."""
    factored, right, answer = borrowed((factored, right, answer))
    layout, n, middle = factored.layout, factored.kinds.size, factored.ends[4]
    pairs = min(middle, n - 1 - middle)
    x, y = zero(layout), zero(layout)
    for i in range(pairs):
        j = n - 1 - i
        x = eliminate_right(factored, right, i, max(i - 1, 0), x, answer)
        y = eliminate_right(factored, right, j, min(j + 1, n - 1), y, answer)
    for i in range(pairs, middle + 1):
        x = eliminate_right(factored, right, i, max(i - 1, 0), x, answer)
    for j in range(n - 1 - pairs, middle, -1):
        y = eliminate_right(factored, right, j, min(j + 1, n - 1), y, answer)
    x = y = meet(factored, middle, y, answer)
    for k in range(1, pairs + 1):
        x = substitute_into(factored, middle - k, x, answer)
        y = substitute_into(factored, middle + k, y, answer)
    for i in range(middle - pairs - 1, -1, -1):
        x = substitute_into(factored, i, x, answer)
    for j in range(middle + pairs + 1, n):
        y = substitute_into(factored, j, y, answer)
