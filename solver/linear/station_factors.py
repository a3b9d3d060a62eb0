"""A line's step operator factored by stations, each kind of station stored once.

The operator is positive definite and block tridiagonal. It is eliminated from both ends towards its
middle: two chains, which a processor works on side by side, where in a single one each station
waits for the last. Factors are kept for every station at which the chains may meet. What
elimination carries from span to span is forgotten within the reach of A^-1, so that the factors of
alike spans are alike, and a solve reads little more than its vectors.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.base.petsc import PETSc
from catenary.solver.kernels import native
from catenary.solver.linear.station_products import Layout, kinds_by_type, of_pairs
from catenary.solver.linear.station_rows import Sections, StationRows
from catenary.solver.model.alike import numbered

# Distance in stations between the places at which elimination may end, if there are several.
MIDDLES = native.MIDDLES


class StationFactors:
    """Solves with a block tridiagonal matrix. Not collective. PETSc may use it as a PC.

    Attributes
    ----------
    layout : Layout
    stations : Sections
    turning : arrays by which the place where elimination ends moves, None if it stays
    arrays : ``native.FactorArrays``; its ``ends`` (5,) are read at each step: first station that a
        step solves for and the one after the last, first own one that it takes on and the one after
        the last, and where elimination ends

    Parameters
    ----------
    kinds : (n,) of the stations, see ``kinds_by_type``
    blocks : of each kind half of S^-1, with S the diagonal block after elimination, and, unless the
        layout is sparse, -B^T S^-1, with B the block towards the middle; packed by the layout
    besides : kinds of the matrix's own blocks between stations, and of each kind those to the
        stations before and after it, negative
    low, high : first station of a rank's own and the one after the last
    """

    def __init__(
        self,
        layout: Layout,
        stations: Sections,
        kinds: np.ndarray,
        blocks: np.ndarray,
        besides: tuple[np.ndarray, np.ndarray],
        low: int,
        high: int,
        turning: native.Turning | None = None,
    ) -> None:
        self.layout, self.stations, self.turning = layout, stations, turning
        middle = (low + high) // 2 if turning is None else native.middle_of(low, high)
        ends = np.array([0, kinds.size, low, high, middle], dtype=np.int64)
        if turning is not None:
            native.turn(kinds, turning, kinds.size - 1, middle)
        self.arrays = native.FactorArrays(kinds, blocks, *besides, low, ends, stations.places())

    @cached_property
    def _solves(self) -> native.Solves:
        layouts = [part.native for part in self.layout.parts]
        return native.Solves(layouts, self.stations.station_types, self.arrays)

    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Make ``answer`` that to ``right``, of all unknowns, perhaps the same array."""
        self._solves.solve(right, answer)

    def apply(self, pc: PETSc.PC, right: PETSc.Vec, answer: PETSc.Vec) -> None:
        """Called by PETSc."""
        self.solve(right.getArray(readonly=True).copy(), answer.getArray())

    def view(self, pc: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Called by PETSc for -march_ksp_view."""
        kinds = self.arrays.kinds
        viewer.printfASCII(
            f"    exact factors of {kinds.size} stations, of {np.unique(kinds).size} kinds, from "
            "both ends to the middle\n"
        )


def station_factors(
    rows: StationRows,
    layout: Layout,
    stations: Sections,
    low: int = 0,
    high: int | None = None,
    turns: bool = False,
) -> StationFactors | None:
    """Factors of a positive definite matrix, given by its rows by stations.

    It is eliminated towards the middle of the stations from ``low`` to ``high``, all by default.
    ``stations`` may be of several station types. The middle may be moved if it ``turns``.

    None if a station is joined to unknowns of one beside it that it lacks itself. A matrix that is
    not positive definite gives wrong answers or NaN.
    """
    n = rows.kinds.size
    high = n if high is None else high
    rows = completed(rows, stations)
    layout = layout_of_factors(layout, rows.blocks)
    besides = besides_of(layout, stations, rows)
    if besides is None:
        return None
    found = FoundFactors.of(rows, None if turns else (low + high) // 2)
    station_type = stations.station_type[rows.chosen][found.kinds]
    kinds, numbers = packed_factors(layout, station_type, found)
    of_station, turning = kinds[found.numbers], None
    if turns:
        turning = native.Turning(of_station[:n], of_station[n : 2 * n], of_station[2 * n :])
        of_station = of_station[:n].copy()
    return StationFactors(layout, stations, of_station, numbers, besides, low, high, turning)


def layout_of_factors(layout: Layout, blocks: np.ndarray) -> Layout:
    """The layout of the factors of a matrix with ``blocks`` (3, k, b, b), see ``neighbours``.

    ``layout`` is that of the line. S^-1 fills the block of each plane, whatever the matrix joins.
    """
    joined = (blocks[0] != 0).any(axis=0) | (blocks[2] != 0).any(axis=0)
    joined |= of_pairs(layout.pitch)
    return Layout(layout.widths, beside=joined, station_types=layout.station_types, factors=True)


def completed(rows: StationRows, stations: Sections) -> StationRows:
    """Rows with a unit diagonal for what ``stations`` lack."""
    lacks = stations.missing()[rows.chosen]
    if not lacks.any():
        return rows
    number, lacking = np.nonzero(lacks)
    blocks = rows.blocks.copy()
    blocks[1, number, lacking, lacking] = 1.0
    return rows._replace(blocks=blocks)


def packed_blocks(layout: Layout, factors: np.ndarray) -> np.ndarray:
    """Numbers (m, k) of ``factors`` (m, 2, b, b) as ``StationFactors`` keeps them."""
    inverse = layout.packed(factors[:, 0], "half")
    if layout.native.is_sparse:
        return inverse
    return np.hstack([inverse, layout.packed(factors[:, 1].swapaxes(1, 2), "own")])


def packed_factors(
    layout: Layout, station_type: np.ndarray, found: FoundFactors
) -> tuple[np.ndarray, np.ndarray]:
    """Kinds of factors and their numbers; see ``kinds_by_type``.

    ``station_type`` (m,) is that of each factor.
    """
    return kinds_by_type(
        layout, station_type, lambda part, rows: packed_blocks(part, found.factors[rows])
    )[:2]


def besides_of(
    layout: Layout, stations: Sections, rows: StationRows
) -> tuple[np.ndarray, np.ndarray] | None:
    """Kinds of the blocks between stations and their numbers, as ``StationFactors`` keeps them;
    None if a station is joined to unknowns of one beside it that it lacks itself."""

    def pack(part: Layout, chosen: slice | np.ndarray) -> np.ndarray:
        packed = [part.packed(-rows.blocks[place][chosen], "beside") for place in (0, 2)]
        return np.concatenate(packed, axis=1)

    kinds, numbers, count = kinds_by_type(layout, stations.station_type[rows.chosen], pack)
    joined = np.count_nonzero(rows.blocks[0]) + np.count_nonzero(rows.blocks[2])
    return (kinds[rows.kinds], numbers) if count == joined else None


class FoundFactors(NamedTuple):
    """Different factors of a matrix, in the order of their first use in ``numbers``.

    Attributes
    ----------
    factors : (m, 2, b, b) S^-1 and -S^-1 B of each; S is the diagonal block after elimination, B
        joins it to the next station
    kinds : (m,) kind of station that each factor is of
    numbers : factor of each station: (n,) for a given middle; for a middle that moves (n,) for
        stations before it, then (n,) for those behind it, then one for each place of the middle
    """

    factors: np.ndarray
    kinds: np.ndarray
    numbers: np.ndarray

    @classmethod
    def of(cls, rows: StationRows, middle: int | None) -> FoundFactors:
        """All factors of the matrix with these rows; of one ``middle``, or of all if it is None."""
        kinds, blocks, n = rows.kinds, rows.blocks, rows.kinds.size
        meeting = np.arange(0, n, MIDDLES) if middle is None else np.array([middle])
        first, last = (n, 0) if middle is None else (middle, middle + 1)
        matrix = native.StationBlocks(*blocks)
        before, kinds_before, at_before = native.eliminate(kinds[:first], matrix, False)
        behind, kinds_behind, at_behind = native.eliminate(kinds[last:], matrix, True)
        # The stations that the middle joins, one more at each end that is none.
        earlier = np.concatenate([[-1], at_before])[meeting]
        later = np.concatenate([at_behind, [-1]])[meeting + 1 - last]
        triples, at_middle = np.unique(
            np.stack([kinds[meeting], earlier, later], axis=1), axis=0, return_inverse=True
        )
        here = np.zeros((len(triples), *before.shape[1:]))
        meetings = np.ascontiguousarray(triples).view(native.MEETING)[:, 0]
        by_part = (own.reshape(-1, *own.shape[2:]) for own in (before, behind, here))
        native.join(meetings, matrix, *by_part)
        n_before, n_behind = len(before), len(behind)
        parts = [at_before, n_before + at_behind, n_before + n_behind + at_middle.ravel()]
        numbers = np.concatenate(parts if middle is None else [parts[0], parts[2], parts[1]])
        first_met, number = numbered(numbers)
        factors = np.concatenate([before, behind, here])
        of_factor = np.concatenate([kinds_before, kinds_behind, triples[:, 0]])
        chosen = numbers[first_met]
        return cls(factors[chosen], of_factor[chosen], number)
