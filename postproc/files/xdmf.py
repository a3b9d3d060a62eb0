"""Text of XDMF 3 files: grids whose numbers stand in another file beside the text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

_KINDS = {"f": "Float", "i": "Int"}
# Points of a cell -> the kind of cells.
_CELLS = {1: "Polyvertex", 2: "Polyline", 4: "Quadrilateral"}


class Item(NamedTuple):
    """Numbers of a grid.

    Attributes
    ----------
    shape : of the numbers
    number : their type of NumPy
    place : name of the file, relative to the text; in HDF5 with a colon and the path in it
    seek : where they begin in a file in which they stand one after another [B], None in HDF5
    """

    shape: tuple[int, ...]
    number: np.dtype
    place: str
    seek: int | None = None

    def rows(self, first: int, n: int, mark: str = "") -> Item:
        """``n`` rows of it from ``first`` on, marked by a comment; not in HDF5, whose parts lose
        their arrays silently in the Xdmf3 reader."""
        assert self.seek is not None
        width = self.shape[1:]
        at = self.seek + first * self.number.itemsize * math.prod(width)
        return Item((n, *width), self.number, mark + self.place, at)

    def text(self) -> str:
        """The item of the numbers."""
        kind = "Char" if self.number.itemsize == 1 else _KINDS[self.number.kind]
        form = "HDF" if self.seek is None else f'Binary" Endian="Little" Seek="{self.seek}'
        return (
            f'<DataItem Dimensions="{" ".join(map(str, self.shape))}" NumberType="{kind}" '
            f'Precision="{self.number.itemsize}" Format="{form}">{self.place}</DataItem>'
        )


class Values(NamedTuple):
    """A field of a grid by its name, of its cells or of its points."""

    name: str
    item: Item
    of_cells: bool = False

    def text(self) -> str:
        """The attribute of the grid."""
        kind = "Scalar" if len(self.item.shape) == 1 else "Vector"
        return (
            f'<Attribute Name="{self.name}" AttributeType="{kind}" '
            f'Center="{"Cell" if self.of_cells else "Node"}">{self.item.text()}</Attribute>'
        )


def grid(
    name: str, cells: Item, points: Item, values: Iterable[Values], time: float | None = None
) -> str:
    """A grid of cells (m, points of each) between points (n, 3), at a time [s] or at all times."""
    n, each = cells.shape
    return "\n".join(
        [
            f'<Grid Name="{name}" GridType="Uniform">'
            + ("" if time is None else f'<Time Value="{time!r}"/>'),
            f'<Topology TopologyType="{_CELLS[each]}" NodesPerElement="{each}" '
            f'NumberOfElements="{n}">{cells.text()}</Topology>',
            f'<Geometry GeometryType="XYZ">{points.text()}</Geometry>',
            *(one.text() for one in values),
            "</Grid>",
        ]
    )


def collection(name: str, grids: Iterable[str], kind: str = "Temporal") -> str:
    """Grids one after another in time, or beside each other if the ``kind`` is "Spatial"."""
    begin = f'<Grid Name="{name}" GridType="Collection" CollectionType="{kind}">'
    return "\n".join([begin, *grids, "</Grid>"])


def document(content: str) -> str:
    """A whole file."""
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<Xdmf Version="3.0">\n<Domain>'
    return f"{head}\n{content}\n</Domain>\n</Xdmf>\n"
