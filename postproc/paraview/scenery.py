"""Writes what moves or stands beside the line: pantographs, contact forces, track.

XDMF files of one grid a time, with a common HDF5 file. Points are places at rest; a field
``uplift`` moves them, as in ``fields.xdmf``, so that one factor draws all motions larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import BELOW_HEAD, shape

NUMBERS, PANTOGRAPHS, FORCES, SURROUNDINGS = (
    "scenery.h5", "pantographs.xdmf", "forces.xdmf", "surroundings.xdmf",
)  # fmt: skip
# Foot, knee and hinge of the arms, and the ends of the head: how far each moves with the head.
_SHARES = np.array([0.0, 0.5, 1.0, 1.0, 1.0])
_CELLS = np.array([[0, 1], [1, 2], [3, 4]], dtype=np.int32)
# Half the distance of the rails [m].
_HALF_GAUGE = 0.75


@dataclass(frozen=True)
class Scenery:
    """Files that were written.

    Attributes
    ----------
    pantographs, forces, surroundings : XDMF files
    """

    pantographs: Path
    forces: Path
    surroundings: Path


def write(data: FilmData, times: np.ndarray, folder: Path) -> Scenery:
    """Write the scenery of a run at some times. Not collective.

    Parameters
    ----------
    times : (n,) of the snapshots of the line [s]
    folder : where the files go, which exists

    Raises
    ------
    OSError
        If they cannot be written.
    """
    p = data.n_pantographs
    points, cells = track(data)
    with h5py.File(folder / NUMBERS, "w") as file:
        file["surroundings/points"], file["surroundings/cells"] = points, cells
        file["pantographs/cells"] = np.concatenate([_CELLS + 5 * i for i in range(p)])
        file["pantographs/number"] = np.repeat(np.arange(p, dtype=np.int32), len(_CELLS))
        for number, time in enumerate(times.tolist()):
            row, name = data.row_at(time), snapshot_name(number)
            where, uplift = pantographs(data, row)
            file[f"pantographs/points/{name}"] = where
            file[f"pantographs/uplift/{name}"] = uplift.astype("<f4")
            file[f"forces/points/{name}"] = where[2::5]
            file[f"forces/uplift/{name}"] = uplift[2::5].astype("<f4")
            force = np.zeros((p, 3), dtype="<f4")
            force[:, 2] = data.force[row]
            file[f"forces/force/{name}"] = force
    files = Scenery(folder / PANTOGRAPHS, folder / FORCES, folder / SURROUNDINGS)
    lines = _lines("pantographs/cells", len(_CELLS) * p)
    number_of = _field("number", "Scalar", "Cell", f"{len(_CELLS) * p}", "pantographs/number", True)
    _write_text(
        files.pantographs,
        [
            (time, lines, _points(f"pantographs/points/{name}", 5 * p), number_of
             + _field("uplift", "Scalar", "Node", f"{5 * p}", f"pantographs/uplift/{name}"))
            for name, time in _named(times)
        ],
    )  # fmt: skip
    dots = f'<Topology TopologyType="Polyvertex" NumberOfElements="{p}" NodesPerElement="1"/>'
    _write_text(
        files.forces,
        [
            (time, dots, _points(f"forces/points/{name}", p),
             _field("uplift", "Scalar", "Node", f"{p}", f"forces/uplift/{name}")
             + _field("force", "Vector", "Node", f"{p} 3", f"forces/force/{name}"))
            for name, time in _named(times)
        ],
    )  # fmt: skip
    standing = _lines("surroundings/cells", len(cells))
    place = _points("surroundings/points", len(points))
    _write_text(files.surroundings, [(None, standing, place, "")])
    return files


def pantographs(data: FilmData, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of all pantographs under a line at rest (5 p, 3) [m], and their uplift (5 p,) [m]."""
    rest = data.rest_height(data.position[row])
    points, uplift = [], []
    for x, height, head in zip(data.position[row], rest, data.head_height[row], strict=True):
        arms, ends = shape(float(height), _foot(data))
        xz = np.concatenate([arms, ends])
        points.append(np.column_stack([x + xz[:, 0], np.zeros(5), xz[:, 1]]))
        uplift.append(_SHARES * (head - height))
    return np.concatenate(points), np.concatenate(uplift)


def _foot(data: FilmData) -> float:
    """Height of the foot of the pantographs' arms [m]."""
    nodes = data.wires[data.contact]
    return float(np.median(data.points[nodes, 2])) - BELOW_HEAD


def track(data: FilmData) -> tuple[np.ndarray, np.ndarray]:
    """Points (4, 3) [m] and lines (2, 2) of the rails, from end to end of the line."""
    ends = (float(data.points[:, 0].min()), float(data.points[:, 0].max()))
    rails = [[at, side, 0.0] for side in (-_HALF_GAUGE, _HALF_GAUGE) for at in ends]
    return np.array(rails), np.array([[0, 1], [2, 3]], dtype=np.int32)


# ---- XDMF --------------------------------------------------------------------------------------


def snapshot_name(number: int) -> str:
    """Name of the dataset of a snapshot in its group."""
    return f"{number:06d}"


def _named(times: np.ndarray) -> list[tuple[str, float]]:
    return [(snapshot_name(number), time) for number, time in enumerate(times.tolist())]


def _item(path: str, dimensions: str, whole: bool = False, precision: int = 4) -> str:
    number = "Int" if whole else "Float"
    return (
        f'<DataItem Dimensions="{dimensions}" NumberType="{number}" Precision="{precision}" '
        f'Format="HDF">{NUMBERS}:/{path}</DataItem>'
    )


def _lines(path: str, n: int) -> str:
    return (
        f'<Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="{n}">'
        f"{_item(path, f'{n} 2', True)}</Topology>"
    )


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
    path.write_text("".join(text), encoding="utf-8")
