"""Pieces of a long line: only those near the train have matrices, factors and unit responses.

A piece is a number of stations. What is worked out for one stands in tables of a few slots, which
pieces take one after the other: memory and start do not grow with the line. Of the pieces that a
window needs there are products with M, K and C, factors of A, and short columns of A^-1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.petsc_solvers import DIRECT, trial_load, wants_own_solver
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
from catenary.solver.linear.station_products import (
    Layout,
    StationProduct,
    layout_of,
    packed_rows,
    station_product,
    with_damping,
)
from catenary.solver.linear.station_rows import (
    Coefficients,
    LikeRows,
    LikeStations,
    Sections,
    StationRows,
    places_of,
)
from catenary.solver.linear.unit_responses import (
    FELT_AT_MOST,
    FeltFurther,
    Forces,
    Places,
    ShortColumns,
    UnitResponses,
)
from catenary.solver.model.model import Model
from catenary.solver.model.unknowns import Unknowns

# Stations of a piece, some twenty spans: a multiple of ``MIDDLES``.
_SIZE = 1024
# Margin of a piece beyond its ends, in reaches of a step, so that nothing of where that ends is
# left in it.
_BEYOND = 2.0
# Message where stations are joined otherwise than the layout has it.
JOINED_OTHERWISE = (
    "nodes of the line are coupled in another way than those at its start, which a window cannot "
    "follow; set window.mode to off"
)
Made = Callable[[ShortColumns, np.ndarray], None]


class Piece(NamedTuple):
    """A piece of a line.

    Attributes
    ----------
    slot : of tables that it takes
    begin, end : its first station and the one after its last
    low, high : the same of the stretch that it is worked out on
    """

    slot: int
    begin: int
    end: int
    low: int
    high: int

    @property
    def own(self) -> slice:
        """Its stations among those of the stretch."""
        return slice(self.begin - self.low, self.end - self.low)


Maker = Callable[[Piece], None]


class Pieces:
    """The pieces of a line, and which of them have what they need. Not collective.

    Attributes
    ----------
    size : stations of a piece
    n_slots : pieces that there is room for
    edges : (n_pieces + 1,) first station of each, and the one after the last of all

    Parameters
    ----------
    numbering : of the line's unknowns
    reach : how far a step reaches [m]
    length : of the longest stretch that is needed at a time [m]
    around : stations that are needed beside it
    """

    def __init__(self, numbering: Unknowns, reach: float, length: float, around: int) -> None:
        n = numbering.low.size
        beyond = most_within(numbering, _BEYOND * reach)
        self._beyond = MIDDLES * (beyond // MIDDLES + 1)
        self.size = _SIZE
        # A window begins and ends anywhere in a piece.
        self.n_slots = (most_within(numbering, length) + around) // self.size + 2
        self.edges = np.append(np.arange(0, n, self.size), n)
        self._slots = np.full(self.edges.size - 1, -1)
        self._makers: list[Maker] = []

    @property
    def n_stations(self) -> int:
        """Number of stations of the line."""
        return int(self.edges[-1])

    @property
    def are_few(self) -> bool:
        """Whether the line has no more of them than there is room for."""
        return self._slots.size <= self.n_slots

    def add(self, make: Maker) -> None:
        """Add ``make``, which is called for each piece after those added before."""
        self._makers.append(make)

    def first(self) -> Piece:
        """The first piece of the line, which is not kept."""
        return self._piece(0, 0)

    def cover(self, begin: int, end: int) -> tuple[int, int]:
        """Have all pieces from station ``begin`` to before ``end``; others may make room.

        Returns the first station of these pieces and the one after the last.
        """
        numbers = range(begin // self.size, max(begin, end - 1) // self.size + 1)
        missing = [number for number in numbers if self._slots[number] < 0]
        if missing:
            taken = set(self._slots[numbers.start : numbers.stop].tolist())
            free = [slot for slot in range(self.n_slots) if slot not in taken]
            for number, slot in zip(missing, free, strict=False):
                self._slots[self._slots == slot] = -1
                piece = self._piece(number, slot)
                for make in self._makers:
                    make(piece)
                self._slots[number] = slot
        assert (self._slots[numbers.start : numbers.stop] >= 0).all(), "more pieces than slots"
        return int(self.edges[numbers.start]), int(self.edges[numbers.stop])

    def _piece(self, number: int, slot: int) -> Piece:
        begin, end = self.edges[number : number + 2].tolist()
        low, high = max(0, begin - self._beyond), min(self.n_stations, end + self._beyond)
        return Piece(slot, begin, end, low, high)


def most_within(numbering: Unknowns, length: float) -> int:
    """Most stations in a stretch of a length [m]."""
    ends = np.searchsorted(numbering.low, numbering.low + length, side="right")
    return int((ends - np.arange(ends.size)).max())


class Slots:
    """A table of numbers by slots, each with the numbers of kinds of stations in a row.

    Room that is not used takes no memory.

    Attributes
    ----------
    numbers : all of them, filled in place

    Parameters
    ----------
    n_slots : of the table
    room : kinds that a slot has room for
    widths : numbers of a kind of each station type
    """

    def __init__(self, n_slots: int, room: int, widths: tuple[int, ...]) -> None:
        self._room = room * max(widths)
        self.numbers = aligned_arrays.zeros(n_slots * self._room)

    def put(self, slot: int, numbers: np.ndarray) -> int:
        """Fill a slot with ``numbers``; what is to be added to their kinds, which are the places of
        their first numbers."""
        first = slot * self._room
        self.numbers[first : first + numbers.size] = numbers
        return first


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
    found, answer, load = np.zeros(size + 2 * pad), np.zeros(size), trial_load(0, size)
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


def columns_by_pieces(
    responses: UnitResponses,
    operators: OperatorPieces | None,
    forces: Forces,
    made: Made,
) -> ShortColumns:
    """Columns as ``UnitResponses.columns`` makes them: all at once, or by the pieces that there
    are. Collective.

    Parameters
    ----------
    responses : UnitResponses
        Solver of columns.
    operators : OperatorPieces or None
        Operators of the pieces, None if the line is whole.
    forces : Forces
        Forces that columns answer.
    made : Made
        Function that is called with all columns and the numbers of the places that have
        theirs now.
    """
    if operators is None:
        columns = responses.columns(forces)
        made(columns, np.arange(columns.start.size))
        return columns
    found, reach = responses.places(forces)
    x, pieces = found.x, operators.pieces
    # Places in their order along the track, and which of them are before each piece.
    order = np.argsort(x, kind="stable")
    edges = responses.windows.numbering.low[pieces.edges[1:-1]]
    ends = np.concatenate([[0], np.searchsorted(x[order], edges), [x.size]])
    sizes = np.cumsum(np.append(0, found.dofs.shape[1] * found.width[order]))
    room = int(np.diff(sizes[ends]).max(initial=0))
    at, data = np.zeros(x.size, dtype=np.int64), np.zeros(pieces.n_slots * room)
    columns = ShortColumns(found.begin, at, found.width, data, reach)

    def make(piece: Piece) -> None:
        number = piece.begin // pieces.size
        which = order[ends[number] : ends[number + 1]]
        if not which.size:
            return
        own = Places(*(part[which] for part in found))
        try:
            # Room and reach are those of all pieces.
            begins, numbers = responses.solve(own, operators.like, reach, FELT_AT_MOST)
        except FeltFurther as error:
            raise RunBroken(
                f"near {own.x.mean():.0f} m a force moves the line beyond the {reach:.0f} m that "
                "it reaches at the start, which a window cannot follow; set window.mode to off"
            ) from error
        first = piece.slot * room
        at[which] = first + begins
        data[first : first + numbers.size] = numbers
        made(columns, which)

    pieces.add(make)
    return columns
