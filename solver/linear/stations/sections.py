"""Stations that the rows or columns of a matrix belong to.

Blocks are as large as a cross-section, whatever its stations have: what one lacks is a row and a
column of zeros.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.solver.kernels import native
from catenary.solver.model.unknown_registry import Unknowns

# Of stations that are all alike.
_ALIKE = native.Sections(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.uint8))


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
