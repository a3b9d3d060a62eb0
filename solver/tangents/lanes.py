"""Motions of the line in several tangents, whose numbers stand side by side in lanes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import PredictedLineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.model.alike import kinds_of
from catenary.solver.tangents.set_up import Change

# Numbers of matrices are kept to so many bits, far more than differences of set-ups know: rows of
# equal elements are equal then.
_BITS = 40
# Pairs of rows that are taken at a time, so that their sums stay near the processor.
_PAIRS_AT_A_TIME = 64
_NO_NUMBERS = np.zeros(0, dtype=np.int64)


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
) -> list[native.TangentLanes]:
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
    return [
        _lanes(
            line,
            own,
            size,
            any(change.loads_line for change in group),
            _rows(group, size, n, shares),
        )
        for group, own, size in zip(groups, starts, sizes, strict=True)
    ]


def _sizes(line: LineIntegrator) -> list[int]:
    """Numbers of motions that kernels step at once, ascending."""
    assert line.passes is not None
    return [1, *line.passes.scenes_at_once]


def _lanes(
    line: LineIntegrator,
    starts: Sequence[np.ndarray],
    n_lanes: int,
    is_loaded: bool,
    rows: native.ChangedRows,
) -> native.TangentLanes:
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
    return native.TangentLanes(stepped, arrays.motion, arrays.loads, rows)


def _rows(
    changes: Sequence[Change], n_lanes: int, n: int, shares: np.ndarray
) -> native.ChangedRows:
    """Changes of matrices over all lanes, with a kind for pairs of rows that are equal.

    The largest matrix of each lane is multiplied with the first sums, its next with the second
    ones. ``shares`` are those of the march's motion.
    """
    # Displacement, velocity and acceleration in terms of x, y and z.
    of_motion = np.array([shares[:3], [0.0, *shares[3:]], [0.0, 0.0, 1.0]])
    terms = [
        (lane, place, term)
        for lane, change in enumerate(changes)
        for place, term in enumerate(sorted(change.matrices, key=lambda term: -term.values.size))
    ]
    n_terms = 1 + max((place for _, place, _ in terms), default=0)
    weights = np.zeros((n_terms, 3, n_lanes))
    rows, columns, lanes, places, values = ([_NO_NUMBERS] for _ in range(5))
    for lane, place, term in terms:
        weights[place, :, lane] = term.weights @ of_motion
        rows.append(np.repeat(term.rows, np.diff(term.begin)))
        columns.append(term.columns)
        lanes.append(np.full(term.values.size, lane))
        places.append(np.full(term.values.size, place))
        values.append(_rounded(term.values))
    row = np.concatenate(rows)
    # Each entry of a pair of rows once for all lanes, by pairs.
    number = (row // 2 * n_terms + np.concatenate(places)) * n + np.concatenate(columns)
    entries, entry = np.unique(number, return_inverse=True)
    numbers = np.zeros((entries.size, 2, n_lanes))
    numbers[entry, row % 2, np.concatenate(lanes)] = np.concatenate(values)
    part, column = np.divmod(entries, n)
    pair, at = np.divmod(part, n_terms)
    ahead = column - 2 * pair
    reach = int(np.abs(ahead).max(initial=0))
    room = 2 * (_PAIRS_AT_A_TIME + reach)
    offsets = (at * room + ahead).astype(np.int32)
    ends = np.searchsorted(pair, np.arange((n + 1) // 2 + 1))
    counts = np.diff(ends)
    of_pairs = np.full((counts.size, counts.max()), -1.0)
    of_entries = np.c_[offsets, numbers.reshape(-1, 2 * n_lanes)]
    of_pairs[pair, np.arange(pair.size) - ends[pair]] = kinds_of(of_entries)[1]
    first, kinds = kinds_of(of_pairs)
    which = np.isin(pair, first)
    return native.ChangedRows(
        weights.reshape(-1, 3 * n_lanes),
        kinds,
        begin=np.cumsum([0, *counts[first]], dtype=np.int64),
        offsets=offsets[which],
        values=aligned_arrays.copy(numbers[which]).reshape(-1, 2 * n_lanes),
        reach=reach,
        room=room,
        sums=aligned_arrays.zeros(n_terms * room * n_lanes, 4),
    )


def _rounded(values: np.ndarray) -> np.ndarray:
    """Numbers with ``_BITS`` bits."""
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(mantissa, _BITS)), exponent - _BITS)
