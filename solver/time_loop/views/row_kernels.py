"""What compiled loops do with rows and motions that steps have shown. Not collective."""

from __future__ import annotations

from catenary.solver.base.kernels.compiled import compiled


@compiled
def take_extremes(rows, first, begin, end, kept):
    """Let ``kept`` (2, n), smallest and largest, take in columns from ``begin`` to ``end`` of a
    channel, whose first one is ``first`` of the rows (m, k)."""
    smallest, largest = kept[0, begin:end], kept[1, begin:end]
    for i in range(rows.shape[0]):
        row = rows[i, first + begin : first + end]
        # Counted from zero and written at any rate, so that it becomes a loop of vector
        # instructions.
        for j in range(row.size):
            value, low, high = row[j], smallest[j], largest[j]
            smallest[j] = value if value < low else low
            largest[j] = value if value > high else high


@compiled
def take_points(rows, columns, first, count, result, component):
    """Fill in one component of ``result`` (m, components): points of rows, one row after another.

    A row (k,) of ``rows`` has ``count`` points from number ``first`` on, which take the numbers at
    ``columns`` of these, or zero where a column is below zero.
    """
    at = 0
    for i in range(first.size):
        row, own = rows[i], columns[first[i] : first[i] + count[i]]
        for j in range(own.size):
            column = own[j]
            result[at, component] = row[column] if column >= 0 else 0.0
            at += 1
