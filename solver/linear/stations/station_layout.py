"""Sparsity patterns of station blocks, and their packing for kernels.

Which lane of a vector an unknown stands in, and in which order kernels read the numbers of a block,
is known to them alone (``layout.hpp``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from catenary.solver.kernels import native

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
