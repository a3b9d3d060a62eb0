"""Writes what moves or stands beside the line: pantographs, contact forces, train, track.

XDMF files of one grid a time, with a common HDF5 file. Points are places at rest; a field
``displacement`` moves them, as in ``fields.xdmf``, so that one factor draws all motions larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catenary.postproc.files.disk import appears_whole, open_to_write, write_whole
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.train import FACES, boxes

NUMBERS, PANTOGRAPHS, FORCES, TRAIN, TRACK = (
    "scenery.h5", "pantographs.xdmf", "forces.xdmf", "train.xdmf", "track.xdmf",
)  # fmt: skip
# Half the distance of the rails [m].
_HALF_GAUGE = 0.75


@dataclass(frozen=True)
class Scenery:
    """Files that were written, XDMF all of them; no train where an excitation stands for it."""

    pantographs: Path
    forces: Path
    track: Path
    train: Path | None

    @property
    def files(self) -> list[Path]:
        """All of them."""
        train = [] if self.train is None else [self.train]
        return [self.pantographs, self.forces, *train, self.track]


def write(
    data: FilmData, pantographs: MovingPantographs, snapshots: Snapshots, folder: Path
) -> Scenery:
    """Write the scenery of a run at some times. Not collective.

    Parameters
    ----------
    pantographs : where their points are
    snapshots : of the line
    folder : where the files go, which exists

    Raises
    ------
    OSError
        If they cannot be written.
    """
    p, times = data.n_pantographs, snapshots.times
    rails, lines_of_rails = track(data)
    cells, number, kind = _lines_of(pantographs)
    n_points = sum(int(shape.cells.max()) + 1 for shape in pantographs.shapes)
    has_train = data.excitation is None
    n_corners = len(boxes(data.position[0], pantographs.roof))
    with appears_whole(folder / NUMBERS) as part, open_to_write(part, "w") as file:
        file["track/points"], file["track/cells"] = rails, lines_of_rails
        file["pantographs/cells"] = cells
        file["pantographs/number"], file["pantographs/kind"] = number, kind
        starts = 8 * np.arange(n_corners // 8)[:, None, None]
        if has_train:
            file["train/faces"] = (starts + FACES).reshape(-1, 4).astype(np.int32)
        for k, time in enumerate(times.tolist()):
            row, name = data.row_at(time), _name(k)
            poses = pantographs.poses(k)
            rest = np.concatenate([pose.rest for pose in poses])
            moved = np.concatenate([pose.now for pose in poses]) - rest
            file[f"pantographs/points/{name}"] = rest
            file[f"pantographs/displacement/{name}"] = moved.astype("<f4")
            heads = _contacts(data, snapshots, k, row)
            file[f"forces/points/{name}"] = heads[0]
            file[f"forces/displacement/{name}"] = heads[1].astype("<f4")
            force = np.zeros((p, 3), dtype="<f4")
            force[:, 2] = data.force[row]
            file[f"forces/force/{name}"] = force
            if has_train:
                file[f"train/points/{name}"] = boxes(data.position[row], pantographs.roof)
    train = folder / TRAIN if has_train else None
    files = Scenery(folder / PANTOGRAPHS, folder / FORCES, folder / TRACK, train)
    of_cell = "".join(
        _field(name, "Scalar", "Cell", f"{len(cells)}", f"pantographs/{name}", True)
        for name in ("number", "kind")
    )
    lines = _cells("Polyline", "pantographs/cells", len(cells), 2)
    dots = f'<Topology TopologyType="Polyvertex" NumberOfElements="{p}" NodesPerElement="1"/>'
    faces = _cells("Quadrilateral", "train/faces", 6 * n_corners // 8, 4)
    grids = [[], [], []]  # type: list[list[tuple[float | None, str, str, str]]]
    for k, time in enumerate(times.tolist()):
        name = _name(k)
        places = _points(f"pantographs/points/{name}", n_points)
        grids[0].append((time, lines, places, of_cell + _vector("pantographs", name, n_points)))
        force_at = _field("force", "Vector", "Node", f"{p} 3", f"forces/force/{name}")
        places = _points(f"forces/points/{name}", p)
        grids[1].append((time, dots, places, _vector("forces", name, p) + force_at))
        grids[2].append((time, faces, _points(f"train/points/{name}", n_corners), ""))
    for path, own in zip((files.pantographs, files.forces, files.train), grids, strict=True):
        if path is not None:
            _write_text(path, own)
    standing = _cells("Polyline", "track/cells", 2, 2)
    _write_text(files.track, [(None, standing, _points("track/points", 4), "")])
    return files


def _contacts(data: FilmData, snapshots: Snapshots, number: int, row: int) -> np.ndarray:
    """Where the wires above the heads rest, and how far the heads, and sideways the wires, have
    moved from there, (2, p, 3) [m]."""
    heads = np.zeros((2, data.n_pantographs, 3))
    heads[0, :, 0] = data.position[row]
    heads[0, :, 2] = data.rest_height(data.position[row])
    heads[1, :, 2] = data.head_height[row] - heads[0, :, 2]
    for p, x in enumerate(data.position[row].tolist()):
        wire = data.touched(x)
        at = data.points[data.wires[wire]]
        heads[0, p, 1] = np.interp(x, at[:, 0], at[:, 1])
        heads[1, p, 1] = snapshots.aside_at(number, wire, x)
    return heads


def _lines_of(pantographs: MovingPantographs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines of all pantographs, and of each the number of its pantograph and what it is of."""
    cells, number, kind, start = [], [], [], 0
    for p, shape in enumerate(pantographs.shapes):
        cells.append(shape.cells + start)
        number.append(np.full(len(shape.cells), p))
        kind.append(shape.kinds)
        start += int(shape.cells.max()) + 1
    return tuple(np.concatenate(part).astype(np.int32) for part in (cells, number, kind))  # type: ignore[return-value]


def track(data: FilmData) -> tuple[np.ndarray, np.ndarray]:
    """Points (4, 3) [m] and lines (2, 2) of the rails, from end to end of the line."""
    ends = (float(data.points[:, 0].min()), float(data.points[:, 0].max()))
    rails = [[at, side, 0.0] for side in (-_HALF_GAUGE, _HALF_GAUGE) for at in ends]
    return np.array(rails), np.array([[0, 1], [2, 3]], dtype=np.int32)


# ---- XDMF --------------------------------------------------------------------------------------


def _name(number: int) -> str:
    """Name of the tables of a snapshot."""
    return f"{number:06d}"


def _item(path: str, dimensions: str, whole: bool = False, precision: int = 4) -> str:
    number = "Int" if whole else "Float"
    return (
        f'<DataItem Dimensions="{dimensions}" NumberType="{number}" Precision="{precision}" '
        f'Format="HDF">{NUMBERS}:/{path}</DataItem>'
    )


def _cells(kind: str, path: str, n: int, each: int) -> str:
    return (
        f'<Topology TopologyType="{kind}" NodesPerElement="{each}" NumberOfElements="{n}">'
        f"{_item(path, f'{n} {each}', True)}</Topology>"
    )


def _vector(of: str, name: str, n: int) -> str:
    path = f"{of}/displacement/{name}"
    return _field("displacement", "Vector", "Node", f"{n} 3", path)


def _points(path: str, n: int) -> str:
    return f'<Geometry GeometryType="XYZ">{_item(path, f"{n} 3", precision=8)}</Geometry>'


def _field(
    name: str, kind: str, center: str, dimensions: str, path: str, whole: bool = False
) -> str:
    item = _item(path, dimensions, whole)
    return f'<Attribute Name="{name}" AttributeType="{kind}" Center="{center}">{item}</Attribute>'


def _write_text(path: Path, grids: list[tuple[float | None, str, str, str]]) -> None:
    """Write grids of (time or None, topology, geometry, fields) as one file."""
    text = ['<?xml version="1.0" encoding="UTF-8"?>\n<Xdmf Version="3.0">\n<Domain>\n']
    in_time = grids[0][0] is not None
    if in_time:
        text.append(f'<Grid Name="{path.stem}" GridType="Collection" CollectionType="Temporal">\n')
    for time, *parts in grids:
        at = "" if time is None else f'<Time Value="{time!r}"/>'
        body = "\n".join(parts)
        text.append(f'<Grid Name="{path.stem}" GridType="Uniform">{at}\n{body}\n</Grid>\n')
    text.append(("</Grid>\n" if in_time else "") + "</Domain>\n</Xdmf>\n")
    write_whole(path, "".join(text))
