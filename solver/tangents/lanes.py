"""Motions of the line in several tangents, whose numbers stand side by side in lanes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import Motion, PredictedLineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.model.alike import kinds_of
from catenary.solver.tangents.set_up import Change

# Numbers of matrices are kept to so many bits, far more than differences of set-ups know: rows of
# equal elements are equal then.
_BITS = 40
_NO_NUMBERS = np.zeros(0, dtype=np.int64)


class LaneSums(NamedTuple):
    """Sums of the march's x, y and z with weights of the lanes; see
    `kernels/tangents/tangent_lanes.hpp`, as for the next two."""

    weights: np.ndarray
    begin: np.ndarray
    unknowns: np.ndarray
    numbers: np.ndarray


class ChangedRows(NamedTuple):
    """Changes of matrices by pairs of rows."""

    sums: LaneSums
    kinds: np.ndarray
    begin: np.ndarray
    offsets: np.ndarray
    values: np.ndarray
    reach: int


class TangentLanes(NamedTuple):
    """Motions of the line in lanes, and what steps them."""

    passes: native.LanePasses
    motion: Motion
    loads: np.ndarray
    rows: ChangedRows


def groups_of(line: LineIntegrator, changes: Sequence[Change]) -> list[list[int]]:
    """Groups of changes, by number, whose motions are stepped side by side.

    One group takes as many as kernels step at once. If there are more, changes that load the line
    have groups apart from the others, sorted by the rows that they load: a group computes a product
    for all its members if one needs it. Without kernels for several scenes each change is a group.
    """
    most = _sizes(line)[-1]
    if len(changes) <= most:
        return [list(range(len(changes)))] if changes else []
    rows = {
        k: {int(row) for term in change.matrices for row in term.rows}
        for k, change in enumerate(changes)
        if change.loads_line
    }
    without = [k for k in range(len(changes)) if k not in rows]
    # From the change with most rows on, each is followed by the one with the most similar rows.
    loaded, latest = [], set().union(*rows.values())
    while rows:
        loaded.append(min(rows, key=lambda k: len(rows[k] ^ latest)))
        latest = rows.pop(loaded[-1])
    return [
        part[first : first + most]
        for part in (without, loaded)
        for first in range(0, len(part), most)
    ]


def lanes_of(
    line: LineIntegrator, groups: Sequence[Sequence[Change]], starts: Sequence[Sequence[np.ndarray]]
) -> list[TangentLanes]:
    """Motions of groups of tangents at their start. One rank, Newmark's method in two passes.

    Parameters
    ----------
    line : LineIntegrator
        Line of a march.
    groups : sequence of sequence of Change
        Changes of set-ups by the parameters of each group.
    starts : sequence of sequence of array (n_local,)
        Derivatives of the line's acceleration at the start [m/s2 per unit] of each of these.
    """
    n = line.acceleration.size
    widths = _sizes(line)
    sizes = [next(size for size in widths if size >= len(group)) for group in groups]
    assert line.passes is not None
    shares = line.passes.parts.arrays.motion.shares
    rows = [_rows(group, size, n, shares) for group, size in zip(groups, sizes, strict=True)]
    # Groups step one after the other, so that they share room that they fill anew.
    sums = max((of.sums.numbers for of in rows), key=len, default=np.zeros(0))
    return [
        _lanes(
            line,
            own,
            size,
            any(change.loads_line for change in group),
            of._replace(sums=of.sums._replace(numbers=sums)),
        )
        for group, own, size, of in zip(groups, starts, sizes, rows, strict=True)
    ]


def _sizes(line: LineIntegrator) -> list[int]:
    """Numbers of motions that kernels step at once, ascending."""
    passes = line.passes
    assert passes is not None
    return [1] + [
        size
        for size in (native.SCENES, native.MOST_SCENES)
        if all(
            native.are_compiled_for_scenes(rows, factors, size)
            for rows, factors in passes.parts.layouts
        )
    ]


def _lanes(
    line: LineIntegrator,
    starts: Sequence[np.ndarray],
    n_lanes: int,
    is_loaded: bool,
    rows: ChangedRows,
) -> TangentLanes:
    """Motions that start with these accelerations."""
    passes, state = line.passes, line.motion
    assert passes is not None and isinstance(state, PredictedLineState)
    arrays = passes.arrays_in_lanes(n_lanes, is_loaded)
    for lane, start in enumerate(starts):
        still = np.zeros_like(start)
        ahead = state.ahead(still, still, start)
        for numbers, values in zip(arrays.motion[:3], ahead, strict=True):
            numbers[lane::n_lanes] = values
    parts = passes.parts._replace(arrays=arrays)
    # Loads in time move the line everywhere, and at once.
    waits = not passes.parts.arrays.loads.size and not any(start.any() for start in starts)
    guard = line.windows.n_stations if waits else 0
    stepped = native.LanePasses(parts, guard)
    return TangentLanes(stepped, arrays.motion, arrays.loads, rows)


def _rows(changes: Sequence[Change], n_lanes: int, n: int, shares: np.ndarray) -> ChangedRows:
    """Changes of matrices over all lanes, with a kind for pairs of rows that are equal.

    The largest term of each lane is multiplied with sums at all n unknowns. Others, which have few
    rows mostly, read their sums behind these. ``shares`` are those of the march's motion.
    """
    # Displacement, velocity and acceleration in terms of x, y and z.
    of_motion = np.array([shares[:3], [0.0, *shares[3:]], [0.0, 0.0, 1.0]])
    terms = [sorted(change.matrices, key=lambda term: -term.values.size) for change in changes]
    most = max(map(len, terms))
    weights, unknowns = np.zeros((max(1, most), 3, n_lanes)), [_NO_NUMBERS]
    rows, places, lanes, values = [_NO_NUMBERS], [_NO_NUMBERS], [_NO_NUMBERS], [np.zeros(0)]
    for rank in range(most):
        own = [(lane, of_lane[rank]) for lane, of_lane in enumerate(terms) if rank < len(of_lane)]
        read, behind = np.arange(n), 0
        if rank:
            read = np.unique(np.concatenate([term.columns for _, term in own]))
            behind = n + sum(map(len, unknowns))
            unknowns.append(read)
        for lane, term in own:
            weights[rank, :, lane] = term.weights @ of_motion
            rows.append(np.repeat(term.rows, np.diff(term.begin)))
            places.append(behind + np.searchsorted(read, term.columns))
            lanes.append(np.full(term.values.size, lane))
            values.append(_rounded(term.values))
    listed = np.concatenate(unknowns)
    row, width = np.concatenate(rows), n + listed.size
    entries, entry = np.unique(row // 2 * width + np.concatenate(places), return_inverse=True)
    numbers = np.zeros((entries.size, 2, n_lanes))
    numbers[entry, row % 2, np.concatenate(lanes)] = np.concatenate(values)
    pair, place = np.divmod(entries, width)
    offsets = (place - 2 * pair).astype(np.int32)
    ends = np.searchsorted(pair, np.arange((n + 1) // 2 + 1))
    counts = np.diff(ends)
    of_pairs = np.full((counts.size, counts.max()), -1.0)
    of_entries = np.c_[offsets, numbers.reshape(-1, 2 * n_lanes)]
    of_pairs[pair, np.arange(pair.size) - ends[pair]] = kinds_of(of_entries)[1]
    first, kinds = kinds_of(of_pairs)
    which = np.isin(pair, first)
    return ChangedRows(
        sums=LaneSums(
            weights.reshape(-1, 3 * n_lanes),
            np.cumsum([len(read) for read in unknowns], dtype=np.int64),
            listed,
            aligned_arrays.zeros(width * n_lanes, 4),
        ),
        kinds=kinds,
        begin=np.cumsum([0, *counts[first]], dtype=np.int64),
        offsets=offsets[which],
        values=aligned_arrays.copy(numbers[which]).reshape(-1, 2 * n_lanes),
        reach=int(np.abs(offsets[place < n]).max(initial=0)),
    )


def _rounded(values: np.ndarray) -> np.ndarray:
    """Numbers with ``_BITS`` bits."""
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(mantissa, _BITS)), exponent - _BITS)
