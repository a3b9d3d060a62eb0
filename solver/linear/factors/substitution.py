"""A solve with the factors: elimination of the right-hand side, then back substitution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import compiled, inner
from catenary.solver.base.kernels.pointers import pointed
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
def factors_of(layout, factored, station):
    """Where the blocks of a station are; ``layout`` is that of its make-up."""
    size = np.uint64(3) * whole_size(layout)
    if is_sparse(layout):
        size = half_size(layout)
    return numbers_from(factored.blocks, block_at(layout, factored.kinds, station, size))


@inner
def add_joined(layout, factored, sums, station, towards_end, x):
    """Add to sums what a station gets from the one beside it, ``towards_end`` of the line or else
    its start, which holds ``x``: the block of the matrix between both, negative, times x."""
    size = beside_size(layout)
    at = block_at(layout, factored.beside_kinds, station, np.uint64(2) * size)
    numbers = numbers_from(factored.besides, at)
    return add_beside(layout, sums, numbers, size if towards_end else np.uint64(0), x)


@inner
def divided(layout, factored, station, left):
    """What is ``left`` of a station's right-hand side, divided by its block after elimination."""
    numbers, sums = factors_of(layout, factored, station), sums_from(layout, zero(layout))
    if is_sparse(layout):
        return total_of(layout, add_symmetric(layout, sums, numbers, left))
    return total_of(layout, add_whole(layout, sums, numbers, np.uint64(0), left))


@inner
def eliminate(layout, factored, sums, station, towards_end, outward, answer):
    """Leave in ``answer`` what the right-hand side of a station, as ``sums``, is after those
    outwards of it are eliminated, ``towards_end`` of the line or else its start; ``layout`` is that
    of its make-up.

    Returns what the station inwards of it takes as ``outward``.
    """
    here, outward = start_of(layout, factored.places, station), narrowed(layout, outward)
    if is_sparse(layout):
        sums = add_joined(layout, factored, sums, station, towards_end, outward)
        left = total_of(layout, sums)
        store(layout, answer, here, left)
        return widened(layout, divided(layout, factored, station, left))
    numbers = factors_of(layout, factored, station)
    skipped = np.uint64(2) * whole_size(layout)
    left = total_of(layout, add_whole(layout, sums, numbers, skipped, outward))
    store(layout, answer, here, left)
    return widened(layout, left)


@by_make_up
def eliminate_right(layout, places, station, factored, right, towards_end, outward, answer):
    """``eliminate`` with the right-hand side of an array."""
    sums = sums_from(layout, load(layout, right, start_of(layout, places, station)))
    return eliminate(layout, factored, sums, station, towards_end, outward, answer)


@by_make_up
def meet(layout, places, middle, factored, towards_end, answer):
    """Unknowns of the middle station from what ``answer`` holds of it and what is left of the one
    beside it, ``towards_end`` of the line."""
    here = start_of(layout, places, middle)
    left, beside = load(layout, answer, here), narrowed(layout, towards_end)
    if is_sparse(layout):
        sums = sums_from(layout, left)
        left = total_of(layout, add_joined(layout, factored, sums, middle, True, beside))
    else:
        numbers, sums = factors_of(layout, factored, middle), sums_from(layout, left)
        left = total_of(layout, add_whole(layout, sums, numbers, whole_size(layout), beside))
    own = divided(layout, factored, middle, left)
    store(layout, answer, here, own)
    return widened(layout, own)


@inner
def solved(layout, factored, station, inward, answer):
    """Unknowns of a station, in lanes of ``layout``, from what ``answer`` holds of it and those
    ``inward`` of it."""
    left = load(layout, answer, start_of(layout, factored.places, station))
    inward = narrowed(layout, inward)
    if is_sparse(layout):
        sums, towards_end = sums_from(layout, left), station < factored.ends[4]
        left = total_of(layout, add_joined(layout, factored, sums, station, towards_end, inward))
        return divided(layout, factored, station, left)
    numbers = factors_of(layout, factored, station)
    sums = add_whole(layout, sums_from(layout, zero(layout)), numbers, np.uint64(0), left)
    return total_of(layout, add_whole(layout, sums, numbers, whole_size(layout), inward))


@by_make_up
def substitute_into(layout, places, station, factored, inward, answer):
    """``solved`` in lanes of a whole cross-section, left in ``answer``, too."""
    own = solved(layout, factored, station, inward, answer)
    store(layout, answer, start_of(layout, places, station), own)
    return widened(layout, own)


@compiled
def solve(factored, right, answer):
    """Fill ``answer`` from ``right``, for all stations; see ``Factored``."""
    n, middle, layout = factored.kinds.size, factored.ends[4], factored.layout
    known, given, found = pointed((factored, right, answer))
    places, pairs = known.places, min(middle, n - 1 - middle)
    x, y = zero(layout), zero(layout)
    for i in range(pairs):
        j = n - 1 - i
        x = eliminate_right(layout, places, i, known, given, False, x, found)
        y = eliminate_right(layout, places, j, known, given, True, y, found)
    for i in range(pairs, middle + 1):
        x = eliminate_right(layout, places, i, known, given, False, x, found)
    for j in range(n - 1 - pairs, middle, -1):
        y = eliminate_right(layout, places, j, known, given, True, y, found)
    x = y = meet(layout, places, middle, known, y, found)
    for k in range(1, pairs + 1):
        x = substitute_into(layout, places, middle - k, known, x, found)
        y = substitute_into(layout, places, middle + k, known, y, found)
    for i in range(middle - pairs - 1, -1, -1):
        x = substitute_into(layout, places, i, known, x, found)
    for j in range(middle + pairs + 1, n):
        y = substitute_into(layout, places, j, known, y, found)
