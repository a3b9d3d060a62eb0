"""Writes the script that opens a run in ParaView, and what it shows beside the line."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb

from catenary.base.errors import InputError
from catenary.mbs.shape import Shape
from catenary.postproc.files.disk import unwritten, write_whole
from catenary.postproc.film.film_data import film_data
from catenary.postproc.film.options import View
from catenary.postproc.film.projection import Picture, room_above
from catenary.postproc.film.scenery import COLOURS, LOOKS, MOTIONS, THICK, Scenery
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.paraview import beside_line
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results

SCRIPT, FOLDER = "view.py", "paraview"
_TEMPLATE = "view.py.template"
# Line in the window beside one pantograph [m], width over height of the window, and the share of
# the room above the contact wire that the arrow of a mean force fills.
_WIDTH, _ASPECT, _ARROW = 110.0, 1280.0 / 480.0, 0.4


def write_script(
    folder: Path,
    records: Records | None,
    motion: float | None = None,
    shapes: Sequence[Shape] | None = None,
    look: View | None = None,
) -> list[Path]:
    """Write ``paraview/view.py`` and its data into the folder of a run. Not collective.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    records : Records or None
        Findings of ``guard.examined`` in the result file.
    motion : float, optional
        Factor by which motions are drawn larger, None for one that fits.
    shapes : sequence of Shape, optional
        Shapes of the pantographs, None for schematics.
    look : View, optional
        Point of view; None for the one that shows the line best.

    Raises
    ------
    InputError
        If the folder holds no run with snapshots.
    RunBroken
        If it cannot be written to.
    """
    target = folder / FOLDER
    with Results(folder, records) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            scenery = Scenery(data, snapshots, shapes)
            if target.is_symlink():
                raise InputError(f"{target} is a link, through which nothing is written; remove it")
            try:
                target.mkdir(exist_ok=True)
                files = beside_line.write(scenery, snapshots, target)
                settings = _settings(target, scenery, snapshots, motion, look or scenery.best_view)
                write_whole(
                    target / SCRIPT,
                    _script({**settings, **{name: path.name for name, path in files.items()}}),
                )
            except OSError as error:
                raise unwritten(target, error) from error
    return [target / SCRIPT, *files.values()]


def _script(settings: dict[str, object]) -> str:
    template = resources.files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    # Text of strangers, such as names, stays text: JSON's notation of it is Python's as well.
    return template.replace("@SETTINGS@", json.dumps(settings, indent=4))


def _settings(
    target: Path, scenery: Scenery, snapshots: Snapshots, motion: float | None, look: View
) -> dict[str, object]:
    """All numbers of the script, but for the files beside the line."""
    data, times = scenery.data, snapshots.times
    width = _WIDTH + 1.1 * float(np.ptp(data.position[0]))
    low, high = scenery.roof - 0.4, float(data.points[:, 2].max()) + 0.6
    extremes = snapshots.extremes(np.arange(times.size))
    picture = Picture(look, width, _ASPECT, low, high)
    scale, colours = picture.scale(data, extremes, motion), picture.colours(extremes)
    # A blow is over soon: its largest force, not its mean, is to fit.
    usual = data.force.mean() if data.excitation is None else np.abs(data.force).max()
    arrow = _ARROW * scale.size * room_above(data) / max(float(usual), 1.0)
    first = data.row_at(float(times[0]))
    kinds = {int(kind) for shape in scenery.shapes for kind in shape.kinds}
    places = np.linspace(colours.low, colours.high, len(MOTIONS))
    return {
        "folder": str(target.absolute()),
        "line": "../fields.xdmf",
        "train": "",
        "blocks": [[name, scenery.line[name].kind] for name in snapshots.parts],
        "looks": {
            kind: [look.thick, list(to_rgb(look.colour)) if look.colour else []]
            for kind, look in LOOKS.items()
        },
        "names": data.names,
        "colours": [list(to_rgb(colour)) for colour in COLOURS],
        "kinds": [[kind, thick] for kind, thick in THICK.items() if kind in kinds],
        "lift": snapshots.field,
        "vector": int(snapshots.has_vectors),
        "view": str(look),
        "component": "Y" if colours.axis == 1 else ("" if snapshots.field == "uplift" else "Z"),
        "coloured": f"{colours.title} [m]",
        "ramp": [float(x) for at, stop in zip(places, MOTIONS, strict=True)
                 for x in (at, *to_rgb(stop))],
        "size": scale.size,
        "motion": scale.motion,
        "ends_m": [colours.low, colours.high],
        "metres_a_newton": arrow,
        "width_m": width,
        "middle_m": 0.5 * scale.size * (low + high),
        "start_m": float(data.position[first].mean()) - data.speed * float(times[0]),
        "speed": data.speed,
        "times": [float(times[0]), float(times[-1])],
    }  # fmt: skip
