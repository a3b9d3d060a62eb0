"""Opens a run in ParaView: writes a script, what it shows, and a state.

What moves or stands beside the line (pantographs, contact forces, train, track) goes into XDMF
files of one grid a time, with a common HDF5 file; one of the line names the snapshots that are
there. Points are places at rest; a field ``displacement`` moves them, so that one factor draws all
motions larger. The state opens a run without Python: ParaView's own program makes it from the
script.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import h5py
import numpy as np
from matplotlib.colors import to_rgb

from catenary.base.errors import InputError
from catenary.mbs.shape import Shape
from catenary.postproc.files import xdmf
from catenary.postproc.files.disk import unwritten, write_whole
from catenary.postproc.files.own_files import FIELD_FILES
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import View
from catenary.postproc.film.scenery import (
    COLOURS,
    FORCES,
    LOOKS,
    MOTIONS,
    THICK,
    Picture,
    Scenery,
    room_above,
)
from catenary.postproc.read.results import Results
from catenary.postproc.read.validation import Records

SCRIPT, FOLDER = "view.py", "paraview"
_TEMPLATE = "view.py.template"
# Line in the window beside one pantograph [m], width over height of the window, and the share of
# the room above the contact wire that the arrow of a mean force fills.
_WIDTH, _ASPECT, _ARROW = 110.0, 1280.0 / 480.0, 0.4
_NUMBERS = "scenery.h5"
STATE = "view.pvsm"
PROGRAM, _SCREEN = "pvpython", "xvfb-run"
# Longest that ParaView may take [s].
_PATIENCE = 300.0
# Without -noreset a screen starts anew whenever nobody is connected to it, and refuses whoever
# comes meanwhile: ParaView connects, leaves and connects again.
SCREEN_OF_ITS_OWN = "-screen 0 1600x900x24 -noreset"
# Two that begin at one time may take one screen, which the first to end takes from the other.
_ATTEMPTS, _LOST = 3, "X server connection"


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
        data = FilmData(results)
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            scenery = Scenery(data, snapshots, shapes)
            if target.is_symlink():
                raise InputError(f"{target} is a link, through which nothing is written; remove it")
            try:
                target.mkdir(exist_ok=True)
                files = _write_shown(scenery, snapshots, target)
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


def _write_shown(scenery: Scenery, snapshots: Snapshots, folder: Path) -> dict[str, Path]:
    """Write the line, and the parts beside it at the times of the snapshots, into an existing
    folder; returns the XDMF file of each by its name. OSError if they cannot be written."""
    data, grids = scenery.data, {name: list[str]() for name in scenery.parts}
    # In memory: HDF5 crashes the interpreter at its end where a disk has refused a write.
    with h5py.File(_NUMBERS, "w", driver="core", backing_store=False) as file:
        put = file.create_dataset
        still = {
            name: (
                _item(put(f"{name}/cells", data=part.cells.astype(np.int32))),
                [_values(put(f"{name}/{own}", data=values.astype(np.int32)), of_cells=True)
                 for own, values in part.fields.items()],
            )
            for name, part in scenery.parts.items()
        }  # fmt: skip
        for k, time in enumerate(snapshots.times.tolist()):
            for name, (rest, moved) in scenery.beside(time, snapshots.frame(time)).items():
                moves, (cells, of_cells) = scenery.parts[name].moves, still[name]
                if k and not moves:
                    continue
                at = f"{name}/{k:06d}"
                fields = [put(f"{at}/displacement", data=moved.astype("<f4"))]
                if name == FORCES:
                    force = np.zeros((data.n_pantographs, 3), dtype="<f4")
                    force[:, 2] = data.force[data.row_at(time)]
                    fields.append(put(f"{at}/force", data=force))
                points = _item(put(f"{at}/points", data=rest))
                values = [*map(_values, fields), *of_cells]
                grids[name].append(xdmf.grid(name, cells, points, values, time if moves else None))
        file.flush()
        write_whole(folder / _NUMBERS, bytes(file.id.get_file_image()))
    texts = {
        name: xdmf.document(own[0] if len(own) == 1 else xdmf.collection(name, own))
        for name, own in grids.items()
    }
    texts["line"] = snapshots.xdmf(f"../{FIELD_FILES[0]}")
    files = {name: folder / f"{name}.xdmf" for name in texts}
    for name, path in files.items():
        write_whole(path, texts[name])
    return files


def _item(table: h5py.Dataset) -> xdmf.Item:
    return xdmf.Item(table.shape, table.dtype, f"{_NUMBERS}:{table.name}")


def _values(table: h5py.Dataset, of_cells: bool = False) -> xdmf.Values:
    """A field that is named as its table is."""
    return xdmf.Values(Path(table.name).name, _item(table), of_cells)


def write_state(script: Path) -> tuple[Path | None, str]:
    """Write ``view.pvsm`` beside the script that opens a run. Not collective.

    Returns
    -------
    The state, and an empty text; or None, and one sentence that says why there is none.
    """
    command, why = _command()
    if not command:
        return None, why
    state = script.with_name(STATE)
    part = script.with_name(f".{script.stem}.{os.getpid()}{state.suffix}")
    try:
        part.unlink(missing_ok=True)  # a link that was put there would be written through
        for _ in range(_ATTEMPTS):
            done = subprocess.run(
                [*command, str(script), "--state", str(part)],
                capture_output=True,
                text=True,
                timeout=_PATIENCE,
                check=False,
            )
            if done.returncode == 0 and part.is_file():
                os.replace(part, state)
                return state, ""
            if _LOST not in done.stderr:
                break
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        # The program that makes the screen complains last, about what it cannot clean up.
        own = [line for line in lines if not line.startswith(_SCREEN)]
        why = f"{PROGRAM} failed: {(own or lines or ['it wrote nothing'])[-1]}"
    except (OSError, subprocess.TimeoutExpired) as error:
        why = f"{PROGRAM} failed: {error}"
    finally:
        part.unlink(missing_ok=True)
    return None, f"no state is written, the script does the same ({why})"


def _command() -> tuple[Sequence[str], str]:
    """Command that starts ParaView's Python here, or the reason why none can."""
    if shutil.which(PROGRAM) is None:
        return (), f"no state is written: {PROGRAM} is not on this machine"
    if not sys.platform.startswith("linux"):
        return (PROGRAM,), ""
    # Debian's draws on a screen only. One of its own is there whatever DISPLAY says.
    if shutil.which(_SCREEN) is not None:
        # Two that begin at one time look for a free number from different ones on.
        number = str(100 + os.getpid() % 5000)
        return (_SCREEN, "-a", "-n", number, "-s", SCREEN_OF_ITS_OWN, PROGRAM), ""
    if os.environ.get("DISPLAY"):
        return (PROGRAM,), ""
    return (), f"no state is written: {PROGRAM} needs a screen, or {_SCREEN}"
