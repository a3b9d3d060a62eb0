"""Rows of a line's matrices by stations; like rows are found before there are any, and stored once.

Spans of a line are alike. A station's mark follows from all that stands in its rows of M, K and C:
the matrices of its elements, and which unknowns of this and of other stations these join. Stations
of one mark have the same rows, and stretches whose marks are the same have the same responses.

Blocks are as large as a cross-section, whatever its stations have: what one lacks is a row and a
column of zeros.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native
from catenary.solver.model.alike import digests, numbered
from catenary.solver.model.matrices import iterate_sums
from catenary.solver.model.model import Block, Model
from catenary.solver.model.unknowns import Unknowns

# Of stations that are all alike.
_ALIKE = native.Sections(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.uint8))
# Odd numbers without a pattern: of Knuth's linear congruential generator and of SplitMix64.
_RATIO = 6364136223846793005
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
# Shares of M, K and C.
Coefficients = tuple[float, float, float]
# Stations whose entries are put together at once, some 50 MB of them.
_STRETCH = 2**14


@dataclass(frozen=True)
class Sections:
    """Consecutive stations.

    Attributes
    ----------
    starts : (n + 1,) first unknown of each, counted from the first station's, and of the one after
    station_type : (n,) of each
    station_types : places in a cross-section of the stations of each type
    width : places of a cross-section
    """

    starts: np.ndarray
    station_type: np.ndarray
    station_types: tuple[tuple[int, ...], ...]
    width: int

    @classmethod
    def of(cls, numbering: Unknowns, low: int, high: int) -> Sections:
        """Stations of the unknowns [``low``, ``high``), which are whole ones."""
        first, last = numbering.stations_over(low, high)
        starts = numbering.starts[first : last + 1] - numbering.starts[first]
        station_type = numbering.station_type[first:last]
        return cls(starts, station_type, numbering.station_types, numbering.width)

    @property
    def size(self) -> int:
        """Number of stations."""
        return int(self.station_type.size)

    @property
    def varies(self) -> bool:
        """Whether some stations lack a place."""
        return any(len(places) < self.width for places in self.station_types)

    def part(self, first: int, last: int) -> Sections:
        """Stations from ``first`` to before ``last``."""
        starts = self.starts[first : last + 1] - self.starts[first]
        return Sections(starts, self.station_type[first:last], self.station_types, self.width)

    def places(self) -> native.Sections:
        """Places of the stations as kernels read them."""
        if not self.varies:
            return _ALIKE
        return native.Sections(
            self.starts[:-1].astype(np.int64), self.station_type.astype(np.uint8)
        )

    def padded(self) -> Sections:
        """Return these sections with a further station of all places at both ends."""
        whole = tuple(range(self.width))
        station_types = (
            self.station_types if whole in self.station_types else (*self.station_types, whole)
        )
        number = station_types.index(whole)
        starts = self.width + np.r_[-self.width, self.starts, self.starts[-1] + self.width]
        return Sections(starts, np.r_[number, self.station_type, number], station_types, self.width)

    def missing(self) -> np.ndarray:
        """Whether a station lacks a place, shape (n, width)."""
        lacks = np.ones((len(self.station_types), self.width), dtype=bool)
        for row, places in zip(lacks, self.station_types, strict=True):
            row[list(places)] = False
        return lacks[self.station_type]


def places_of(unknowns: np.ndarray, columns: Sections) -> tuple[np.ndarray, np.ndarray]:
    """Station of each unknown, and its place in a cross-section."""
    station = np.searchsorted(columns.starts, unknowns, side="right") - 1
    place_of = np.full((len(columns.station_types), columns.width), -1)
    for row, places in zip(place_of, columns.station_types, strict=True):
        row[: len(places)] = places
    return station, place_of[columns.station_type[station], unknowns - columns.starts[station]]


class LikeStations:
    """Marks of a line's stations. Not collective.

    Attributes
    ----------
    first : the first of them
    marks : (n,) uint64 of each

    Parameters
    ----------
    first, last : range of stations that have marks, all of the line if not given
    """

    def __init__(self, model: Model, first: int = 0, last: int | None = None) -> None:
        numbering = model.numbering
        last = numbering.starts.size - 1 if last is None else last
        starts = numbering.starts[first : last + 1]
        self.first, n = first, last - first
        low, high = int(starts[0]), int(starts[-1])
        station = np.repeat(np.arange(n), np.diff(starts))
        held = np.zeros(high - low, dtype=np.int64)
        constrained = model.constrained_between(low, high) - low
        held[constrained] = 1
        # Unknowns of a station differ by their place in it and by whether they are held.
        name = (2 * (np.arange(low, high) - starts[station]) + held).astype(np.uint64)
        self.marks = _mixed(numbering.station_type[first:last].astype(np.uint64))
        np.add.at(self.marks, station[constrained], _mixed(name[constrained]))
        for number, block in enumerate(model.blocks):
            dofs, kind, table = _elements_between(block, low, high)
            if not dofs.size:
                continue  # of no element, as droppers that a line does not have
            of_kind = _mixed(digests(table) + np.uint64(number + 1))
            at, own = station[dofs - low], name[dofs - low]
            apart = (at - at.min(axis=1, keepdims=True)).astype(np.uint64)
            element = of_kind[kind]
            for column in range(at.shape[1]):
                element = _mixed(element + own[:, column] + (apart[:, column] << np.uint64(16)))
            for column in range(at.shape[1]):
                np.add.at(self.marks, at[:, column], _mixed(element + np.uint64(column)))

    def fingerprints(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """A number (k,) uint64 for each stretch from station ``first`` (k,) to before ``last``
        (k,), the same for stretches of the same marks."""
        sums, inverse = self._sums
        first, last = first - self.first, last - self.first
        return (sums[last] - sums[first]) * inverse[first]

    @cached_property
    def _sums(self) -> tuple[np.ndarray, np.ndarray]:
        """Polynomials of the marks up to each station, and the powers that shift them back."""
        n = self.marks.size
        ratio, inverse = (np.full(n + 1, r, np.uint64) for r in (_RATIO, pow(_RATIO, -1, 2**64)))
        ratio[0] = inverse[0] = 1
        sums = np.zeros(n + 1, dtype=np.uint64)
        np.cumsum(self.marks * np.cumprod(ratio)[:n], out=sums[1:])
        return sums, np.cumprod(inverse)


def _elements_between(block: Block, low: int, high: int) -> tuple[np.ndarray, ...]:
    """Unknowns (k, m) of the elements that have all of theirs from ``low`` to before ``high``, the
    kind (k,) of each, and a row with all numbers of each kind: which terms these are follows from
    the block."""
    terms = [term for term in (block.mass, block.stiffness, block.damping) if term is not None]
    near = block.near(low, high)
    dofs, kind = block.dofs[near].astype(np.int64), block.kind[near]
    inside = (dofs >= low).all(axis=1) & (dofs < high).all(axis=1)
    if not inside.all():
        dofs, kind = dofs[inside], kind[inside]
    if len(dofs) < len(block.dofs):
        used, kind = np.unique(kind, return_inverse=True)
        terms = [term[used] for term in terms]
    rows = [term.reshape(len(term), math.prod(term.shape[1:])) for term in terms]
    return dofs, kind, np.hstack(rows)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64: numbers that tell nothing of what they follow from."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * _FIRST
    numbers = (numbers ^ (numbers >> np.uint64(27))) * _SECOND
    return np.asarray(numbers ^ (numbers >> np.uint64(31)))


class StationRows(NamedTuple):
    """Rows of a block tridiagonal matrix by stations.

    Attributes
    ----------
    kinds : (n,) int32 of each station
    chosen : (k,) first station of each kind, ascending
    blocks : (3, k, b, b) of each kind towards the start of the line, on the diagonal and towards
        the end
    """

    kinds: np.ndarray
    chosen: np.ndarray
    blocks: np.ndarray

    def part(self, stations: slice) -> StationRows:
        """The rows of a range of the stations."""
        own = self.kinds[stations]
        first, kinds = numbered(own)
        return StationRows(kinds, first, self.blocks[:, own[first]])


class LikeRows:
    """Rows of M, K and C from one station to another. Not collective.

    Parameters
    ----------
    model : Model
    like : marks of its stations
    low, high : first unknown and the one after the last, of whole stations
    """

    def __init__(self, model: Model, like: LikeStations, low: int, high: int) -> None:
        self._model = model
        self._stations = Sections.of(model.numbering, 0, model.numbering.size)
        self._first, last = model.numbering.stations_over(low, high)
        marks = like.marks[self._first - like.first : last - like.first].copy()
        # Rows at the ends may be cut off, so that they are kinds of their own.
        marks[:1] += np.uint64(1)
        marks[-1:] += np.uint64(2)
        self._chosen, self._kinds = numbered(marks)

    def sums_of(
        self,
        sums: Sequence[Coefficients],
        columns: tuple[int, int],
        held_diagonals: Sequence[float],
    ) -> list[StationRows] | None:
        """Rows of ``sums`` of M, K and C; None if one joins stations that are no neighbours.

        Entries beyond ``columns`` are left out; those of held unknowns are zero but for the
        diagonal of each sum in ``held_diagonals``.
        """
        width = self._model.numbering.width
        blocks = np.zeros((len(sums), 3, self._chosen.size, width, width))
        for begin in range(0, self._chosen.size, _STRETCH):
            part = slice(begin, begin + _STRETCH)
            found = self._part(self._chosen[part], sums, columns, held_diagonals)
            if found is None:
                return None
            blocks[:, :, part] = found
        return [StationRows(self._kinds, self._chosen, own) for own in blocks]

    def _part(
        self,
        chosen: np.ndarray,
        sums: Sequence[Coefficients],
        columns: tuple[int, int],
        held_diagonals: Sequence[float],
    ) -> np.ndarray | None:
        """Blocks of the ``chosen`` stations, of each of the ``sums``."""
        model, numbering = self._model, self._model.numbering
        stations = chosen + self._first
        begin, end = numbering.starts[stations[0]], numbering.starts[stations[-1] + 1]
        number = np.full(int(stations[-1] - stations[0]) + 1, -1)
        number[stations - stations[0]] = np.arange(stations.size)
        wanted = np.repeat(number >= 0, np.diff(numbering.starts[stations[0] : stations[-1] + 2]))
        parts = list(iterate_sums(model, int(begin), int(end), sums, wanted))
        held = model.constrained_between(int(begin), int(end))
        held = held[wanted[held - begin]]
        parts.append((held, held, np.tile(np.array(held_diagonals)[:, None], held.size)))
        rows, others, values = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        inside = (others >= columns[0]) & (others < columns[1])
        inside &= (values != 0.0).any(axis=0)
        values, size, n = values[:, inside], numbering.width, stations.size
        station, place = places_of(rows[inside], self._stations)
        other, at = places_of(others[inside], self._stations)
        step = other - station
        if np.abs(step).max(initial=0) > 1:
            return None
        flat = ((step + 1) * n + number[station - stations[0]]) * size + place
        flat = flat * size + at
        found = [np.bincount(flat, weights=own, minlength=3 * n * size * size) for own in values]
        return np.reshape(found, (len(sums), 3, n, size, size))
