"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. What elimination carries from span to span is forgotten within the reach of
A^-1, so that the factors of alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from catenary.solver.base.bound import bound
from catenary.solver.base.petsc import PETSc
from catenary.solver.linear.factors.elimination import factorise
from catenary.solver.linear.factors.meeting_station import (
    MIDDLES,
    Turning,
    edges,
    factors_of_all_middles,
    turn,
)
from catenary.solver.linear.factors.substitution import solve
from catenary.solver.linear.sections import Sections, neighbours
from catenary.solver.linear.station_layout import Layout
from catenary.solver.linear.station_products import kinds_by_make_up

# Bytes of factors from which on they share blocks: more would leave no room for the state in a
# cache next to a processor, of 1 to 2 MB; a product with a transpose waits some longer.
LARGE = 2**19


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
        factors = factors_of_all_middles(blocks)
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
        kinds[:n].copy(), kinds[n : 2 * n].copy(), kinds[2 * n :].copy(), *edges(blocks, factors)
    )
    return StationFactors(
        layout, stations, turning.to_end.copy(), numbers, low, high, n_kinds, turning
    )
