"""Sparsity patterns of station blocks, and their packing for kernels.

Which lane of a vector an unknown stands in, and in which order kernels read the numbers of a block,
is known to them alone (``layout.hpp``).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Literal

import numpy as np

from catenary.solver.kernels import native

# Unknowns of a station that kernels take.
MOST_UNKNOWNS = native.MOST_UNKNOWNS
# Parameters of a layout.
_SETTINGS = ("widths", "own", "beside", "damped", "station_types", "factors")


class Layout:
    """Sparsity pattern of a station's blocks in K and C, or in factors of A.

    Planes are sets of unknowns that no matrix joins. They stand side by side.

    Parameters
    ----------
    widths : unknowns of a station in each plane, as they follow each other in vectors
    own, beside : (b, b) bool, pattern of the block of a station, and of the blocks between
        neighbours; full in each plane by default. For factors ``own`` is the pattern after
        elimination
    damped : whether a product with K is one with C as well
    factors : whether of factors
    station_types : places in a cross-section that stations of each type have; empty if all stations
        have all places

    Attributes
    ----------
    pitch : unknowns of a cross-section
    whole, places : for one of the ``parts`` of a layout: that layout, and the places that the part
        has of it
    """

    whole: Layout | None = None
    places: tuple[int, ...] = ()

    def __init__(
        self,
        widths: tuple[int, ...],
        own: np.ndarray | None = None,
        beside: np.ndarray | None = None,
        damped: bool = False,
        station_types: tuple[tuple[int, ...], ...] = (),
        factors: bool = False,
    ) -> None:
        self.widths = tuple(widths)
        plane = np.repeat(np.arange(len(widths)), widths)
        self._plane = plane
        together = plane[:, None] == plane
        self.own = together if own is None else own & together
        self.beside = together if beside is None else beside & together
        self.damped, self.station_types, self.factors = bool(damped), station_types, bool(factors)
        self.pitch = plane.size

    def changed(self, **settings: Any) -> Layout:
        """Return this layout with some other parameters, by their names."""
        return Layout(**{**{name: getattr(self, name) for name in _SETTINGS}, **settings})

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
        part = Layout(widths, own, beside, self.damped, factors=self.factors)
        part.whole, part.places = self, places
        return part

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
