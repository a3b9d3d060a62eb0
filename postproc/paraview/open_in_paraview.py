"""Writes the script that opens a run in ParaView, and what it shows beside the line."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.shape import BODY, HEAD, SPRING, Shape
from catenary.postproc.files.disk import write_whole
from catenary.postproc.film.film_data import FilmData, film_data
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.projection import Picture, room_above
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.view import View
from catenary.postproc.paraview import scenery
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results

SCRIPT, FOLDER = "view.py", "paraview"
_TEMPLATE = "view.py.template"
# Line in the window beside one pantograph [m], width over height of the window, and the share of
# the room above the contact wire that the arrow of a mean force fills.
_THICK = ((BODY, 1.4), (HEAD, 2.0), (SPRING, 0.5))
_WIDTH, _ASPECT, _ARROW = 110.0, 1280.0 / 480.0, 0.4


def write_script(
    folder: Path,
    records: Records | None,
    motion: float | None = None,
    shapes: Sequence[Shape] | None = None,
    look: View = View.SIDE,
) -> list[Path]:
    """Write ``paraview/view.py`` and its data into the folder of a run. Not collective.

    Parameters
    ----------
    records : what ``guard.examined`` found in the result file
    motion : factor by which motions are drawn larger, None for one that fits
    shapes : of the pantographs, None for a schematic
    look : where it is looked at from

    Raises
    ------
    InputError
        If the folder holds no run with snapshots, or cannot be written to.
    """
    target = folder / FOLDER
    with Results(folder, records) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            pantographs = MovingPantographs(data, snapshots, shapes)
            settings = _settings(folder, data, snapshots, motion, pantographs, look)
            if target.is_symlink():
                raise InputError(f"{target} is a link, through which nothing is written; remove it")
            try:
                target.mkdir(exist_ok=True)
                files = scenery.write(data, pantographs, snapshots, target)
                write_whole(target / SCRIPT, _script(settings))
            except OSError as error:
                raise InputError(f"{target} cannot be written: {error}") from error
    return [target / SCRIPT, *files]


def _script(settings: dict[str, object]) -> str:
    template = resources.files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    # Text of strangers, such as names, stays text: JSON's notation of it is Python's as well.
    return template.replace("@SETTINGS@", json.dumps(settings, indent=4))


def _settings(
    folder: Path,
    data: FilmData,
    snapshots: Snapshots,
    motion: float | None,
    pantographs: MovingPantographs,
    look: View,
) -> dict[str, object]:
    """All numbers of the script."""
    times = snapshots.times
    width = _WIDTH + 1.1 * float(np.ptp(data.position[0]))
    low, high = pantographs.roof - 0.4, float(data.points[:, 2].max()) + 0.6
    picture = Picture(look, width, _ASPECT, low, high)
    numbers = np.arange(times.size)
    scale = picture.scale(data, snapshots, numbers, motion)
    colours = picture.colours(snapshots, numbers)
    # A blow is over soon: its largest force, not its mean, is to fit.
    usual = data.force.mean() if data.excitation is None else np.abs(data.force).max()
    arrow = _ARROW * scale.size * room_above(data) / max(float(usual), 1.0)
    first = data.row_at(float(times[0]))
    kinds = {int(kind) for shape in pantographs.shapes for kind in shape.kinds}
    return {
        "folder": str((folder / FOLDER).absolute()),
        "line": "../fields.xdmf",
        "pantographs": scenery.PANTOGRAPHS,
        "forces": scenery.FORCES,
        "train": scenery.TRAIN if data.excitation is None else "",
        "track": scenery.TRACK,
        "blocks": [[name, _kind(name, data)] for name in snapshots.parts],
        "names": data.names,
        "kinds": [[kind, thick] for kind, thick in _THICK if kind in kinds],
        "lift": snapshots.field,
        "vector": int(snapshots.has_vectors),
        "view": str(look),
        "component": "Y" if colours.axis == 1 else ("" if snapshots.field == "uplift" else "Z"),
        "coloured": f"{colours.title} [m]",
        "size": scale.size,
        "motion": scale.motion,
        "largest_m": colours.largest,
        "metres_a_newton": arrow,
        "width_m": width,
        "middle_m": 0.5 * scale.size * (low + high),
        "start_m": float(data.position[first].mean()) - data.speed * float(times[0]),
        "speed": data.speed,
        "times": [float(times[0]), float(times[-1])],
    }


def _kind(name: str, data: FilmData) -> str:
    """What a block is drawn as."""
    if name in data.contacts:
        return "contact"
    return "wire" if name in data.wires else name
