"""Stations that the rows or columns of a matrix belong to, and its blocks by stations.

Blocks are as large as a cross-section, whatever its stations have: what one lacks is a row and a
column of zeros.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

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
    def alike(cls, n: int, width: int) -> Sections:
        """Stations that have all places."""
        station_type = np.zeros(n, dtype=np.int64)
        return cls(width * np.arange(n + 1), station_type, (tuple(range(width)),), width)

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


def neighbours(
    matrix: sparse.bsr_matrix, first: int = 0, columns: Sections | None = None
) -> np.ndarray | None:
    """Blocks of each row towards the start of the line, on the diagonal and towards the end.

    Row i has its diagonal block in column ``first`` + i. Shape (3, n, b, b); None if the matrix has
    blocks further away. ``columns`` are the stations of the columns; a matrix without has one block
    for each.
    """
    if columns is not None and columns.varies:
        return _of_varying(matrix, first, columns)
    n, (size, _) = matrix.indptr.size - 1, matrix.blocksize
    if n == 0:
        return None
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    step = matrix.indices - row - first
    if np.abs(step).max(initial=0) > 1:
        return None
    blocks = np.zeros((3, n, size, size))
    blocks[step + 1, row] = matrix.data
    return blocks


def _of_varying(matrix: sparse.bsr_matrix, first: int, columns: Sections) -> np.ndarray | None:
    """``neighbours`` of a matrix in blocks of any size."""
    entries = matrix.tocoo()
    n = int(np.searchsorted(columns.starts, columns.starts[first] + matrix.shape[0])) - first
    rows, row_place = places_of(entries.row + columns.starts[first], columns)
    others, place = places_of(entries.col, columns)
    rows -= first
    step = others - rows - first
    there = entries.data != 0
    if n == 0 or np.abs(step[there]).max(initial=0) > 1:
        return None
    blocks = np.zeros((3, n, columns.width, columns.width))
    blocks[step[there] + 1, rows[there], row_place[there], place[there]] = entries.data[there]
    return blocks


def places_of(unknowns: np.ndarray, columns: Sections) -> tuple[np.ndarray, np.ndarray]:
    """Station of each unknown, and its place in a cross-section."""
    station = np.searchsorted(columns.starts, unknowns, side="right") - 1
    place_of = np.full((len(columns.station_types), columns.width), -1)
    for row, places in zip(place_of, columns.station_types, strict=True):
        row[: len(places)] = places
    return station, place_of[columns.station_type[station], unknowns - columns.starts[station]]
