"""Pieces of a line, of which only those near the train have matrices, factors and columns.

A piece is a number of stations. What is worked out for one stands in tables of a few slots, which
pieces take one after the other: memory and start do not grow with the line.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import aligned_arrays
from catenary.solver.linear.station_factors import MIDDLES
from catenary.solver.model.unknown_registry import Unknowns

# Stations of a piece, some twenty spans: a multiple of ``MIDDLES``.
_SIZE = 1024
# Margin of a piece beyond its ends, in reaches of a step, so that nothing of
# where that ends is left in it.
_BEYOND = 2.0


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
