"""Writes what moves or stands beside the line: pantographs, contact forces, train, track.

XDMF files of one grid a time, with a common HDF5 file. Points are places at rest; a field
``displacement`` moves them, as in ``fields.xdmf``, so that one factor draws all motions larger.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.files.disk import appears_whole, open_to_write, write_whole
from catenary.postproc.film.beside_line import boxes, contacts, faces_of, rails
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.snapshots import Snapshots

NUMBERS, PANTOGRAPHS, FORCES, TRAIN, TRACK = (
    "scenery.h5", "pantographs.xdmf", "forces.xdmf", "train.xdmf", "track.xdmf",
)  # fmt: skip


def write(
    data: FilmData, pantographs: MovingPantographs, snapshots: Snapshots, folder: Path
) -> list[Path]:
    """Write the scenery of a run at the times of its snapshots. Not collective.

    Parameters
    ----------
    pantographs : where their points are
    snapshots : of the line
    folder : where the files go, which exists

    Returns
    -------
    The XDMF files; there is no train where an excitation stands for it.

    Raises
    ------
    OSError
        If they cannot be written.
    """
    grids: dict[str, list[str]] = {PANTOGRAPHS: [], FORCES: [], TRAIN: [], TRACK: []}
    with appears_whole(folder / NUMBERS) as part, open_to_write(part, "w") as file:
        points, cells = rails(data)
        lines = _topology("Polyline", _put(file, "track/cells", cells))
        grids[TRACK].append(_grid(lines, _put(file, "track/points", points)))
        numbered = _lines_of(pantographs)
        lines = _topology("Polyline", _put(file, "pantographs/cells", numbered[0]))
        of_lines = [
            _put(file, f"pantographs/{own}", numbered[k]) for k, own in ((1, "number"), (2, "kind"))
        ]
        faces = ""
        if data.excitation is None:
            n_coaches = len(boxes(data.position[0], pantographs.roof)) // 8
            corners = _put(file, "train/faces", faces_of(n_coaches).astype(np.int32))
            faces = _topology("Quadrilateral", corners)
        p = data.n_pantographs
        dots = f'<Topology TopologyType="Polyvertex" NumberOfElements="{p}" NodesPerElement="1"/>'
        for k, time in enumerate(snapshots.times.tolist()):
            row = data.row_at(time)
            poses = pantographs.poses(k)
            rest = np.concatenate([pose.rest for pose in poses])
            moved = np.concatenate([pose.now for pose in poses]) - rest
            at = f"pantographs/{k:06d}"
            fields = [_put(file, f"{at}/displacement", moved.astype("<f4"))]
            points_at = _put(file, f"{at}/points", rest)
            grids[PANTOGRAPHS].append(_grid(lines, points_at, fields, of_lines, time))
            heads, moved = contacts(data, row, functools.partial(snapshots.aside_at, k))
            force = np.zeros((p, 3), dtype="<f4")
            force[:, 2] = data.force[row]
            at = f"forces/{k:06d}"
            fields = [
                _put(file, f"{at}/displacement", moved.astype("<f4")),
                _put(file, f"{at}/force", force),
            ]
            grids[FORCES].append(_grid(dots, _put(file, f"{at}/points", heads), fields, (), time))
            if faces:
                corners = _put(file, f"train/{k:06d}", boxes(data.position[row], pantographs.roof))
                grids[TRAIN].append(_grid(faces, corners, time=time))
    written = [folder / name for name, own in grids.items() if own]
    for path in written:
        write_whole(path, _text(path.stem, grids[path.name]))
    return written


def _lines_of(pantographs: MovingPantographs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines of all pantographs, and of each the number of its pantograph and what it is of."""
    cells, number, kind, start = [], [], [], 0
    for p, shape in enumerate(pantographs.shapes):
        cells.append(shape.cells + start)
        number.append(np.full(len(shape.cells), p))
        kind.append(shape.kinds)
        start += int(shape.cells.max()) + 1
    return tuple(np.concatenate(part).astype(np.int32) for part in (cells, number, kind))  # type: ignore[return-value]


# ---- XDMF --------------------------------------------------------------------------------------


def _put(file: h5py.File, path: str, values: np.ndarray) -> h5py.Dataset:
    return file.create_dataset(path, data=values)


def _item(table: h5py.Dataset) -> str:
    number = "Int" if table.dtype.kind == "i" else "Float"
    return (
        f'<DataItem Dimensions="{" ".join(map(str, table.shape))}" NumberType="{number}" '
        f'Precision="{table.dtype.itemsize}" Format="HDF">{NUMBERS}:{table.name}</DataItem>'
    )


def _topology(kind: str, cells: h5py.Dataset) -> str:
    n, each = cells.shape
    return (
        f'<Topology TopologyType="{kind}" NodesPerElement="{each}" NumberOfElements="{n}">'
        f"{_item(cells)}</Topology>"
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
