"""The XDMF text of snapshots that appear one after another, and is well-formed after each of them.

The text names all snapshots that are planned from the start on. Those that are not there yet stand
in a section of plain text (CDATA), which readers pass over. Its begin moves over each snapshot that
appears: two writes of a few bytes, whatever the length of the text. Between the two the mark of the
later place is plain text itself, so that a kill leaves a text that can be read.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import numpy as np

from catenary.postproc.files.disk import write_at, write_whole

_HIDE, _END = b"<![CDATA[", b"]]>"
_SHOW = b" " * len(_HIDE)


class GrowingXdmf:
    """An XDMF 3 file with a grid for each snapshot. Not collective.

    Parameters
    ----------
    path : the file, which is written at once and takes the place of another
    h5_name : file of the numbers, relative to it
    n_nodes, n_cells : of the mesh
    times : of all snapshots that are planned [s]
    n_shown : how many of them are there

    Raises
    ------
    OSError
        If it cannot be written.
    """

    def __init__(
        self,
        path: Path,
        h5_name: str,
        n_nodes: int,
        n_cells: int,
        times: list[float],
        n_shown: int,
    ) -> None:
        self._path, self._n_shown = path, n_shown
        mesh = _mesh(h5_name, n_nodes, n_cells)
        self._grids = [
            _grid(h5_name, mesh, n_nodes, number, time).encode()
            for number, time in enumerate(times)
        ]
        pieces, at = [_BEGIN], len(_BEGIN)
        self._marks = []
        for number in range(len(times) + 1):
            self._marks.append(at)
            grid = self._grids[number] if number < len(times) else b""
            pieces += [_HIDE if number == n_shown else _SHOW, b"\n", grid]
            at += len(_HIDE) + 1 + len(grid)
        write_whole(path, b"".join([*pieces, _END, _CLOSE]))
        self._handle = os.open(path, os.O_WRONLY)

    def show(self, n_shown: int) -> None:
        """Let the first ``n_shown`` snapshots be there, not fewer than before; OSError if not."""
        if n_shown == self._n_shown:
            return
        for number, mark in ((n_shown, _HIDE), (self._n_shown, _SHOW)):
            write_at(self._handle, self._marks[number], np.frombuffer(mark, dtype=np.uint8))
        self._n_shown = n_shown

    def close(self) -> None:
        """Close the file, written anew without what never appeared if there is room for it."""
        os.close(self._handle)
        with contextlib.suppress(OSError):
            write_whole(self._path, b"".join([_BEGIN, *self._grids[: self._n_shown], _CLOSE]))


_BEGIN = b"""\
<?xml version="1.0" encoding="UTF-8"?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="line" GridType="Collection" CollectionType="Temporal">
"""
_CLOSE = b"    </Grid>\n  </Domain>\n</Xdmf>\n"


def snapshot_name(number: int) -> str:
    """Name of the dataset of a snapshot in its group."""
    return f"{number:06d}"


def _mesh(h5_name: str, n_nodes: int, n_cells: int) -> str:
    return f"""\
        <Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="{n_cells}">
          <DataItem Dimensions="{n_cells} 2" NumberType="Int" Precision="4" Format="HDF">\
{h5_name}:/mesh/cells</DataItem>
        </Topology>
        <Geometry GeometryType="XYZ">
          <DataItem Dimensions="{n_nodes} 3" NumberType="Float" Precision="8" Format="HDF">\
{h5_name}:/mesh/points</DataItem>
        </Geometry>
        <Attribute Name="component" AttributeType="Scalar" Center="Cell">
          <DataItem Dimensions="{n_cells}" NumberType="Int" Precision="4" Format="HDF">\
{h5_name}:/mesh/component</DataItem>
        </Attribute>
"""


def _grid(h5_name: str, mesh: str, n_nodes: int, number: int, time: float) -> str:
    fields = (("uplift", "Scalar", f"{n_nodes}"), ("displacement", "Vector", f"{n_nodes} 3"))
    own = "".join(_node_attribute(*field, h5_name, number) for field in fields)
    return (
        f'      <Grid Name="line" GridType="Uniform">\n        <Time Value="{time!r}"/>\n'
        f"{mesh}{own}      </Grid>\n"
    )


def _node_attribute(name: str, kind: str, dimensions: str, h5_name: str, number: int) -> str:
    return f"""\
        <Attribute Name="{name}" AttributeType="{kind}" Center="Node">
          <DataItem Dimensions="{dimensions}" NumberType="Float" Precision="4" Format="HDF">\
{h5_name}:/{name}/{snapshot_name(number)}</DataItem>
        </Attribute>
"""
