"""Products with M, K and C and factors of A, of the pieces of a long line that a window needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.kernels import native
from catenary.solver.linear.petsc_solvers import DIRECT, wants_own_solver
from catenary.solver.linear.pieces.pieces import Piece, Pieces, Slots
from catenary.solver.linear.station_factors import (
    MIDDLES,
    FoundFactors,
    StationFactors,
    besides_of,
    completed,
    layout_of_factors,
    packed_blocks,
    packed_factors,
    station_factors,
)
from catenary.solver.linear.stations.like_stations import LikeStations
from catenary.solver.linear.stations.sections import Sections, places_of
from catenary.solver.linear.stations.station_layout import Layout
from catenary.solver.linear.stations.station_products import (
    StationProduct,
    layout_of,
    packed_rows,
    station_product,
    with_damping,
)
from catenary.solver.linear.stations.station_rows import Coefficients, LikeRows, StationRows
from catenary.solver.model.model import Model

# Message where stations are joined otherwise than the layout has it.
JOINED_OTHERWISE = (
    "nodes of the line are coupled in another way than those at its start, which a window cannot "
    "follow; set window.mode to off"
)


class FactorPieces:
    """Factors whose middle may be moved, of the pieces that are made. Not collective.

    Attributes
    ----------
    factors : StationFactors; those of stations in other pieces are not to be used

    Parameters
    ----------
    layout : of the factors
    stations : all of the line
    pieces : of the line
    """

    def __init__(self, layout: Layout, stations: Sections, pieces: Pieces) -> None:
        n, size = stations.size, pieces.size
        self._layout, self._stations = layout, stations
        none = np.zeros((1, 2, stations.width, stations.width))
        widths = tuple(packed_blocks(part, none).shape[1] for part in layout.parts)
        room = 2 * size + size // MIDDLES
        self._blocks = Slots(pieces.n_slots, room, widths)
        kept = [part.packed(none[:, 0], "beside") for part in layout.parts]
        widths = tuple(2 * numbers.shape[1] for numbers in kept)
        self._besides = Slots(pieces.n_slots, size, widths)
        besides = np.zeros(n, dtype=np.int32), self._besides.numbers
        kinds = np.zeros(n, dtype=np.int32)
        here = np.zeros(-(-n // MIDDLES), dtype=np.int32)
        self._turning = native.Turning(kinds.copy(), kinds.copy(), here)
        self.factors = StationFactors(
            layout, stations, kinds, self._blocks.numbers, besides, 0, n, self._turning
        )

    def make(self, piece: Piece, rows: StationRows) -> None:
        """Compute the factors of a piece from the ``rows`` of the operator in its stretch.

        Raises
        ------
        RunBroken
            If a factor is not finite or has entries outside of the layout.
        """
        stations, n = self._stations.part(piece.low, piece.high), rows.kinds.size
        whole = completed(rows, stations)
        found, own = FoundFactors.of(whole, None), piece.own
        middles = found.numbers[2 * n :][-(-own.start // MIDDLES) : -(-own.stop // MIDDLES)]
        numbers = found.numbers[:n][own], found.numbers[n : 2 * n][own], middles
        used, place = np.unique(np.concatenate(numbers), return_inverse=True)
        found = FoundFactors(found.factors[used], found.kinds[used], place)
        if not np.isfinite(found.factors).all():
            raise RunBroken("the step operator cannot be factored: it is singular or not finite")
        station_type = stations.station_type[whole.chosen][found.kinds]
        kinds, packed = packed_factors(self._layout, station_type, found)
        kinds, size = kinds[place] + self._blocks.put(piece.slot, packed), piece.end - piece.begin
        begin, end, turning = piece.begin, piece.end, self._turning
        turning.to_end[begin:end], turning.to_start[begin:end] = kinds[: 2 * size].reshape(2, -1)
        turning.here[-(-begin // MIDDLES) : -(-end // MIDDLES)] = kinds[2 * size :]
        self._turn(piece)
        besides = besides_of(self._layout, stations.part(own.start, own.stop), rows.part(own))
        if besides is None:
            raise RunBroken(JOINED_OTHERWISE)
        first = self._besides.put(piece.slot, besides[1])
        self.factors.arrays.beside_kinds[begin:end] = besides[0] + first

    def _turn(self, piece: Piece) -> None:
        """Give the stations of a piece the factors for where elimination ends now."""
        arrays, turning = self.factors.arrays, self._turning
        kinds, ends_at = arrays.kinds, int(arrays.ends[4])
        middle = min(max(ends_at, piece.begin), piece.end)
        kinds[piece.begin : middle] = turning.to_end[piece.begin : middle]
        kinds[middle : piece.end] = turning.to_start[middle : piece.end]
        if piece.begin <= ends_at < piece.end:
            kinds[ends_at] = turning.here[ends_at // MIDDLES]


class WantedPieces(NamedTuple):
    """Part of a line that steps need at a time.

    Attributes
    ----------
    moving : length of the longest stretch that moves [m]
    ahead : distance that it may advance before the next piece is made [m]
    around : number of stations that are needed on either side of it
    """

    moving: float
    ahead: float
    around: int

    def pieces_of(
        self, model: Model, coefficients: Coefficients, reach: float
    ) -> OperatorPieces | None:
        """Operators of the line by pieces; None if making them for the whole line costs no more.

        ``coefficients`` are those of M, K and C in A, ``reach`` is that of a step [m]. Not
        collective.
        """
        numbering = model.numbering
        if not (numbering.in_stations and wants_own_solver()):
            return None
        around = self.moving + 4.0 * reach
        pieces = Pieces(numbering, reach, around + self.ahead, self.around)
        if pieces.are_few:
            return None
        layouts = layouts_of(model, coefficients, pieces)
        return None if layouts is None else OperatorPieces(model, coefficients, pieces, *layouts)


class OperatorPieces:
    """The operators of a whole line, made by pieces. Not collective.

    Attributes
    ----------
    pieces : as given
    layout : how unknowns of a station stand in lanes
    factors : FactorPieces of A
    like : marks of the stations of the stretch of the latest piece

    Parameters
    ----------
    layout, of_factors : of products and of factors, see ``layouts_of``
    """

    like: LikeStations

    def __init__(
        self,
        model: Model,
        coefficients: Coefficients,
        pieces: Pieces,
        layout: Layout,
        of_factors: Layout,
    ) -> None:
        self._model, self._coefficients, self.pieces = model, coefficients, pieces
        self._stations = Sections.of(model.numbering, 0, model.numbering.size)
        self.layout = layout
        self.factors = FactorPieces(of_factors, self._stations, pieces)
        self._products: list[tuple[Slots, StationProduct, Coefficients, Coefficients | None]] = []
        pieces.add(self._make)

    def product(self, of: Coefficients, damping: Coefficients | None) -> StationProduct:
        """The product with the sum of M, K and C with coefficients ``of``, less that with the sum
        with coefficients ``damping``; filled for pieces that are made after this call."""
        layout = self.layout
        if damping is not None:
            joined = joined_by(self._model, damping)
            layout = with_damping(layout, None if joined is None else joined[0])
        stations, pieces = self._stations.padded(), self.pieces
        sets = 1 if damping is None else 2
        widths = tuple(sets * part.native.row_size for part in layout.parts)
        table = Slots(pieces.n_slots, pieces.size, widths)
        kinds = np.zeros(self._stations.size, dtype=np.int32)
        product = StationProduct(layout, stations, kinds, table.numbers, 1)
        self._products.append((table, product, of, damping))
        return product

    def _make(self, piece: Piece) -> None:
        sums = [of for _, _, *both in self._products for of in both if of is not None]
        self.like, (operator, *found) = rows_on(self._model, piece, self._coefficients, *sums)
        self.factors.make(piece, operator)
        part, made = self._stations.station_type[piece.begin : piece.end], iter(found)
        for table, product, _, damping in self._products:
            own = next(made).part(piece.own)
            damped = None if damping is None else next(made).part(piece.own)
            packed = packed_rows(product.layout, own, damped, part)
            if packed is None:
                raise RunBroken(JOINED_OTHERWISE)
            kinds, numbers = packed
            product.arrays.kinds[piece.begin : piece.end] = kinds + table.put(piece.slot, numbers)


def rows_on(
    model: Model, piece: Piece, of: Coefficients, *sums: Coefficients
) -> tuple[LikeStations, list[StationRows]]:
    """Marks of the stations of the stretch that a piece is worked out on, and rows there of sums of
    M, K and C, cut off at its ends: of the first with ones for held unknowns, of more ``sums``
    without what is held, by one walk along the elements."""
    starts = model.numbering.starts
    ends = int(starts[piece.low]), int(starts[piece.high])
    like = LikeStations(model, piece.low, piece.high)
    rows = LikeRows(model, like, *ends).sums_of([of, *sums], ends, [1.0, *[0.0] * len(sums)])
    if rows is None:
        raise RunBroken(JOINED_OTHERWISE)
    return like, rows


def layouts_of(
    model: Model, coefficients: Coefficients, pieces: Pieces
) -> tuple[Layout, Layout] | None:
    """Layouts of products and of factors, the latter by the first piece of the line; None if there
    are none."""
    stations = Sections.of(model.numbering, 0, model.numbering.size)
    joined = joined_by(model, coefficients, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    if joined is None:
        return None
    operator, stiffness, mass = joined
    station_types = stations.station_types if stations.varies else ()
    # Products with M, for energies, are of the same layout.
    layout = layout_of(operator, stiffness | mass, station_types)
    if layout is None:
        return None
    piece = pieces.first()
    _, (rows,) = rows_on(model, piece, coefficients)
    part = stations.part(piece.low, piece.high)
    if not _residual(rows, layout, part) <= DIRECT:
        return None
    return layout, layout_of_factors(layout, rows.blocks)


def _residual(rows: StationRows, layout: Layout, stations: Sections) -> float:
    """Relative residual of a solve on a stretch of the line with a load on every unknown."""
    product = station_product(rows, 0, layout, stations)
    factors = station_factors(rows, layout, stations)
    if product is None or factors is None:
        return np.inf
    size, pad = int(stations.starts[-1]), stations.width
    load = np.cos(1.0 + 3.7 * np.arange(size))
    found, answer = np.zeros(size + 2 * pad), np.zeros(size)
    factors.solve(load, answer)
    found[pad : pad + size] = answer
    product.multiply(found, answer)
    return float(np.linalg.norm(answer - load) / np.linalg.norm(load))


def joined_by(model: Model, *sums: Coefficients) -> list[np.ndarray] | None:
    """Mask of the pairs of places that some sums of M, K and C may join, (3, 1, b, b): to
    the station before, within one, and to the one after; None if stations further apart are."""
    stations = Sections.of(model.numbering, 0, model.numbering.size)
    station, place = places_of(np.arange(model.numbering.size), stations)
    width = stations.width
    result = [np.zeros((3, width, width), dtype=bool) for _ in sums]
    for joined in result:
        joined[1][np.diag_indices(width)] = True
    for block in model.blocks:
        if not block.dofs.size:
            continue
        at, where = _kinds_of_elements(station, place, block.dofs, width)
        alpha, beta = model.damping_of_block(block)
        for joined, (m, k, c) in zip(result, sums, strict=True):
            terms = ((block.mass, m + c * beta), (block.stiffness, k + c * alpha))
            given = [
                (term != 0.0).any(axis=0)
                for term, share in (*terms, (block.damping, c))
                if term is not None and share
            ]
            pairs = np.nonzero(np.logical_or.reduce(given)) if given else ()
            for i, j in zip(*pairs, strict=True):
                step = at[:, j] - at[:, i]
                if np.abs(step).max() > 1:
                    return None
                joined[step + 1, where[:, i], where[:, j]] = True
    return [joined[:, None] for joined in result]


def _kinds_of_elements(
    station: np.ndarray, place: np.ndarray, dofs: np.ndarray, width: int
) -> tuple[np.ndarray, np.ndarray]:
    """Stations and places of the unknowns of one element of each kind, both (k, m)."""
    apart = station[dofs] - station[dofs[:, :1]]
    low, high = int(apart.min()), int(apart.max())
    code, size = np.zeros(len(dofs), dtype=np.int64), (high - low + 1) * width
    for column in range(dofs.shape[1]):
        code = code * size + (apart[:, column] - low) * width + place[dofs[:, column]]
    _, first = np.unique(code, return_index=True)
    return station[dofs[first]], place[dofs[first]]
