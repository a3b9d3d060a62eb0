"""Writes what moves or stands beside the line: pantographs, contact forces, train, track.

XDMF files of one grid a time, with a common HDF5 file. Points are places at rest; a field
``displacement`` moves them, as in ``fields.xdmf``, so that one factor draws all motions larger.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.files.disk import write_whole
from catenary.postproc.film.scenery import FORCES, Scenery
from catenary.postproc.film.snapshots import Snapshots

_NUMBERS = "scenery.h5"
_CELLS = {1: "Polyvertex", 2: "Polyline", 4: "Quadrilateral"}


def write(scenery: Scenery, snapshots: Snapshots, folder: Path) -> dict[str, Path]:
    """Write the parts beside the line at the times of the snapshots. Not collective.

    Parameters
    ----------
    scenery : Scenery
        Scenery of the run.
    snapshots : Snapshots
        Snapshots of the line.
    folder : Path
        Existing folder to which the files go.

    Returns
    -------
    The XDMF file of each part by its name.

    Raises
    ------
    OSError
        If they cannot be written.
    """
    data, grids = scenery.data, {name: list[str]() for name in scenery.parts}
    # In memory: HDF5 crashes the interpreter at its end where a disk has refused a write.
    with h5py.File(_NUMBERS, "w", driver="core", backing_store=False) as file:
        still = {
            name: (
                _topology(_put(file, f"{name}/cells", part.cells.astype(np.int32))),
                [_put(file, f"{name}/{own}", values.astype(np.int32))
                 for own, values in part.fields.items()],
            )
            for name, part in scenery.parts.items()
        }  # fmt: skip
        for k, time in enumerate(snapshots.times.tolist()):
            for name, (rest, moved) in scenery.beside(time, snapshots.frame(time)).items():
                moves, (topology, of_cells) = scenery.parts[name].moves, still[name]
                if k and not moves:
                    continue
                at = f"{name}/{k:06d}"
                fields = [_put(file, f"{at}/displacement", moved.astype("<f4"))]
                if name == FORCES:
                    force = np.zeros((data.n_pantographs, 3), dtype="<f4")
                    force[:, 2] = data.force[data.row_at(time)]
                    fields.append(_put(file, f"{at}/force", force))
                points = _put(file, f"{at}/points", rest)
                grids[name].append(
                    _grid(topology, points, fields, of_cells, time if moves else None)
                )
        file.flush()
        write_whole(folder / _NUMBERS, bytes(file.id.get_file_image()))
    files = {name: folder / f"{name}.xdmf" for name in grids}
    for name, path in files.items():
        write_whole(path, _text(name, grids[name]))
    return files


# ---- XDMF --------------------------------------------------------------------------------------


def _put(file: h5py.File, path: str, values: np.ndarray) -> h5py.Dataset:
    return file.create_dataset(path, data=values)


def _item(table: h5py.Dataset) -> str:
    number = "Int" if table.dtype.kind == "i" else "Float"
    return (
        f'<DataItem Dimensions="{" ".join(map(str, table.shape))}" NumberType="{number}" '
        f'Precision="{table.dtype.itemsize}" Format="HDF">{_NUMBERS}:{table.name}</DataItem>'
    )


def _topology(cells: h5py.Dataset) -> str:
    n, each = cells.shape
    return (
        f'<Topology TopologyType="{_CELLS[each]}" NodesPerElement="{each}" '
        f'NumberOfElements="{n}">{_item(cells)}</Topology>'
    )


def _grid(
    topology: str,
    points: h5py.Dataset,
    of_nodes: Iterable[h5py.Dataset] = (),
    of_cells: Iterable[h5py.Dataset] = (),
    time: float | None = None,
) -> str:
    """Text of a grid, with fields named as their tables are."""
    at = "" if time is None else f'<Time Value="{time!r}"/>'
    parts = [at, topology, f'<Geometry GeometryType="XYZ">{_item(points)}</Geometry>']
    for center, tables in (("Node", of_nodes), ("Cell", of_cells)):
        for table in tables:
            name, kind = Path(table.name).name, "Scalar" if table.ndim == 1 else "Vector"
            parts.append(
                f'<Attribute Name="{name}" AttributeType="{kind}" Center="{center}">'
                f"{_item(table)}</Attribute>"
            )
    return "\n".join(parts)


def _text(name: str, grids: list[str]) -> str:
    """A file of grids, of which several are one after another in time."""
    whole = [f'<Grid Name="{name}" GridType="Uniform">{grid}\n</Grid>' for grid in grids]
    if len(grids) > 1:
        begin = f'<Grid Name="{name}" GridType="Collection" CollectionType="Temporal">'
        whole = [begin, *whole, "</Grid>"]
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<Xdmf Version="3.0">\n<Domain>'
    return "\n".join([head, *whole, "</Domain>\n</Xdmf>\n"])
