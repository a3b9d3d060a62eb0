"""What compiled loops do with rows that steps have shown. Not collective."""

from __future__ import annotations

from catenary.solver.base.compiled import compiled


@compiled
def take_extremes(rows, first, begin, end, kept):
    """Let ``kept`` (2, n), smallest and largest, take in columns from ``begin`` to ``end`` of a
    channel, whose first one is ``first`` of the rows (m, k)."""
    for i in range(rows.shape[0]):
        for j in range(begin, end):
            value = rows[i, first + j]
            kept[0, j] = min(kept[0, j], value)
            kept[1, j] = max(kept[1, j], value)
