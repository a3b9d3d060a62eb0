"""Motions of the line in several tangents, whose numbers stand side by side in lanes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import PredictedLineState
from catenary.solver.kernels import native
from catenary.solver.tangents.changed_rows import changed_rows
from catenary.solver.tangents.set_up import Change


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
            changed_rows(group, size, n, shares),
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
