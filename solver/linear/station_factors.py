"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. What elimination carries from span to span is forgotten within the reach of
A^-1, so that the factors of alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from catenary.solver.base.bound import bound
from catenary.solver.base.compiled import compiled, inner
from catenary.solver.base.petsc import PETSc
from catenary.solver.base.pointers import borrowed
from catenary.solver.linear.lane_products import (
    add_transposed,
    add_whole,
    numbers_from,
    sums_from,
    total_of,
)
from catenary.solver.linear.lanes import (
    load,
    narrowed,
    shares,
    store,
    whole_size,
    widened,
    zero,
)
from catenary.solver.linear.make_ups import block_at, by_make_up, make_up_of, start_of
from catenary.solver.linear.sections import Sections, neighbours
from catenary.solver.linear.station_layout import Layout
from catenary.solver.linear.station_products import kinds_by_make_up

# Bytes of factors from which on they share blocks: more would leave no room for the state in a
# cache next to a processor, of 1 to 2 MB; a product with a transpose waits some longer.
LARGE = 2**19
# Where elimination may end at several places, it may at every so many stations.
MIDDLES = 16
# Sum of the eigenvalues of S^-1 A - 1 where steps of a part of the line may end.
_SOFTENED = 1.0


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    layout : Layout
    starts : (n + 1,) first unknown of each station, and how many unknowns there are
    places, kinds : of the stations, see ``kinds_by_make_up``
    blocks : of each kind S^-1, -S^-1 B with its block B towards the middle, and, unless the
        layout shares these, the transpose of the second of the station before it in elimination,
        which that multiplies with; packed by the layout. S is a diagonal block after elimination.
        In the middle the second is for elimination from the other end
    low : first station of a rank's own
    ends : (5,) int, read at each step: first station that a step solves for and the one after the
        last, first own one that it takes on and the one after the last, and where elimination ends
    turning : what may move the place where elimination ends, None if it stays
    n_stations, n_kinds : in the matrix, and how many have different factors
    """

    def __init__(
        self,
        layout: Layout,
        stations: Sections,
        kinds: np.ndarray,
        blocks: np.ndarray,
        low: int,
        high: int,
        n_kinds: int,
        turning: Turning | None = None,
    ) -> None:
        self.layout, self.kinds, self.blocks = layout, kinds, blocks
        self.starts, self.places = stations.starts, stations.places()
        self.low, self.turning = low, turning
        self.n_stations, self.n_kinds = kinds.size, n_kinds
        middle = (low + high) // 2 if turning is None else turning.place(low, high)
        self.ends = np.array([0, kinds.size, low, high, middle], dtype=np.int64)
        if turning is not None:
            turn(kinds, turning.arrays, kinds.size - 1, middle)
        vectors = np.zeros(0), np.zeros(0)
        self._solve = bound(solve, self.factored, later=vectors)

    @property
    def factored(self) -> tuple[Any, ...]:
        """What kernels read of them."""
        return self.layout, self.places, self.kinds, self.blocks, self.low, self.ends

    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Make ``answer`` that to ``right``, of all unknowns, perhaps the same array."""
        self._solve(right, answer)

    def apply(self, pc: PETSc.PC, right: PETSc.Vec, answer: PETSc.Vec) -> None:
        """Called by PETSc."""
        self.solve(right.getArray(readonly=True).copy(), answer.getArray())

    def view(self, pc: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Called by PETSc for -march_ksp_view."""
        viewer.printfASCII(
            f"    exact factors of {self.n_stations} stations, of {self.n_kinds} kinds, from both "
            "ends to the middle\n"
        )


def station_factors(
    matrix: sparse.bsr_matrix,
    layout: Layout,
    low: int = 0,
    high: int | None = None,
    stations: Sections | None = None,
    turns: bool = False,
) -> StationFactors | None:
    """Factors of a positive definite matrix in sorted blocks, eliminated towards the middle of the
    stations from ``low`` to ``high``, all by default. ``stations`` may be of several make-ups. The
    middle may be moved if it ``turns``.

    None if it is not block tridiagonal by stations, or if a station is joined to unknowns of one
    beside it that it lacks itself. A matrix that is not positive definite gives
    wrong answers or NaN.
    """
    blocks = neighbours(matrix, 0, stations)
    if blocks is None:
        return None
    n = blocks.shape[1]
    high = n if high is None else high
    stations = Sections.alike(n, layout.pitch) if stations is None else stations
    # Factors join all of a plane, whatever matrices join: the same kernels serve them all.
    layout = Layout(layout.widths, make_ups=layout.make_ups)
    station, lacking = np.nonzero(stations.missing())
    blocks[1, station, lacking, lacking] = 1.0
    if turns:
        factors = _factors_of_all_middles(blocks)
        meeting = np.arange(0, n, MIDDLES)
        make_up = np.concatenate([stations.make_up, stations.make_up, stations.make_up[meeting]])
    else:
        factors, make_up = np.zeros((n, 3, layout.pitch, layout.pitch)), stations.make_up
        factorise(blocks, (low + high) // 2, factors)

    def pack(part: Layout, rows: slice | np.ndarray) -> np.ndarray:
        n_blocks = 2 if part.shares else 3
        packed = part.packed(factors[rows, :n_blocks], part.whole_terms)
        return packed.reshape(packed.shape[0], n_blocks * part.whole_terms.sources.size)

    kinds, numbers, n_kinds, count = kinds_by_make_up(layout, make_up, pack)
    if layout.varies:
        lacks = stations.missing().sum(axis=1)
        lacks = np.r_[lacks, lacks, lacks[::MIDDLES]] if turns else lacks
        if count != np.count_nonzero(factors) - lacks.sum():
            return None  # elimination joins what a station lacks
    sharing = layout.changed(shares=True)
    if numbers.nbytes > LARGE and sharing.shares and not layout.varies:
        layout = sharing
        kinds, numbers, n_kinds, _ = kinds_by_make_up(layout, make_up, pack)
    if not turns:
        return StationFactors(layout, stations, kinds, numbers, low, high, n_kinds)
    turning = Turning(
        kinds[:n].copy(), kinds[n : 2 * n].copy(), kinds[2 * n :].copy(), *_edges(blocks, factors)
    )
    return StationFactors(
        layout, stations, turning.to_end.copy(), numbers, low, high, n_kinds, turning
    )


class Turning(NamedTuple):
    """Kinds of stations by where elimination ends: ``to_end`` (n,) where that is further on,
    ``to_start`` (n,) where it is before, ``here`` (m,) for each station at which it may end, one of
    ``MIDDLES``. Steps may be taken of a part of the stations: from those in ``begins`` (n + 1,) to
    before those in ``ends`` (n + 1,), which are the next ones outwards of each; see ``_edges``."""

    to_end: np.ndarray
    to_start: np.ndarray
    here: np.ndarray
    begins: np.ndarray
    ends: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What ``turn`` reads."""
        return self.to_end, self.to_start, self.here

    def place(self, low: int, high: int) -> int:
        """A station where it may end, near the middle from ``low`` to ``high``."""
        return int(middle_of(low, high))


@compiled
def middle_of(low, high):
    """A station where elimination may end, near the middle from ``low`` to ``high``."""
    return (low + high) // 2 // MIDDLES * MIDDLES


@compiled
def turn(kinds, turning, before, middle):
    """Let elimination end at ``middle`` in place of ``before``."""
    to_end, to_start, here = turning
    for i in range(before, middle):
        kinds[i] = to_end[i]
    for i in range(middle + 1, before + 1):
        kinds[i] = to_start[i]
    kinds[middle] = here[middle // MIDDLES]


def _factors_of_all_middles(blocks: np.ndarray) -> np.ndarray:
    """Factors of all stations before the middle, of all behind it, and of those where it may be."""
    n, size = blocks.shape[1], blocks.shape[2]
    n_middles = len(range(0, n, MIDDLES))
    factors = np.zeros((2 * n + n_middles, 3, size, size))
    factorise(blocks, n - 1, factors[:n])
    factorise(blocks, 0, factors[n : 2 * n])
    join(blocks, factors[:n], factors[n : 2 * n], factors[2 * n :])
    return factors


def _edges(blocks: np.ndarray, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where steps of a part of the line may begin and end, from each station outwards, (n + 1,).

    What is beyond is held, but the factors let it give way by its mass and stiffness D. That leaves
    M + tau C - D in place of M + tau C there, which must not become negative: it does where
    elements are so short that the step operator A is mostly stiffness. D is what A has more than
    the block S after elimination; all eigenvalues of S^-1 A are to be below 2.
    """
    n = blocks.shape[1]
    number = np.arange(n + 1)
    softened = [
        np.einsum("nij,nji->n", part[:, 0], blocks[1]) - blocks.shape[2] < _SOFTENED
        for part in (factors[:n], factors[n : 2 * n])
    ]
    can_begin, can_end = np.append(softened[0], True), np.append(True, softened[1])
    can_begin[0] = can_end[n] = True
    begins = np.maximum.accumulate(np.where(can_begin, number, 0))
    ends = np.minimum.accumulate(np.where(can_end, number, n)[::-1])[::-1]
    return begins, ends


@compiled
def join(blocks, before, behind, here):
    """Fill in the factors of stations where elimination may end from those to both sides."""
    for number in range(here.shape[0]):
        i = number * MIDDLES
        pivot = blocks[1, i].copy()
        if i > 0:
            here[number, 2] = before[i - 1, 1].T
            pivot += blocks[0, i] @ before[i - 1, 1]
        if i < blocks.shape[1] - 1:
            here[number, 1] = behind[i + 1, 1].T
            pivot += blocks[2, i] @ behind[i + 1, 1]
        invert(pivot, here[number, 0])


# Of blocks number by number: expressions of whole arrays take Numba ten times as long to compile.


@compiled
def factorise(blocks, middle, factors):
    """Fill ``factors`` (n, 3, b, b), by rows, of ``blocks`` (3, n, b, b); see ``StationFactors``
    and ``neighbours``."""
    n, size = blocks.shape[1], blocks.shape[2]
    pivot = np.empty((size, size))
    for i in range(middle):
        copy(blocks[1, i], pivot)
        if i > 0:
            condense(blocks[0, i], factors[i - 1, 1], pivot, factors[i, 2])
        invert(pivot, factors[i, 0])
        carry(factors[i, 0], blocks[2, i], factors[i, 1])
    for i in range(n - 1, middle, -1):
        copy(blocks[1, i], pivot)
        if i < n - 1:
            condense(blocks[2, i], factors[i + 1, 1], pivot, factors[i, 2])
        invert(pivot, factors[i, 0])
        carry(factors[i, 0], blocks[0, i], factors[i, 1])
    copy(blocks[1, middle], pivot)
    if middle > 0:
        condense(blocks[0, middle], factors[middle - 1, 1], pivot, factors[middle, 2])
    if middle < n - 1:
        condense(blocks[2, middle], factors[middle + 1, 1], pivot, factors[middle, 1])
    invert(pivot, factors[middle, 0])


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


@inner
def invert(pivot, inverse):
    """Fill in the inverse of a positive definite block, which is overwritten."""
    size = pivot.shape[0]
    for i in range(size):
        for j in range(size):
            inverse[i, j] = 1.0 if i == j else 0.0
    # A positive definite block needs no exchange of rows.
    for i in range(size):
        scale = 1.0 / pivot[i, i]
        for k in range(size):
            pivot[i, k] *= scale
            inverse[i, k] *= scale
        for j in range(size):
            if j != i:
                share = pivot[j, i]
                for k in range(size):
                    pivot[j, k] -= share * pivot[i, k]
                    inverse[j, k] -= share * inverse[i, k]


@inner
def factors_of(part, factored, station):
    """Where the blocks of a station are; ``part`` is the layout of its make-up."""
    _, _, kinds, blocks, _, _ = factored
    n_blocks = np.uint64(2) if shares(part) else np.uint64(3)
    return numbers_from(blocks, block_at(part, kinds, station, n_blocks * whole_size(part)))


@inner
def first_of(factored, station):
    """First unknown of a station."""
    return start_of(factored[0], factored[1], station)


@inner
def make_up_at(factored, station):
    """Make-up of a station."""
    return make_up_of(factored[0], factored[1], station)


@inner
def eliminate(part, factored, sums, station, before, outward, answer):
    """Leave in ``answer`` what the right-hand side of a station, as ``sums``, is after those
    ``outward`` of it are eliminated, of which ``before`` is the last; ``part`` is the layout of its
    make-up."""
    outward = narrowed(part, outward)
    if shares(part):
        numbers, total = factors_of(part, factored, before), total_of(part, sums)
        left = add_transposed(part, total, numbers, whole_size(part), outward)
    else:
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
    return eliminate_in(factored[0], make_up, factored, right, station, before, outward, answer)


@inner
def _meet(part, factored, middle, towards_end, answer):
    here, kinds = first_of(factored, middle), factored[2]
    numbers, left = factors_of(part, factored, middle), load(part, answer, here)
    towards_end = narrowed(part, towards_end)
    if shares(part):
        beyond = factors_of(part, factored, min(middle + 1, kinds.size - 1))
        left = add_transposed(part, left, beyond, whole_size(part), towards_end)
    else:
        sums = sums_from(part, left)
        left = total_of(part, add_whole(part, sums, numbers, whole_size(part), towards_end))
    sums = sums_from(part, zero(part))
    own = total_of(part, add_whole(part, sums, numbers, np.uint64(0), left))
    store(part, answer, here, own)
    return widened(part, own)


meet_in = by_make_up(_meet)


@inner
def meet(factored, middle, towards_end, answer):
    """Unknowns of the middle station from what ``answer`` holds of it and what is left of the one
    beside it, ``towards_end`` of the line."""
    make_up = make_up_at(factored, middle)
    return meet_in(factored[0], make_up, factored, middle, towards_end, answer)


@inner
def solved(part, factored, station, inward, answer):
    """Unknowns of a station, in lanes of ``part``, from what ``answer`` holds of it and those
    ``inward`` of it."""
    numbers = factors_of(part, factored, station)
    left = load(part, answer, first_of(factored, station))
    sums = add_whole(part, sums_from(part, zero(part)), numbers, np.uint64(0), left)
    inward = narrowed(part, inward)
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
    return substitute_in(factored[0], make_up, factored, station, inward, answer)


@compiled
def solve(factored, right, answer):
    """Fill ``answer`` from ``right``, for all stations; ``factored`` are layout, places, kinds,
    blocks, low and ends of ``StationFactors``."""
    factored, right, answer = borrowed((factored, right, answer))
    layout, _, kinds, _, _, ends = factored
    n, middle = kinds.size, ends[4]
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
