"""Block elimination of a line, station by station, from both ends to where the two meet."""

from __future__ import annotations

from catenary.solver.base.compiled import compiled, inner
from catenary.solver.base.inverse import invert

# Of blocks number by number: expressions of whole arrays take Numba ten times as long to compile.


@compiled
def factorise(blocks, middle, factors):
    """Fill ``factors`` (n, 3, b, b), by rows, of ``blocks`` (3, n, b, b); see ``StationFactors``
    and ``neighbours``."""
    n = blocks.shape[1]
    for i in range(middle):
        pivot = factors[i, 0]
        copy(blocks[1, i], pivot)
        if i > 0:
            condense(blocks[0, i], factors[i - 1, 1], pivot, factors[i, 2])
        invert(pivot)
        carry(pivot, blocks[2, i], factors[i, 1])
    for i in range(n - 1, middle, -1):
        pivot = factors[i, 0]
        copy(blocks[1, i], pivot)
        if i < n - 1:
            condense(blocks[2, i], factors[i + 1, 1], pivot, factors[i, 2])
        invert(pivot)
        carry(pivot, blocks[0, i], factors[i, 1])
    pivot = factors[middle, 0]
    copy(blocks[1, middle], pivot)
    if middle > 0:
        condense(blocks[0, middle], factors[middle - 1, 1], pivot, factors[middle, 2])
    if middle < n - 1:
        condense(blocks[2, middle], factors[middle + 1, 1], pivot, factors[middle, 1])
    invert(pivot)


@inner
def copy(block, pivot):
    """Fill ``pivot`` with a block."""
    for i in range(pivot.shape[0]):
        for j in range(pivot.shape[0]):
            pivot[i, j] = block[i, j]


@inner
def condense(block, carried, pivot, turned):
    """Add to ``pivot`` what elimination of a station beside it leaves there, the product of the
    ``block`` that joins both and of what the other has ``carried``, and keep that ``turned``."""
    for i in range(pivot.shape[0]):
        for j in range(pivot.shape[0]):
            turned[i, j] = carried[j, i]
            total = 0.0
            for k in range(pivot.shape[0]):
                total += block[i, k] * carried[k, j]
            pivot[i, j] += total


@inner
def carry(inverse, block, carried):
    """Fill ``carried`` with what a station's unknowns are for those beyond: minus the product."""
    for i in range(inverse.shape[0]):
        for j in range(inverse.shape[0]):
            total = 0.0
            for k in range(inverse.shape[0]):
                total += inverse[i, k] * block[k, j]
            carried[i, j] = -total
