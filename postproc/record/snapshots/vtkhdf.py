"""VTKHDF beside XDMF: the same snapshots as newer versions of ParaView read them.

A small file names the tables of ``fields.h5`` by links and says where in them each snapshot begins;
nothing is stored twice. It is written when a run ends, as the format has no place for snapshots to
come. Source: VTK's documentation, VTKHDF format specification, version 2.3: a partitioned data set
collection of unstructured grids with ``Steps``.
"""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.files.disk import appears_whole, open_to_write
from catenary.postproc.files.hdf5.array_writes import (
    group_in_order,
    put_array,
    put_attribute,
    whole_array,
)
from catenary.postproc.files.hdf5.checked import text_of
from catenary.postproc.record.snapshots.field_kinds import KINDS

SUFFIX = ".vtkhdf"
_VERSION = np.array([2, 3], dtype=np.int64)
_LINE = 3  # VTK's number of this cell


def write_vtkhdf(numbers: Path) -> Path:
    """Write the file beside that of the numbers, which is whole; returns its path.

    Not collective.

    Raises
    ------
    OSError, KeyError, ValueError
        If the numbers cannot be read, or the file not written.
    """
    path = numbers.with_suffix(SUFFIX)
    with h5py.File(numbers, "r", locking=False) as source, appears_whole(path) as part:
        times = whole_array(source, "times")
        times = times[np.isfinite(times)]
        # Readers go through links in the order in which they were made.
        with open_to_write(part, "w", track_order=True) as file:
            root = group_in_order(file, "VTKHDF")
            _name_type(root, "PartitionedDataSetCollection")
            assembly = group_in_order(root, "Assembly")
            for index, name in enumerate(json.loads(text_of(source.attrs["parts"]))):
                block = group_in_order(root, name)
                put_attribute(block, "Index", np.asarray(index))
                _write_block(block, source[name], numbers.name, times)
                assembly.id.links.create_soft(name.encode(), f"/VTKHDF/{name}".encode())
    return path


def _name_type(group: h5py.Group, name: str) -> None:
    put_attribute(group, "Version", _VERSION)
    kind = h5py.string_dtype("ascii", len(name))
    put_attribute(group, "Type", np.array(name.encode(), dtype=kind))


def _write_block(block: h5py.Group, source: h5py.Group, h5_name: str, times: np.ndarray) -> None:
    """A grid with links to the tables of a block."""
    n = times.size
    count = whole_array(source, "count")
    first, start = whole_array(source, "first")[:n], np.cumsum(count) - count
    cells = whole_array(source, "cells").astype(np.int64)
    # A part is a grid without its points: snapshots that are cut alike share one.
    cut = [whole_array(source, name)[:n] for name in ("cell_first", "cell_count")]
    parts, part_of = np.unique(np.column_stack([*cut, count[:n]]), axis=0, return_inverse=True)
    part_of = part_of.reshape(-1)
    n_cells = parts[:, 1]
    before = np.cumsum(n_cells) - n_cells
    own = [cells[begin : begin + size] for begin, size, _ in parts.tolist()]
    _name_type(block, "UnstructuredGrid")
    _link(block, h5_name, source, "points", "Points")
    _put_all(
        block,
        Connectivity=np.concatenate(own).ravel(),
        Offsets=np.concatenate([2 * np.arange(size + 1) for size in n_cells.tolist()]),
        Types=np.full(int(n_cells.sum()), _LINE, dtype=np.uint8),
        NumberOfPoints=parts[:, 2],
        NumberOfCells=n_cells,
        NumberOfConnectivityIds=2 * n_cells,
    )
    steps = group_in_order(block, "Steps")
    put_attribute(steps, "NSteps", np.asarray(n))
    _put_all(
        steps,
        Values=times,
        PartOffsets=part_of.astype(np.int64),
        NumberOfParts=np.ones(n, dtype=np.int64),
        PointOffsets=first,
        CellOffsets=before[part_of].reshape(-1, 1),
        ConnectivityIdOffsets=2 * before[part_of].reshape(-1, 1),
    )
    groups = {
        kind: (group_in_order(block, f"{kind}Data"), group_in_order(steps, f"{kind}DataOffsets"))
        for kind in ("Point", "Cell")
    }
    for name, kind in KINDS.items():
        if name not in source:
            continue
        values, offsets = groups["Cell" if kind.of_droppers else "Point"]
        _link(values, h5_name, source, name, name)
        put_array(offsets, name, kind.values_of(start[:n]))


def _put_all(group: h5py.Group, **arrays: np.ndarray) -> None:
    for name, values in arrays.items():
        put_array(group, name, values)


def _link(group: h5py.Group, h5_name: str, source: h5py.Group, table: str, name: str) -> None:
    """Let ``name`` be a table of the file of the numbers."""
    place = f"{source.name}/{table}"
    group.id.links.create_external(name.encode(), h5_name.encode(), place.encode())
