"""Products with matrices in blocks of stations: block tridiagonal, unknowns in lanes of vectors.

A station is a cross-section of the line: the unknowns of a node of each wire at one place. Spans
are alike, so that a line has few unique stations, however long it is. Their numbers then stay in
the caches, where a stored matrix leaves them on a long line, and products and solves wait for
memory. Where no two spans are alike, blocks are read one after the other, as memory likes it best.

A layout is the sparsity pattern of blocks. Which lane of a vector an unknown stands in, and in
which order kernels read the numbers of a block, is known to them alone (``layout.hpp``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.station_rows import Sections, StationRows
from catenary.solver.model.alike import kinds_of

# Unknowns of a station that kernels take.
MOST_UNKNOWNS = native.MOST_UNKNOWNS


@dataclass(eq=False)
class Layout:
    """Sparsity pattern of a station's blocks in K and C, or in factors of A.

    Planes are sets of unknowns that no matrix joins. They stand side by side.

    Attributes
    ----------
    widths : unknowns of a station in each plane, as they follow each other in vectors
    own, beside : (b, b) bool, pattern of the block of a station, and of the blocks between
        neighbours; full in each plane by default. For factors ``own`` is the pattern after
        elimination
    damped : whether a product with K is one with C as well
    factors : whether of factors
    station_types : places in a cross-section that stations of each type have; empty if all stations
        have all places
    whole, places : for one of the ``parts`` of a layout: that layout, and the places that the part
        has of it
    """

    widths: tuple[int, ...]
    own: np.ndarray = field(default_factory=lambda: np.array(True))
    beside: np.ndarray = field(default_factory=lambda: np.array(True))
    damped: bool = False
    station_types: tuple[tuple[int, ...], ...] = ()
    factors: bool = False
    whole: Layout | None = None
    places: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        self._plane = plane = np.repeat(np.arange(len(self.widths)), self.widths)
        together = plane[:, None] == plane
        self.own, self.beside = self.own & together, self.beside & together

    @property
    def pitch(self) -> int:
        """Unknowns of a cross-section."""
        return self._plane.size

    @property
    def varies(self) -> bool:
        """Whether stations are of several station types, of which this may be one."""
        return bool(self.station_types) or self.whole is not None

    @cached_property
    def parts(self) -> tuple[Layout, ...]:
        """Layouts of each station type; if there is one only, this itself."""
        return tuple(self._part(n) for n in range(len(self.station_types))) or (self,)

    def _part(self, number: int) -> Layout:
        places = self.station_types[number]
        widths = tuple(int(width) for width in np.bincount(self._plane[list(places)]) if width)
        own, beside = (joined[np.ix_(places, places)] for joined in (self.own, self.beside))
        return replace(
            self,
            widths=widths,
            own=own,
            beside=beside,
            station_types=(),
            whole=self,
            places=places,
        )

    @cached_property
    def native(self) -> native.Layout:
        """The layout as kernels take it, which may join more: one that some were compiled for."""
        return native.Layout(self.own, self.beside, self.damped, self.factors)

    def packed(self, blocks: np.ndarray, which: Literal["own", "beside", "half"]) -> np.ndarray:
        """Blocks (..., pitch, pitch) as kernels read those of a station itself, those beside it, or
        ``half`` of its symmetric own, shape (..., n).

        Those of a part are of the whole.
        """
        if self.whole is not None:
            blocks = blocks[..., self.places, :][..., self.places]
        row, column = self.native.places(which)
        return np.where(row >= 0, blocks[..., row, column], 0.0)


def layout_of(
    operator: np.ndarray, stiffness: np.ndarray, station_types: tuple[tuple[int, ...], ...] = ()
) -> Layout | None:
    """Layout of a line; None if a cross-section has more than ``MOST_UNKNOWNS`` unknowns.

    ``operator`` and ``stiffness`` (3, n, b, b) are blocks of A and K, see ``neighbours``;
    ``station_types`` are the places of each type in a cross-section, empty for a single type.
    """
    joined = (operator != 0).any(axis=(0, 1)) | (stiffness != 0).any(axis=(0, 1))
    widths = _planes(joined)
    if sum(widths) > MOST_UNKNOWNS:
        return None
    pairs = of_pairs(sum(widths))
    return joining(Layout(widths, pairs, pairs, station_types=station_types), stiffness)


def of_pairs(size: int) -> np.ndarray:
    """Mask (size, size) of the pairs of deflection and slope of each wire, which M joins."""
    wire = np.arange(size) // 2
    return wire[:, None] == wire


def with_damping(layout: Layout, damping: np.ndarray | None) -> Layout:
    """Extend a layout to products with C, whose blocks are ``damping``, see ``neighbours``."""
    found = layout if damping is None else joining(layout, damping)
    return replace(found, damped=True)


def joining(layout: Layout, blocks: np.ndarray) -> Layout:
    """Extend a layout to a matrix with ``blocks`` (3, n, b, b), see ``neighbours``."""
    before, own, after = (blocks != 0).any(axis=1)
    return replace(layout, own=layout.own | own, beside=layout.beside | before | after)


def _planes(joined: np.ndarray) -> tuple[int, ...]:
    """Widths of the runs of unknowns that ``joined`` (b, b) does not join."""
    size = joined.shape[0]
    reach = np.where(joined | joined.T, np.arange(size), 0).max(axis=1, initial=0)
    ends = np.flatnonzero(np.maximum.accumulate(np.maximum(reach, np.arange(size))) == range(size))
    return tuple(int(width) for width in np.diff(ends, prepend=-1))


def kinds_by_type(
    layout: Layout, station_type: np.ndarray, pack: Callable[[Layout, Any], np.ndarray]
) -> tuple[np.ndarray, np.ndarray, int]:
    """Different rows of numbers of stations, each stored once.

    ``station_type`` (n,) is the type of each station; ``pack(layout, stations)`` returns the
    numbers (k, m) of stations of one type.

    Returns
    -------
    kinds : (n,) int32, place of the first number of each station in ``numbers``
    numbers : numbers of all kinds, one kind after another
    count : number of non-zero numbers of all stations, before like ones are merged
    """
    begins, numbers = np.zeros(station_type.size, dtype=np.int32), [np.zeros(0)]
    end = count = 0
    # Blocks of large vectors begin at lines of a cache if those of small ones stand behind them.
    for number in sorted(range(len(layout.parts)), key=lambda n: -layout.parts[n].pitch):
        stations = np.flatnonzero(station_type == number) if layout.varies else slice(None)
        packed = pack(layout.parts[number], stations)
        count += np.count_nonzero(packed)
        first, kinds = kinds_of(packed)
        begins[stations] = end + packed.shape[1] * kinds
        numbers.append(packed[first].ravel())
        end += numbers[-1].size
    return begins, aligned_arrays.copy(np.concatenate(numbers)), count


class StationProduct:
    """Products with rows of K, and C if the layout is damped. Not collective.

    Attributes
    ----------
    layout : Layout
    stations : of the factor
    arrays : ``native.ProductArrays``

    Parameters
    ----------
    kinds : (n,) of its rows, see ``kinds_by_type``
    blocks : of each kind the diagonal block of K, then what joins it to the stations before and
        after it; the same of -C; all as products read them, see ``Layout``
    first : station in the factor of the first row; the factor has one before and one after all
        rows, which is zero where the line ends
    """

    def __init__(
        self, layout: Layout, stations: Sections, kinds: np.ndarray, blocks: np.ndarray, first: int
    ) -> None:
        self.layout, self.stations = layout, stations
        self.arrays = native.ProductArrays(kinds, blocks, first, stations.places())

    @cached_property
    def _products(self) -> native.Products:
        layouts = [part.native for part in self.layout.parts]
        return native.Products(layouts, self.stations.station_types, self.arrays)

    def multiply(
        self, factor: np.ndarray, result: np.ndarray, velocity: np.ndarray | None = None
    ) -> None:
        """Make ``result`` K ``factor``, less C ``velocity`` if the layout is damped."""
        velocity = factor if velocity is None else velocity
        self._products.multiply(0, self.arrays.kinds.size, factor, velocity, result)

    def multiply_rows(self, begin: int, end: int, factor: np.ndarray, result: np.ndarray) -> None:
        """Write the rows of the stations from ``begin`` to before ``end`` of K ``factor`` to
        ``result``; other rows stay. Not for a damped layout."""
        self._products.multiply(begin, end, factor, factor, result)


def station_product(
    rows: StationRows,
    first: int,
    layout: Layout,
    columns: Sections,
    damping: StationRows | None = None,
) -> StationProduct | None:
    """Products with the rows of a matrix by stations; None if it has entries outside of the layout.

    Parameters
    ----------
    rows : StationRows
        Rows of the matrix.
    first : int
        Station of the columns that the first row belongs to.
    layout : Layout
        Layout of the rows.
    columns : Sections
        Stations of the columns. The operand has one more station at both ends.
    damping : StationRows, optional
        C, with kinds of the same stations; its product is subtracted.
    """
    stations, first = columns.padded(), first + 1
    of_rows = stations.station_type[first : first + rows.kinds.size]
    packed = packed_rows(layout, rows, damping, of_rows)
    if packed is None:
        return None
    return StationProduct(layout, stations, *packed, first)


def packed_rows(
    layout: Layout, rows: StationRows, damping: StationRows | None, station_type: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Kinds and numbers of rows as ``StationProduct`` keeps them.

    ``station_type`` (n,) is the type of each row; None if a matrix has entries outside of the
    layout.
    """
    numbers: list[tuple[np.ndarray, Literal["own", "beside"]]] = []
    for part, sign in ((rows, 1.0), (damping, -1.0)):
        if part is not None:
            before, own, after = sign * part.blocks
            numbers += [(own, "own"), (before, "beside"), (after, "beside")]

    def pack(part: Layout, which: slice | np.ndarray) -> np.ndarray:
        packed = [part.packed(blocks[which], place) for blocks, place in numbers]
        return np.concatenate(packed, axis=1)

    kinds, packed, count = kinds_by_type(layout, station_type[rows.chosen], pack)
    if count != sum(np.count_nonzero(blocks) for blocks, _ in numbers):
        return None
    return kinds[rows.kinds], packed
