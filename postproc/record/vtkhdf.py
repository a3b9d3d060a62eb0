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

from catenary.postproc.files.checked import text_of
from catenary.postproc.files.disk import appears_whole
from catenary.postproc.record.field_kinds import KINDS

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
    with h5py.File(numbers, "r") as source, appears_whole(path) as part:
        times = source["times"][...]
        times = times[np.isfinite(times)]
        # Readers go through links in the order in which they were made.
        with h5py.File(part, "w", track_order=True) as file:
            root = file.create_group("VTKHDF", track_order=True)
            _name_type(root, "PartitionedDataSetCollection")
            assembly = root.create_group("Assembly", track_order=True)
            for index, name in enumerate(json.loads(text_of(source.attrs["parts"]))):
                block = root.create_group(name, track_order=True)
                block.attrs["Index"] = index
                _write_block(block, source[name], numbers.name, times)
                assembly[name] = h5py.SoftLink(f"/VTKHDF/{name}")
    return path


def _name_type(group: h5py.Group, name: str) -> None:
    group.attrs["Version"] = _VERSION
    kind = h5py.string_dtype("ascii", len(name))
    group.attrs.create("Type", np.array(name.encode(), dtype=kind))


def _write_block(block: h5py.Group, source: h5py.Group, h5_name: str, times: np.ndarray) -> None:
    """A grid with links to the tables of a block."""
    n = times.size
    first, count = source["first"][:n], source["count"][:n]
    start = np.cumsum(source["count"][...]) - source["count"][...]
    cells = source["cells"][...].astype(np.int64)
    # A part is a grid without its points: snapshots that are cut alike share one.
    cut = np.column_stack([source["cell_first"][:n], source["cell_count"][:n], count])
    parts, part_of = np.unique(cut, axis=0, return_inverse=True)
    part_of = part_of.reshape(-1)
    n_cells = parts[:, 1]
    before = np.cumsum(n_cells) - n_cells
    _name_type(block, "UnstructuredGrid")
    block["Points"] = h5py.ExternalLink(h5_name, f"{source.name}/points")
    own = [cells[begin : begin + size] for begin, size, _ in parts.tolist()]
    block["Connectivity"] = np.concatenate(own).ravel()
    block["Offsets"] = np.concatenate([2 * np.arange(size + 1) for size in n_cells.tolist()])
    block["Types"] = np.full(int(n_cells.sum()), _LINE, dtype=np.uint8)
    block["NumberOfPoints"] = parts[:, 2]
    block["NumberOfCells"], block["NumberOfConnectivityIds"] = n_cells, 2 * n_cells
    steps = block.create_group("Steps", track_order=True)
    steps.attrs["NSteps"] = n
    steps["Values"] = times
    steps["PartOffsets"] = part_of.astype(np.int64)
    steps["NumberOfParts"] = np.ones(n, dtype=np.int64)
    steps["PointOffsets"] = first
    steps["CellOffsets"] = before[part_of].reshape(-1, 1)
    steps["ConnectivityIdOffsets"] = 2 * before[part_of].reshape(-1, 1)
    groups = {
        kind: (
            block.create_group(f"{kind}Data", track_order=True),
            steps.create_group(f"{kind}DataOffsets", track_order=True),
        )
        for kind in ("Point", "Cell")
    }
    for name, kind in KINDS.items():
        if name not in source:
            continue
        values, offsets = groups["Cell" if kind.of_droppers else "Point"]
        values[name] = h5py.ExternalLink(h5_name, f"{source.name}/{name}")
        offsets[name] = start[:n] // 2 if kind.of_droppers else start[:n]
