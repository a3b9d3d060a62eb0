"""Rows of a line's matrices by stations; like rows are assembled and stored once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from catenary.solver.linear.stations.like_stations import LikeStations
from catenary.solver.linear.stations.sections import Sections, places_of
from catenary.solver.model.alike import numbered
from catenary.solver.model.entries import iterate_sums
from catenary.solver.model.model import Model

# Shares of M, K and C.
Coefficients = tuple[float, float, float]
# Stations whose entries are put together at once, some 50 MB of them.
_STRETCH = 2**14


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
