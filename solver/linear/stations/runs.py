"""Runs of stations of one make-up, whose kernels are those of a line that has no other.

Most stations of a line have neighbours like themselves. In a run lanes are those of its make-up
alone, vectors are read at equal distances, and nothing is looked up. Two chains of stations go side
by side, each through runs of its own; where these differ, stations are looked up one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import overload

from catenary.solver.base.kernels.compiled import in_line, inner
from catenary.solver.linear.stations.lanes import (
    Lanes,
    LayoutType,
    inlined,
    lanes_narrowed,
    lanes_widened,
    pitch,
)
from catenary.solver.linear.stations.make_ups import Places, make_up_of, start_of
from catenary.solver.linear.stations.registers import Registers
from catenary.solver.linear.stations.station_layout import Layout

OPTIONS: Any = {"forceinline": True, "error_model": "numpy"}
# Stations of a run, at least: fewer take longer to be prepared than to be looked up.
_LEAST = 6


def starts_of(places: Places) -> np.ndarray:
    """(n_runs + 1,) First station of each run of one make-up, and how many stations there are."""
    changes = np.flatnonzero(np.diff(places.make_up)) + 1
    return np.concatenate([[0], changes, [places.make_up.size]]).astype(np.int64)


@inlined
def run_of(typing_context, layout, of_factors, number):
    """The layout of a run by its ``number`` in that of the factors, which is a constant; of
    products or of factors, whose ``layout`` is given."""
    if not isinstance(number, types.IntegerLiteral):
        return None
    make_up = of_factors.layout.runs[number.literal_value][0]

    def generate(context, builder, signature, arguments):
        return context.get_dummy_value()

    alone = layout.layout.parts[make_up].changed(make_ups=())
    return LayoutType(alone)(layout, of_factors, number), generate


@inlined
def run_number(typing_context, layout, make_up):
    """Number of the layout of the runs of a make-up."""

    def generate(context, builder, signature, arguments):
        found = ir.Constant(ir.IntType(64), 0)
        for number, make_ups in enumerate(signature.args[0].layout.runs):
            for own in make_ups:
                there = _is(builder, arguments[1], own)
                found = builder.select(there, ir.Constant(found.type, number), found)
        return found

    return types.int64(layout, make_up), generate


def _converted(convert: Any, registers_of: Any, summary: str) -> Any:
    """A function of lanes that depends on the make-up of a run."""

    def converted(typing_context, layout, number, make_up, x):
        if not isinstance(number, types.IntegerLiteral):
            return None
        make_ups = layout.layout.runs[number.literal_value]

        def generate(context, builder, signature, arguments):
            _, _, make_up, x = arguments
            parts = signature.args[0].layout.parts
            of_lanes = Registers(registers)
            found = convert(builder, parts[make_ups[0]], x)
            for own in make_ups[1:]:
                other = convert(builder, parts[own], x)
                chosen = _is(builder, make_up, own)
                found = of_lanes.each(
                    builder, lambda a, b, chosen=chosen: builder.select(chosen, a, b), other, found
                )
            return found

        registers = registers_of(layout.layout, layout.layout.parts[make_ups[0]])
        return Lanes(registers)(layout, number, make_up, x), generate

    converted.__doc__ = summary
    return inlined(converted)


into_run = _converted(
    lanes_narrowed,
    lambda layout, part: part.registers,
    "Lanes of a cross-section as those of the run of a ``number``, which is a constant.",
)
out_of_run = _converted(
    lanes_widened,
    lambda layout, part: layout.registers,
    "Lanes of the run of a ``number``, which is a constant, as those of a cross-section.",
)


def _is(builder: Any, number: Any, constant: int) -> Any:
    return builder.icmp_unsigned("==", number, ir.Constant(number.type, constant))


@inlined
def shifted(typing_context, place, by):
    """A place in memory so many entries further on."""

    def generate(context, builder, signature, arguments):
        return builder.gep(arguments[0], [arguments[1]])

    return place(place, types.int64), generate


@inner
def distance(layout, run, places, station):
    """By how much the unknowns of a run's ``station`` begin after where equal distances from the
    start of the line would have them."""
    return np.int64(start_of(layout, places, station)) - np.int64(pitch(run)) * np.int64(station)


@in_line
def next_run(layout, places, runs, i, j, n, inwards):
    """For how many pairs of stations, at most n, from i and j on chains go ``inwards``, or else
    outwards, through runs of one layout, and the number of that; -1 if they are looked up."""
    of_i, of_j = np.searchsorted(runs, i, side="right"), np.searchsorted(runs, j, side="right")
    number = run_number(layout, make_up_of(layout, places, i))
    alike = number == run_number(layout, make_up_of(layout, places, j))
    if inwards:
        # A row of a product reads both neighbours of its station.
        left = min(runs[of_i] - i, j - runs[of_j - 1] + 1, n)
        if alike and left > _LEAST:
            if i == runs[of_i - 1] or j == runs[of_j] - 1:
                return 1, -1
            return min(left, runs[of_i] - 1 - i, j - runs[of_j - 1]), number
        return left, -1
    left = min(i - runs[of_i - 1] + 1, runs[of_j] - j, n)
    return left, number if alike and left >= _LEAST else -1


def in_runs(kernel: Any, placed: Any, inwards: bool) -> Any:
    """The function ``kernel`` (layout, first, other, i, j, n, x, y) of two chains in runs.

    ``kernel`` takes n stations from i and as many from j on, ``inwards`` from both ends of the line
    or outwards from its middle. Of the station before them it has the lanes x and y, and returns
    those of the last ones. ``placed`` (layout, run, of_product, chain, station) makes of a chain
    one whose stations around ``station`` are all of ``run``. What is returned takes one chain for
    both, and the ``runs`` of its stations. It returns lanes, how many stations it has taken, and
    how many are to be looked up then.
    """

    def choose(layout, chain, runs, i, j, n, x, y):
        raise NotImplementedError("called in compiled code only")

    def implementation(layout, chain, runs, i, j, n, x, y):
        if not layout.layout.runs:
            return lambda layout, chain, runs, i, j, n, x, y: (x, y, 0, n)
        chosen = njit(**OPTIONS)(_chain(kernel, placed, layout.layout, 0))

        def by_runs(layout, chain, runs, i, j, n, x, y):
            count, number = next_run(layout, chain[1].places, runs, i, j, n, inwards)
            if number < 0:
                return x, y, 0, count
            x, y = chosen(layout, chain, number, i, j, count, x, y)
            return x, y, count, 0

        return by_runs

    overload(choose, jit_options=OPTIONS)(implementation)
    return choose


def _chain(kernel: Any, placed: Any, layout: Layout, number: int) -> Any:
    """A function that chooses among layouts of runs from ``number`` on."""
    if number == len(layout.runs):
        return lambda layout, chain, chosen, i, j, n, x, y: (x, y)
    further = njit(**OPTIONS)(_chain(kernel, placed, layout, number + 1))

    def choice(layout, chain, chosen, i, j, n, x, y):
        if chosen != number:
            return further(layout, chain, chosen, i, j, n, x, y)
        run, of_product = run_of(layout, layout, number), run_of(chain[0][0], layout, number)
        first = placed(layout, run, of_product, chain, i)
        other = placed(layout, run, of_product, chain, j)
        of_i, of_j = make_up_of(layout, chain[1].places, i), make_up_of(layout, chain[1].places, j)
        x, y = into_run(layout, number, of_i, x), into_run(layout, number, of_j, y)
        x, y = kernel(run, first, other, i, j, n, x, y)
        return out_of_run(layout, number, of_i, x), out_of_run(layout, number, of_j, y)

    return choice
