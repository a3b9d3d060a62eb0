"""Factors of a long line by pieces, as a window comes to need them."""

from __future__ import annotations

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.linear.pieces.pieces import Piece, Pieces, Slots
from catenary.solver.linear.station_factors import (
    MIDDLES,
    FoundFactors,
    StationFactors,
    Turning,
    besides_of,
    completed,
    packed_blocks,
    packed_factors,
    softened,
)
from catenary.solver.linear.stations.sections import Sections
from catenary.solver.linear.stations.station_layout import Layout
from catenary.solver.linear.stations.station_rows import StationRows

# Message where stations are joined otherwise than the layout has it.
JOINED_OTHERWISE = (
    "stations of the line are joined otherwise than those at its start, which a window cannot "
    "follow; set window.mode to off"
)


class FactorPieces:
    """Factors whose middle may be moved, of the pieces that are made. Not collective.

    Attributes
    ----------
    factors : StationFactors; those of stations in other pieces are not to be used
    can_begin, can_end : (n + 1,) whether steps of a part of the line may begin and end at each
        station of these pieces

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
        edges = np.zeros((2, n + 1), dtype=np.int64)
        self._turning = Turning(kinds.copy(), kinds.copy(), here, *edges)
        self.factors = StationFactors(
            layout, stations, kinds, self._blocks.numbers, 0, n, 0, besides, self._turning
        )
        self.can_begin, self.can_end = np.zeros((2, n + 1), dtype=bool)
        # A line may always end where it does.
        self.can_begin[[0, n]] = self.can_end[[0, n]] = True

    def make(self, piece: Piece, rows: StationRows) -> None:
        """Work out those of a piece, of whose stretch the operator has ``rows``.

        Raises
        ------
        RunBroken
            If they are not finite, or join what the layout does not.
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
        kinds, packed, _ = packed_factors(self._layout, station_type, found)
        kinds, size = kinds[place] + self._blocks.put(piece.slot, packed), piece.end - piece.begin
        begin, end, turning = piece.begin, piece.end, self._turning
        turning.to_end[begin:end], turning.to_start[begin:end] = kinds[: 2 * size].reshape(2, -1)
        turning.here[-(-begin // MIDDLES) : -(-end // MIDDLES)] = kinds[2 * size :]
        self._turn(piece)
        soft = softened(whole.blocks[1][found.kinds], found.factors[:, 0])[place]
        self.can_begin[begin:end] |= soft[:size]
        self.can_end[begin + 1 : end + 1] |= soft[size : 2 * size]
        besides = besides_of(self._layout, stations.part(own.start, own.stop), rows.part(own))
        if besides is None:
            raise RunBroken(JOINED_OTHERWISE)
        first = self._besides.put(piece.slot, besides[1])
        self.factors.beside_kinds[begin:end] = besides[0] + first

    def _turn(self, piece: Piece) -> None:
        """Give the stations of a piece the factors for where elimination ends now."""
        kinds, turning, ends_at = self.factors.kinds, self._turning, int(self.factors.ends[4])
        middle = min(max(ends_at, piece.begin), piece.end)
        kinds[piece.begin : middle] = turning.to_end[piece.begin : middle]
        kinds[middle : piece.end] = turning.to_start[middle : piece.end]
        if piece.begin <= ends_at < piece.end:
            kinds[ends_at] = turning.here[ends_at // MIDDLES]
