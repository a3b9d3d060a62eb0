"""Makes the film of a run: chooses the times of its pictures, draws and writes them one by one."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from catenary.base.errors import InputError
from catenary.mbs.shape import Shape
from catenary.postproc.files.own_files import GIF, MP4
from catenary.postproc.film import drawing
from catenary.postproc.film.drawing import ForceChart, RingingChart
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import FilmOptions
from catenary.postproc.film.scenery import (
    COLOURS,
    DROPPER_FORCES,
    MOTIONS,
    SLACK,
    Picture,
    Projection,
    Scenery,
)
from catenary.postproc.read.results import Results
from catenary.postproc.read.validation import Records
from catenary.solver.waves.excitation import Blow

# Length of line in a picture beside one pantograph [m].
_WIDTH = 110.0
_LEAST_WIDTH = 5.0
# Share of a picture that is behind the train.
_BEHIND = 0.55
# Distance by which a picture may reach beyond the snapshots [m].
_NEAR = 3.0
# Travel between two pictures, as a share of what they show.
_TRAVEL = 0.01
# Snapshots that are farther apart than this are not interpolated [m]: the wire is bent where a
# head is, and between two places it would be bent at both.
SMOOTH_UP_TO = 4.0
_SAME = 1e-9
# Rows of droppers' forces that are looked through for the largest.
_SAMPLED = 100


@dataclass(frozen=True)
class Film:
    """A film that was made.

    Attributes
    ----------
    files : MP4 and GIF
    n_pictures : that it has
    slowed : how many times slower than the train it runs
    apart : travel of the train between two snapshots [m]
    smooth : whether there are pictures between snapshots, or these are not too far apart
    left_out : snapshots left out, as they do not show the line around the train
    """

    files: tuple[Path, Path]
    n_pictures: int
    slowed: float
    apart: float
    smooth: bool
    left_out: int


def animate(
    folder: Path,
    options: FilmOptions,
    records: Records | None,
    progress: bool,
    shapes: Sequence[Shape] | None = None,
) -> Film:
    """Make ``film.mp4`` and ``film.gif`` in the folder of a run. Not collective.

    Parameters
    ----------
    folder : Path
        Result folder; the films are written there.
    options : FilmOptions
        Times, line and size of the pictures.
    records : Records or None
        Findings of ``guard.examined`` in the result file.
    progress : bool
        Whether a bar shows how far it is, if standard error is a terminal.
    shapes : sequence of Shape, optional
        Shapes of the pantographs, None for schematics.

    Raises
    ------
    InputError
        If there is nothing to be shown, or no library that encodes films.
    """
    try:
        from catenary.postproc.film import video
    except ImportError as error:
        raise InputError(
            f"a film needs {error.name}, which is not installed: pip install 'catenary[film]'"
        ) from error
    with Results(folder, records) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points), until=float(data.time[-1])) as snapshots:
            made = Pictures(results, Scenery(data, snapshots, shapes), snapshots, options)
            shown = tqdm(
                made,
                total=len(made),
                disable=not (progress and sys.stderr.isatty()),
                file=sys.stderr,
                leave=False,
                ncols=min(shutil.get_terminal_size().columns, 100),
                bar_format="film {percentage:3.0f}% |{bar}| {n} of {total} pictures, left "
                "{remaining}",
            )
            files = folder / MP4, folder / GIF
            colours = (*COLOURS[: data.n_pantographs], *MOTIONS, *DROPPER_FORCES, SLACK)
            count = video.write(shown, drawing.SIZE, options.rate, *files, colours)
            seconds = float(np.diff(made.times).mean())
            apart = data.speed * float(np.diff(snapshots.times).mean())
    slowed = 1.0 / (seconds * options.rate)
    return Film(files, count, slowed, apart, apart <= SMOOTH_UP_TO, made.left_out)


def chosen(times: np.ndarray, options: FilmOptions) -> np.ndarray:
    """Numbers of the snapshots that are shown, two at least.

    Raises
    ------
    InputError
        If there are fewer in the time that is asked for.
    """
    start = times[0] if options.start is None else options.start
    end = times[-1] if options.end is None else options.end
    numbers = np.flatnonzero((times >= start - _SAME) & (times <= end + _SAME))
    if numbers.size < 2:
        raise InputError(
            f"there are not two snapshots from {start:g} to {end:g} s; they reach from "
            f"{times[0]:g} to {times[-1]:g} s, {times[1] - times[0]:g} s apart"
        )
    return numbers


def times_of_pictures(shown: np.ndarray, speed: float, every: float) -> np.ndarray:
    """Times of the pictures, two at least, such that the train goes equally far between them.

    Each snapshot is a picture where they are too far apart to be interpolated, and where nothing
    travels.

    Parameters
    ----------
    shown : ndarray, shape (n,)
        Times of the snapshots [s].
    speed : float
        Speed of the train [m/s].
    every : float
        Travel of the train between two pictures [m].
    """
    apart = speed * float(np.diff(shown).mean())
    if speed == 0.0 or apart > SMOOTH_UP_TO:
        return shown
    return np.arange(shown[0], shown[-1] + _SAME, min(every / speed, shown[-1] - shown[0]))


def followed(data: FilmData, camera: str | None) -> list[int]:
    """Pantographs that the camera goes with.

    Raises
    ------
    InputError
        If there is none of that name or number.
    """
    if camera is None:
        return list(range(data.n_pantographs))
    if camera in data.names:
        return [data.names.index(camera)]
    if camera.isdigit() and 1 <= int(camera) <= data.n_pantographs:
        return [int(camera) - 1]
    names, n = ", ".join(map(repr, data.names)), data.n_pantographs
    numbers = f", or a number from 1 to {n}" if n > 1 else " or 1"
    raise InputError(f"--camera is {camera!r}; it must be {names}{numbers}")


class Pictures:
    """The pictures of a film, each drawn on request; (height, width, 4) uint8 each, valid until the
    next one. Not collective.

    Attributes
    ----------
    times : of the pictures [s]
    drawing : on which they are drawn
    left_out : snapshots of the time asked for that do not show the line around the train

    Raises
    ------
    InputError
        If the options do not fit the run.
    """

    def __init__(
        self, results: Results, scenery: Scenery, snapshots: Snapshots, options: FilmOptions
    ) -> None:
        self._results, self._scenery, self._snapshots = results, scenery, snapshots
        data = scenery.data
        self._followed = followed(data, options.camera)
        asked = chosen(snapshots.times, options)
        usual = self._usual(asked)
        numbers = self._with_line(asked, options.width or usual)
        self.left_out = asked.size - numbers.size
        shown = snapshots.times[numbers]
        view = options.view or scenery.best_view
        self._width = width = self._fitting(numbers, options.width, usual)
        every = options.every or _TRAVEL * width
        self.times = times_of_pictures(shown, data.speed, every)
        picture = Picture.of(view, data, scenery.roof, width, drawing.ASPECT)
        extremes = snapshots.extremes(numbers, self._seen)
        projection = Projection(
            view, picture.scale(data, extremes, options.motion), scenery.roof + 0.5
        )
        self._dropper_time = results.line_time if results.has("dropper_force") else np.zeros(0)
        self.drawing = drawing.Drawing(
            scenery,
            picture,
            projection,
            picture.colours(extremes),
            self._strongest(shown),
            self._followed,
        )
        self.chart: ForceChart | RingingChart
        if isinstance(data.excitation, Blow):
            blow = data.excitation
            self.chart = RingingChart(self.drawing.chart, data, blow, snapshots, numbers)
        else:
            first, last = (data.row_at(float(end)) for end in shown[[0, -1]])
            # The force in the first picture lies behind the train already.
            low = self._span(first, width)[0]
            begin = min(int(x.searchsorted(low)) for x in data.position[: first + 1].T)
            rows = min(begin, first), last + 1
            self.chart = ForceChart(self.drawing.chart, data, rows, width)
        self.drawing.moving += self.chart.moving

    def __len__(self) -> int:
        return self.times.size

    def __iter__(self) -> Iterator[np.ndarray]:
        for time in self.times.tolist():
            self.show(time)
            yield self.drawing.pixels()

    def show(self, time: float) -> None:
        """Put everything where it is at a time [s]."""
        data = self._scenery.data
        row, frame = data.row_at(time), self._snapshots.frame(time)
        low, high = self._span(row, self._width)
        self.chart.update(row, low, high)
        beside = self._scenery.beside(time, frame)
        self.drawing.update(row, frame.moved, beside, self._dropper_forces(time), (low, high))
        speed = f"   {3.6 * data.speed:.0f} km/h" if data.speed else ""
        self.drawing.words.set_text(f"t = {data.time[row]:.2f} s{speed}")

    def _span(self, row: int, width: float) -> tuple[float, float]:
        """Line in a picture of a width, from and to [m]."""
        middle = self._middle(row)
        return middle - _BEHIND * width, middle + (1.0 - _BEHIND) * width

    def _seen(self, number: int) -> np.ndarray:
        """Mask (n_nodes,) of nodes that a picture shows at a snapshot, all where it shows none."""
        low, high = self._span(self._row(number), self._width)
        x = self._scenery.data.points[:, 0]
        inside = (x >= low) & (x <= high)
        return inside if inside.any() else np.ones_like(inside)

    def _usual(self, asked: np.ndarray) -> float:
        """Length of line that pictures show if none is wanted: of a stretch at most its half, so
        that the train passes through whole pictures."""
        usual = _WIDTH + 1.1 * float(np.ptp(self._scenery.data.position[0, self._followed]))
        return min(usual, 0.5 * self._stretch(asked))

    def _stretch(self, asked: np.ndarray) -> float:
        """Length of the part of the line that all snapshots show, infinite of the whole line and of
        a window that moves [m]."""
        data = self._scenery.data
        x = data.points[data.wires[data.contact], 0]
        first, last = (self._snapshots.shown(int(number)) for number in asked[[0, -1]])
        whole = first[0] <= x[0] + _NEAR and first[1] >= x[-1] - _NEAR
        return np.inf if whole or first != last else first[1] - first[0]

    def _with_line(self, asked: np.ndarray, width: float) -> np.ndarray:
        """Those of the snapshots ``asked`` for that show the line at the train: all of a window
        that moves with it. Of a stretch those that fill a picture of a ``width``, where there are
        two."""
        fitting: list[int] = []
        there: list[int] = []
        for number in asked.tolist():
            (low, high), (begin, end) = self._ends(number, width), self._snapshots.shown(number)
            if begin <= low + _NEAR and end >= high - _NEAR:
                fitting.append(number)
            if begin <= self._middle(self._row(number)) <= end:
                there.append(number)
        if max(len(fitting), len(there)) < 2:
            begin, end = self._snapshots.shown(int(asked[0]))
            first, last = (self._snapshots.times[number] for number in asked[[0, -1]])
            raise InputError(
                f"from {first:g} to {last:g} s no two snapshots show the line where the train is; "
                f"the first shows it from {begin:.0f} to {end:.0f} m; film another time, or run "
                "the scene again with other output.field_spans"
            )
        fixed = np.isfinite(self._stretch(asked))
        return np.array(fitting if fixed and len(fitting) > 1 else there)

    def _row(self, number: int) -> int:
        """The record nearest to a snapshot."""
        return self._scenery.data.row_at(float(self._snapshots.times[number]))

    def _ends(self, number: int, width: float) -> np.ndarray:
        """Line in a picture of a width at a snapshot, from and to, as far as it goes [m]."""
        data = self._scenery.data
        x = data.points[data.wires[data.contact], 0]
        return np.clip(self._span(self._row(number), width), x[0], x[-1])

    def _middle(self, row: int) -> float:
        """Place that the camera looks at in a record [m]."""
        return float(self._scenery.data.position[row, self._followed].mean())

    def _fitting(self, numbers: np.ndarray, wanted: float | None, usual: float) -> float:
        """Length of line that pictures show: what is wanted, or less than is ``usual`` where
        snapshots have less."""
        snapshots, width = self._snapshots, wanted or usual
        for number in numbers[[0, numbers.size // 2, -1]].tolist():
            low, high = self._ends(number, width)
            middle = self._middle(self._row(number))
            begin, end = snapshots.shown(number)
            if begin <= low + _NEAR and end >= high - _NEAR:
                continue
            if wanted is not None:
                raise InputError(
                    f"a picture of {width:g} m shows the line from {low:.0f} to {high:.0f} m at "
                    f"t = {snapshots.times[number]:g} s, and the snapshots have it from "
                    f"{begin:.0f} to {end:.0f} m only; take a smaller --width-m, or a larger "
                    "output.field_window_m"
                )
            if begin > low + _NEAR:
                width = min(width, (middle - begin) / _BEHIND)
            if end < high - _NEAR:
                width = min(width, (end - middle) / (1.0 - _BEHIND))
        return max(width, _LEAST_WIDTH)

    def _strongest(self, shown: np.ndarray) -> float | None:
        """Largest force of a dropper that the film shows, of many records in some of them [N]."""
        if not self._dropper_time.size:
            return None
        first, last = self._dropper_time.searchsorted(shown[[0, -1]])
        rows = np.unique(np.linspace(first, max(first, last - 1), _SAMPLED).astype(int))
        x, found = self._results.line("dropper_x"), []
        for row in rows.tolist():
            time = float(self._dropper_time[min(row, self._dropper_time.size - 1)])
            low, high = self._span(self._scenery.data.row_at(time), self._width)
            shown_here = self._dropper_row(row)[(x >= low) & (x <= high)]
            found.append(float(np.nanmax(shown_here, initial=0.0)))
        largest = float(np.quantile(found, 0.98))
        return float(f"{largest:.2g}") if largest > 0.0 else None

    def _dropper_row(self, row: int) -> np.ndarray:
        row = min(row, self._dropper_time.size - 1)
        return np.asarray(self._results.rows("dropper_force", slice(row, row + 1))[0])

    def _dropper_forces(self, time: float) -> np.ndarray | None:
        """Force of each dropper at a time, NaN where it is not recorded [N]."""
        if not self._dropper_time.size:
            return None
        return self._dropper_row(int(self._dropper_time.searchsorted(time - _SAME)))
