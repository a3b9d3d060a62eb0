"""The XDMF text of snapshots that appear one after another, and is well-formed after each of them.

The text names all snapshots that are planned from the start on, block by block. Those that are not
there yet stand in a section of plain text (CDATA), which readers pass over. Its begin moves over
each snapshot that appears: two writes of a few bytes a block, whatever the length of the text.
Between the two the mark of the later place is plain text itself, so that a kill leaves a text that
can be read.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from catenary.postproc.files.disk import write_at, write_whole
from catenary.postproc.record.snapshots.field_layout import Slots

_HIDE, _END = b"<![CDATA[", b"]]>"
_SHOW = b" " * len(_HIDE)
_BEGIN = b"""\
<?xml version="1.0" encoding="UTF-8"?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="line" GridType="Collection" CollectionType="Spatial">
"""
_CLOSE = b"    </Grid>\n  </Domain>\n</Xdmf>\n"
_BLOCK_CLOSE = b"      </Grid>\n"
# Readers take the numbers from their places in the file, as they stand there.
_KINDS = {
    "<f4": ("Float", 4), "<f8": ("Float", 8), "<i4": ("Int", 4), "|i1": ("Char", 1),
}  # fmt: skip


class GrowingXdmf:
    """An XDMF 3 file with a series of grids for each block. Not collective.

    Parameters
    ----------
    path : the file, which is written at once and takes the place of another
    blocks : name of each block -> the text of its grids, one for each planned snapshot
    n_shown : how many snapshots are there

    Raises
    ------
    OSError
        If it cannot be written.
    """

    def __init__(self, path: Path, blocks: Mapping[str, list[str]], n_shown: int) -> None:
        self._path, self._n_shown = path, n_shown
        self._blocks = {name: [grid.encode() for grid in grids] for name, grids in blocks.items()}
        pieces, at = [_BEGIN], len(_BEGIN)
        self._marks: list[list[int]] = []
        for name, grids in self._blocks.items():
            marks = []
            pieces.append(_block_begin(name))
            at += len(pieces[-1])
            for number in range(len(grids) + 1):
                marks.append(at)
                grid = grids[number] if number < len(grids) else b""
                pieces += [_HIDE if number == n_shown else _SHOW, b"\n", grid]
                at += len(_HIDE) + 1 + len(grid)
            pieces += [_END, _BLOCK_CLOSE]
            at += len(_END) + len(_BLOCK_CLOSE)
            self._marks.append(marks)
        write_whole(path, b"".join([*pieces, _CLOSE]))
        self._handle = os.open(path, os.O_WRONLY)

    def show(self, n_shown: int) -> None:
        """Show the first ``n_shown`` snapshots, not fewer than before; OSError if not."""
        if n_shown == self._n_shown:
            return
        for marks in self._marks:
            for number, mark in ((n_shown, _HIDE), (self._n_shown, _SHOW)):
                write_at(self._handle, marks[number], np.frombuffer(mark, dtype=np.uint8))
        self._n_shown = n_shown

    def close(self) -> None:
        """Close the file, written anew without what never appeared if there is room for it."""
        os.close(self._handle)
        pieces = [_BEGIN]
        for name, grids in self._blocks.items():
            pieces += [_block_begin(name), *grids[: self._n_shown], _BLOCK_CLOSE]
        with contextlib.suppress(OSError):
            write_whole(self._path, b"".join([*pieces, _CLOSE]))


def _block_begin(name: str) -> bytes:
    return f'      <Grid Name="{name}" GridType="Collection" CollectionType="Temporal">\n'.encode()


def grids_of(
    slots: Slots, times: list[float], h5_name: str, offsets: Mapping[str, int]
) -> list[str]:
    """The grids of a block at ``times`` [s].

    Parameters
    ----------
    slots : Slots
        Layout of the block in the file.
    times : list of float
        Times of the snapshots [s].
    h5_name : str
        File of the numbers, relative to that of the text.
    offsets : mapping
        Place in that file at which each table of the block begins, by name [B].
    """
    # Grids differ in numbers only: one text for all, into which these are put.
    moves = bool(np.ptp(slots.first) or np.ptp(slots.count))
    file, block = h5_name.replace("%", "%%"), slots.name.replace("%", "%%")
    # The XDMF reader takes a mesh for the one before if its items begin alike.
    name, numbers = (f"<!-- %d -->{file}", (np.arange(len(times)),)) if moves else (file, ())
    cells, of_cells = _items((2,), "<i4", offsets["cells"], slots.cell_count, slots.cell_first)
    places, of_places = _items((3,), "<f8", offsets["points"], slots.count, slots.first)
    text = (
        f'<Grid Name="{block}" GridType="Uniform"><Time Value="%r"/>\n'
        '<Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="%d">'
        f"{cells}{name}</DataItem></Topology>\n"
        f'<Geometry GeometryType="XYZ">{places}{name}</DataItem></Geometry>\n'
    )
    columns = [slots.cell_count, *of_cells, *numbers, *of_places, *numbers]
    for kind in slots.kinds:
        width = () if kind.components == 1 else (kind.components,)
        n_values = kind.values_of(slots.count)
        start = kind.values_of(slots.start[:-1])
        values, of_values = _items(width, kind.number, offsets[kind.name], n_values, start)
        text += (
            f'<Attribute Name="{kind.name}" '
            f'AttributeType="{"Scalar" if kind.components == 1 else "Vector"}" '
            f'Center="{"Cell" if kind.of_droppers else "Node"}">'
            f"{values}{file}</DataItem></Attribute>\n"
        )
        columns += of_values
    text += "</Grid>\n"
    rows = zip(times, *(column[: len(times)].tolist() for column in columns), strict=True)
    return [text % row for row in rows]


def _items(
    width: tuple[int, ...], number: str, offset: int, count: np.ndarray, row: np.ndarray
) -> tuple[str, list[np.ndarray]]:
    """Text up to the file's name of items with ``count`` rows each, from number ``row`` on, of a
    table that begins at ``offset`` in the file; and the numbers that go into it, item by item."""
    name, size = _KINDS[number]
    text = (
        f'<DataItem Dimensions="{" ".join(["%d", *map(str, width)])}" NumberType="{name}" '
        f'Precision="{size}" Format="Binary" Endian="Little" Seek="%d">'
    )
    return text, [count, offset + row * (math.prod(width) * size)]
