"""Makes the film of a run: chooses its pictures, draws them one by one, writes them."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from catenary.mbs.shape import Shape
from catenary.postproc.film.film_data import FilmData, film_data
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.scale import Scale, scale_for
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results
from catenary.solver.base.errors import InputError

_EGL = "libEGL.so.1"
MP4, GIF = "film.mp4", "film.gif"
SIZE = (1280, 720)
# Shares of the picture's height that line and force have.
_SHARES = (0.62, 0.38)
# Length of line in a picture beside one pantograph [m].
_WIDTH = 110.0
# How far a picture may reach beyond what the snapshots have [m].
_NEAR = 3.0


@dataclass(frozen=True)
class Wish:
    """What is wanted of a film; None leaves it to the run.

    Attributes
    ----------
    start, end : from and to in simulated time [s]
    rate : pictures a second, each a snapshot
    width : length of line in a picture [m]
    motion : by what factor motions are drawn larger
    """

    start: float | None = None
    end: float | None = None
    rate: float = 25.0
    width: float | None = None
    motion: float | None = None


@dataclass(frozen=True)
class Film:
    """A film that was made.

    Attributes
    ----------
    files : MP4 and GIF
    n_pictures : that it has
    slowed : how many times slower than the train it runs
    """

    files: tuple[Path, Path]
    n_pictures: int
    slowed: float


def animate(
    folder: Path,
    wish: Wish,
    records: Records | None,
    progress: bool,
    shapes: Sequence[Shape] | None = None,
) -> Film:
    """Make ``film.mp4`` and ``film.gif`` in the folder of a run. Not collective.

    Parameters
    ----------
    records : what ``guard.examined`` found in the result file
    progress : whether a bar shows how far it is, if standard error is a terminal
    shapes : of the pantographs, None for a schematic

    Raises
    ------
    InputError
        If there is nothing to be shown, or no library that draws.
    """
    _check_libraries()
    with Results(folder, records) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            numbers = chosen(snapshots.times, wish)
            pantographs = MovingPantographs(data, snapshots, shapes)
            from catenary.postproc.film import video

            pictures = tqdm(
                _pictures(data, results, snapshots, numbers, wish, pantographs),
                total=numbers.size,
                desc="film",
                unit="picture",
                disable=not (progress and sys.stderr.isatty()),
                file=sys.stderr,
            )
            files = folder / MP4, folder / GIF
            count = video.write(pictures, SIZE, wish.rate, *files)
            apart = float(np.diff(snapshots.times[numbers]).mean())
    return Film(files, count, 1.0 / (apart * wish.rate))


def chosen(times: np.ndarray, wish: Wish) -> np.ndarray:
    """Numbers of the snapshots that are shown, two at least.

    Raises
    ------
    InputError
        If there are fewer in the time that is asked for.
    """
    start = times[0] if wish.start is None else wish.start
    end = times[-1] if wish.end is None else wish.end
    numbers = np.flatnonzero((times >= start - 1e-9) & (times <= end + 1e-9))
    if numbers.size < 2:
        raise InputError(
            f"there are not two snapshots from {start:g} to {end:g} s; they reach from "
            f"{times[0]:g} to {times[-1]:g} s, {times[1] - times[0]:g} s apart"
        )
    return numbers


def _check_libraries() -> None:
    """Raise InputError where pictures cannot be drawn or written."""
    try:
        import imageio_ffmpeg  # noqa: F401
        import pyvista  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"a film needs {error.name}, which is not installed: pip install 'catenary[film]'"
        ) from error
    if sys.platform.startswith("linux"):
        try:
            ctypes.CDLL(_EGL)
        except OSError as error:
            raise InputError(
                f"a film needs {_EGL}, with which pictures are drawn without a screen: "
                "apt-get install libegl1"
            ) from error
        # Without this VTK looks for a screen first, and complains that there is none.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _pictures(
    data: FilmData,
    results: Results,
    snapshots: Snapshots,
    numbers: np.ndarray,
    wish: Wish,
    pantographs: MovingPantographs,
) -> Iterator[np.ndarray]:
    """The pictures (height, width, 3) uint8 of the snapshots, in order."""
    import pyvista

    from catenary.postproc.film.force_curve import ForceCurve
    from catenary.postproc.film.side_view import SideView

    times = snapshots.times[numbers]
    rows = data.row_at(float(times[0])), data.row_at(float(times[-1])) + 1
    spread = float(np.ptp(data.position[0]))
    width = wish.width or _WIDTH + 1.1 * spread
    _check_width(data, snapshots, numbers, width)
    largest = snapshots.largest_uplift(numbers)
    plotter = pyvista.Plotter(
        shape=(2, 1), row_weights=_SHARES, window_size=SIZE, off_screen=True, border=False
    )
    plotter.set_background("white")
    plotter.subplot(0, 0)
    scale = _scale(data, width, largest, wish)
    view = SideView(plotter, data, scale, largest, pantographs, snapshots.parts)
    plotter.enable_parallel_projection()
    words = plotter.add_text(" ", position=(12, 12), font_size=10, color="black")
    plotter.subplot(1, 0)
    curve = ForceCurve(plotter, data, rows)
    # A chart has its place in the picture when it was drawn once.
    plotter.show(auto_close=False)
    plotter.subplot(0, 0)
    slack_times = results.line_time if results.has("dropper_force") else np.zeros(0)
    try:
        for number, time in zip(numbers.tolist(), times.tolist(), strict=True):
            row = data.row_at(time)
            middle = float(data.position[row].mean())
            low, high = middle - 0.55 * width, middle + 0.45 * width
            curve.update(row, low, high)
            slack = _slack(results, slack_times, time)
            view.update(row, snapshots.uplift(number), slack, pantographs.poses(number))
            words.input = _words(data, scale, row)
            _aim(plotter.camera, curve.sides(), low, high, float(scale.drawn(np.array(view.top))))
            plotter.render()
            yield np.asarray(plotter.image)[..., :3]
    finally:
        plotter.close()


def _check_width(data: FilmData, snapshots: Snapshots, numbers: np.ndarray, width: float) -> None:
    """Raise InputError if pictures would show more of the line than the snapshots have."""
    x = data.points[data.wires[data.contact], 0]
    for number in numbers[[0, -1]].tolist():
        middle = float(data.position[data.row_at(float(snapshots.times[number]))].mean())
        begin, end = snapshots.shown(number)
        low, high = max(middle - 0.55 * width, x[0]), min(middle + 0.45 * width, x[-1])
        if begin > low + _NEAR or end < high - _NEAR:
            raise InputError(
                f"a picture of {width:g} m shows the line from {low:.0f} to {high:.0f} m at "
                f"t = {snapshots.times[number]:g} s, and the snapshots have it from {begin:.0f} to "
                f"{end:.0f} m only; take a smaller --width-m, or a larger output.field_window_m"
            )


def _scale(data: FilmData, width: float, largest: float, wish: Wish) -> Scale:
    nodes = data.wires[data.contact]
    contact = data.points[nodes, 2]
    between = float(data.points[:, 2].max() - np.median(contact))
    room = data.points[:, 2].max() - contact.min() + 3.0
    aspect = SIZE[0] / (_SHARES[0] * SIZE[1])
    return scale_for(width, float(room), aspect, between, largest, wish.motion)


def _slack(results: Results, times: np.ndarray, time: float) -> np.ndarray | None:
    """Whether each dropper carries nothing at a time; None where that is not recorded."""
    if not times.size:
        return None
    row = min(int(times.searchsorted(time)), times.size - 1)
    force = results.rows("dropper_force", slice(row, row + 1))
    return np.asarray(force[0] <= 0.0)


def _words(data: FilmData, scale: Scale, row: int) -> str:
    forces = ", ".join(f"{force:.0f} N" for force in data.force[row])
    return (
        f"t = {data.time[row]:.2f} s   {3.6 * data.speed:.0f} km/h   {forces}   "
        f"heights x {scale.height:g}, motion x {scale.motion:g}"
    )


def _aim(camera: Any, sides: tuple[float, float], low: float, high: float, top: float) -> None:
    """Point the camera so that places along the track stand above those of the chart.

    Parameters
    ----------
    sides : columns of the picture between which the chart reaches from ``low`` to ``high`` [px]
    low, high : places along the track [m]
    top : of the drawing, which is to be in the picture
    """
    left, right = sides
    metres_a_pixel = (high - low) / max(right - left, 1.0)
    height = _SHARES[0] * SIZE[1]
    x = low + (0.5 * SIZE[0] - left) * metres_a_pixel
    z = top - 0.42 * height * metres_a_pixel
    camera.position, camera.focal_point = (x, -1000.0, z), (x, 0.0, z)
    camera.up, camera.parallel_scale = (0.0, 0.0, 1.0), 0.5 * height * metres_a_pixel
    camera.clipping_range = (1.0, 3000.0)
