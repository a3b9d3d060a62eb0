"""Block elimination of a line, station by station, each kind of factor worked out once.

What elimination carries from span to span is forgotten within the reach of A^-1. Where spans are
alike the factor of a station and the kind of the next one are then a pair that was there before,
and the next factor is known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import compiled, inner
from catenary.solver.base.kernels.inverse import invert

# Of blocks number by number: expressions of whole arrays take Numba ten times as long to compile.
# Factors that there is room for at first.
_ROOM = 1024


class Eliminated(NamedTuple):
    """Stations after elimination from one end.

    Attributes
    ----------
    factors : (m, 3, b, b) S^-1, -S^-1 B and the transpose of the second of the station before, of
        each factor; S is the diagonal block after elimination, B joins it to the next station
    kinds : (m,) kind of station that each factor is of
    numbers : (n,) int32, the factor of each station
    """

    factors: np.ndarray
    kinds: np.ndarray
    numbers: np.ndarray


def eliminate_stations(kinds: np.ndarray, blocks: np.ndarray, from_end: bool) -> Eliminated:
    """Stations eliminated one after the other, from the start of the line or ``from_end``.

    ``kinds`` (n,) int32 of stations, ``blocks`` (3, k, b, b) of these; see ``StationRows``.
    """
    n, n_kinds, size = kinds.size, blocks.shape[1], blocks.shape[2]
    numbers, entries = np.zeros(n, dtype=np.int32), np.zeros((3, n), dtype=np.int32)
    first_alike = np.full(n_kinds, -1, dtype=np.int32)
    room = min(n, _ROOM)
    factors, links = np.zeros((room, 3, size, size)), np.zeros((3, room + 1), dtype=np.int32)
    links[2] = -1
    state = np.array([n - 1 if from_end else 0, 0, 0, -1], dtype=np.int64)
    before, onward, step = (2, 0, -1) if from_end else (0, 2, 1)
    while True:
        factorise(
            *(kinds, blocks, before, onward, step),
            *(numbers, factors, links, first_alike, entries, state),
        )
        if not 0 <= state[0] < n:
            break
        more = min(n, 2 * room) - room
        factors = np.concatenate([factors, np.zeros((more, 3, size, size))])
        links = np.concatenate([links, np.full((3, more), -1, dtype=np.int32)], axis=1)
        room += more
    count = int(state[1])
    return Eliminated(factors[:count].copy(), links[0, :count].copy(), numbers)


@compiled
def factorise(
    kinds,
    blocks,
    before,
    onward,
    step,
    numbers,
    factors,
    links,
    first_alike,
    entries,
    state,
):
    """Eliminate stations until all are done or there is no room for a factor.

    ``links`` (3, room + 1) are the kind of each factor, the one of that kind found before, and, for
    what follows a factor, from number 1 on, its first entry; ``entries`` (3, n) hold a kind, the
    factor of a station of that kind there, and the next entry; ``first_alike`` (k,) is the latest
    factor of each kind; ``state`` holds the station, counts of factors and entries, and the factor
    of the station before.
    """
    i, count, n_entries, last = state[0], state[1], state[2], state[3]
    while 0 <= i < kinds.size:
        kind = kinds[i]
        entry = links[2, last + 1]
        while entry >= 0 and entries[0, entry] != kind:
            entry = entries[2, entry]
        if entry >= 0:
            found = entries[1, entry]
        else:
            if count == factors.shape[0]:
                break
            pivot = factors[count, 0]
            copy(blocks[1, kind], pivot)
            if last >= 0:
                condense(blocks[before, kind], factors[last, 1], pivot, factors[count, 2])
            invert(pivot)
            carry(pivot, blocks[onward, kind], factors[count, 1])
            found = first_alike[kind]
            while found >= 0 and not same(factors, found, count, last >= 0):
                found = links[1, found]
            if found < 0:
                found = count
                links[0, count], links[1, count] = kind, first_alike[kind]
                first_alike[kind] = count
                count += 1
            entries[0, n_entries], entries[1, n_entries] = kind, found
            entries[2, n_entries] = links[2, last + 1]
            links[2, last + 1] = n_entries
            n_entries += 1
        numbers[i] = found
        last = found
        i += step
    state[0], state[1], state[2], state[3] = i, count, n_entries, last


@compiled
def join(triples, blocks, before, behind, factors):
    """Fill ``factors`` (m, 3, b, b) of stations where elimination from both ends meets.

    ``triples`` (m, 3) are the kind of each, and the factors of the stations before and after it
    among those ``before`` and ``behind``, -1 if there is none.
    """
    for i in range(triples.shape[0]):
        kind, first, last = triples[i]
        pivot = factors[i, 0]
        copy(blocks[1, kind], pivot)
        if first >= 0:
            condense(blocks[0, kind], before[first, 1], pivot, factors[i, 2])
        if last >= 0:
            condense(blocks[2, kind], behind[last, 1], pivot, factors[i, 1])
        invert(pivot)


@inner
def same(factors, one, other, joined):
    """Whether two factors are the same, bit for bit; ``joined`` if there is a station before."""
    for part in range(3 if joined else 2):
        for i in range(factors.shape[2]):
            for j in range(factors.shape[3]):
                if factors[one, part, i, j] != factors[other, part, i, j]:
                    return False
    return True


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
