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

from catenary.base.errors import InputError
from catenary.mbs.shape import Shape
from catenary.postproc.film.film_data import FilmData, film_data
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.projection import Picture, Projection, Scale
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.view import View
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results
from catenary.solver.waves.excitation import Blow

_EGL = "libEGL.so.1"
MP4, GIF = "film.mp4", "film.gif"
SIZE = (1280, 720)
# Shares of the picture's height that line and force have.
_SHARES = (0.62, 0.38)
# Length of line in a picture beside one pantograph [m].
_WIDTH = 110.0
_LEAST_WIDTH = 5.0
# Share of a picture that is behind the train.
_BEHIND = 0.55
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
    view : where the line is looked at from
    """

    start: float | None = None
    end: float | None = None
    rate: float = 25.0
    width: float | None = None
    motion: float | None = None
    view: View = View.SIDE


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
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            numbers = chosen(snapshots.times, wish)
            pantographs = MovingPantographs(data, snapshots, shapes)
            from catenary.postproc.film import video
            from catenary.postproc.film.line_view import SLACK

            pictures = tqdm(
                _pictures(data, results, snapshots, numbers, wish, pantographs),
                total=numbers.size,
                desc="film",
                unit="picture",
                disable=not (progress and sys.stderr.isatty()),
                file=sys.stderr,
            )
            files = folder / MP4, folder / GIF
            count = video.write(pictures, SIZE, wish.rate, *files, later=[SLACK])
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

    from catenary.postproc.film.force_curve import ForceCurve, RingingCurve
    from catenary.postproc.film.line_view import LineView

    times = snapshots.times[numbers]
    rows = data.row_at(float(times[0])), data.row_at(float(times[-1])) + 1
    width = wish.width or _fitting(data, snapshots, numbers)
    _check_width(data, snapshots, numbers, width)
    picture = _picture(data, pantographs, width, wish.view)
    scale = picture.scale(data, snapshots, numbers, wish.motion)
    plotter = pyvista.Plotter(
        shape=(2, 1), row_weights=_SHARES, window_size=SIZE, off_screen=True, border=False
    )
    plotter.set_background("white")
    plotter.subplot(0, 0)
    projection = Projection(wish.view, scale)
    colours = picture.colours(snapshots, numbers)
    view = LineView(plotter, data, projection, colours, pantographs, snapshots)
    plotter.enable_parallel_projection()
    words = plotter.add_text(" ", position=(12, 12), font_size=10, color="black")
    plotter.subplot(1, 0)
    curve: ForceCurve | RingingCurve
    if isinstance(data.excitation, Blow):
        curve = RingingCurve(plotter, data, data.excitation, snapshots, numbers)
    else:
        curve = ForceCurve(plotter, data, rows)
    # A chart has its place in the picture when it was drawn once.
    plotter.show(auto_close=False)
    plotter.subplot(0, 0)
    slack_times = results.line_time if results.has("dropper_force") else np.zeros(0)
    try:
        for number, time in zip(numbers.tolist(), times.tolist(), strict=True):
            row = data.row_at(time)
            middle = float(data.position[row].mean())
            low, high = middle - _BEHIND * width, middle + (1.0 - _BEHIND) * width
            curve.update(row, low, high)
            slack = _slack(results, slack_times, time)
            view.update(row, snapshots.displacement(number), slack, pantographs.poses(number))
            words.input = _words(data, projection, row)
            _aim(plotter.camera, curve.sides(), (low, high), picture, scale)
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
        low = max(middle - _BEHIND * width, x[0])
        high = min(middle + (1.0 - _BEHIND) * width, x[-1])
        if begin > low + _NEAR or end < high - _NEAR:
            raise InputError(
                f"a picture of {width:g} m shows the line from {low:.0f} to {high:.0f} m at "
                f"t = {snapshots.times[number]:g} s, and the snapshots have it from {begin:.0f} to "
                f"{end:.0f} m only; take a smaller --width-m, or a larger output.field_window_m"
            )


def _fitting(data: FilmData, snapshots: Snapshots, numbers: np.ndarray) -> float:
    """Length of line that pictures show if none is asked for: less where snapshots have less."""
    width = _WIDTH + 1.1 * float(np.ptp(data.position[0]))
    x = data.points[:, 0]
    for number in numbers[[0, numbers.size // 2, -1]].tolist():
        middle = float(data.position[data.row_at(float(snapshots.times[number]))].mean())
        begin, end = snapshots.shown(number)
        if begin > x.min() + _NEAR:
            width = min(width, (middle - begin) / _BEHIND)
        if end < x.max() - _NEAR:
            width = min(width, (end - middle) / (1.0 - _BEHIND))
    return max(width, _LEAST_WIDTH)


def _picture(data: FilmData, pantographs: MovingPantographs, width: float, view: View) -> Picture:
    """What pictures hold. From behind, and from above, the train's roof is their lower end."""
    aspect = SIZE[0] / (_SHARES[0] * SIZE[1])
    high = float(data.points[:, 2].max()) + 0.6
    low = pantographs.roof - 1.2
    if view is View.ALONG:
        # Lengths are not seen: one metre of height is one metre of the picture.
        width = aspect * (high - low)
    return Picture(view, width, aspect, low, high)


def _slack(results: Results, times: np.ndarray, time: float) -> np.ndarray | None:
    """Whether each dropper carries nothing at a time; None where that is not recorded."""
    if not times.size:
        return None
    row = min(int(times.searchsorted(time)), times.size - 1)
    force = results.rows("dropper_force", slice(row, row + 1))
    return np.asarray(force[0] <= 0.0)


def _words(data: FilmData, projection: Projection, row: int) -> str:
    scale = projection.scale
    stretched = "widths" if projection.view is View.PLAN else "heights"
    forces = ", ".join(f"{force:.0f} N" for force in data.force[row])
    speed = f"{3.6 * data.speed:.0f} km/h   " if data.speed else ""
    return (
        f"t = {data.time[row]:.2f} s   {speed}{forces}   "
        f"{stretched} x {scale.size:g}, motion x {scale.motion:g}"
    )


def _aim(
    camera: Any,
    sides: tuple[float, float],
    shown: tuple[float, float],
    picture: Picture,
    scale: Scale,
) -> None:
    """Point the camera so that places along the track stand above those of the chart.

    Parameters
    ----------
    sides : columns of the picture between which the chart reaches along ``shown`` [px]
    shown : places along the track, from and to [m]
    """
    (left, right), (low, high) = sides, shown
    height = _SHARES[0] * SIZE[1]
    if picture.view is View.ALONG:
        metres_a_pixel, x = scale.size * (picture.high - picture.low) / height, 0.0
    else:
        metres_a_pixel = (high - low) / max(right - left, 1.0)
        x = low + (0.5 * SIZE[0] - left) * metres_a_pixel
    z = 0.5 * scale.size * (picture.low + picture.high)
    if picture.view is View.PLAN:
        z = 0.0
    camera.position, camera.focal_point = (x, -1000.0, z), (x, 0.0, z)
    camera.up, camera.parallel_scale = (0.0, 0.0, 1.0), 0.5 * height * metres_a_pixel
    camera.clipping_range = (1.0, 3000.0)
