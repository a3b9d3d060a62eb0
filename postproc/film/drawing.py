"""The pictures of a film: lines and texts that stay and change their places, over still ground.

Beneath the line is a chart, whose curves stay and change their data: the contact force along the
track up to where the pantographs are, or what a blow leaves.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import View
from catenary.postproc.film.scenery import (
    COLOURS,
    CONTACT,
    DROPPER_FORCES,
    EYE,
    FORCES,
    LOOKS,
    MOTIONS,
    NEAREST,
    PANTOGRAPHS,
    SLACK,
    THICK,
    TRACK,
    TRAIN,
    UNKNOWN,
    WIRE,
    Colours,
    LinePart,
    Picture,
    Places,
    Projection,
    Scenery,
    room_above,
)
from catenary.postproc.record.snapshots.contents import ARMS, CLAMPS, MASTS
from catenary.solver.waves.excitation import Blow

SIZE = (1920, 1080)
_DPI = 100
# Line and chart in the picture: left, bottom, width, height.
_LINE, _CHART = (0.05, 0.345, 0.935, 0.545), (0.05, 0.07, 0.935, 0.235)
ASPECT = _LINE[2] * SIZE[0] / (_LINE[3] * SIZE[1])
# Letters of a title at most; usual width of a line [points].
_MOST_LETTERS = 90
_USUAL = 4.0
# Length of the arrow of a force: share of the drawn room above the contact wire per N.
_ARROW = 0.0035
# A force's value stands above what is so far beside it at most, as shares of the picture's width.
_BESIDE_VALUE, _ABOVE_VALUE = 0.03, 0.014
# Length of line that is seen from behind the train, from behind the first pantograph on [m].
_SEEN_BEHIND, _SEEN_AHEAD = 10.0, 65.0
# Distance from the picture up to which parts are drawn [m]; half the length of lines across [m].
_NEAR, _ACROSS = 12.0, 50.0
# Numbers below a scale of colours are so far apart at least, as a share of it.
_APART = 0.15
# Faces of a box from dark to light: left, floor, rear, front, roof, right.
_FACES = ("#c3c8ce", "#c3c8ce", "#ccd1d7", "#ccd1d7", "#eceef1", "#dde1e6")
_STYLE = {"font.size": 15, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
          "grid.color": "#e3e5e8", "axes.axisbelow": True, "text.parse_math": False}  # fmt: skip
# Points of a curve at most, far more than a picture has columns of; marks along the track at most.
_MOST_POINTS, _MOST_MARKS = 4000, 12


@contextlib.contextmanager
def _styled() -> Iterator[None]:
    """Matplotlib's own style, whatever a user's files say."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


class Drawing:
    """Pictures of one size, of a line above and a chart below. Not collective.

    Attributes
    ----------
    chart : axes of the chart, filled by whoever adds its curves to ``moving``
    moving : artists drawn anew in each picture, from behind to the front
    wires, droppers, slack, bodies : lines of the picture
    values : texts of the forces, and ``words``, those of the time

    Parameters
    ----------
    scenery : of the run
    picture : frame of the drawing
    projection : of the drawing
    colours : colour scale of the wires
    strongest : largest force of a dropper [N], None if it is not known
    followed : pantographs that the camera goes with; all if None
    """

    def __init__(
        self,
        scenery: Scenery,
        picture: Picture,
        projection: Projection,
        colours: Colours,
        strongest: float | None,
        followed: list[int] | None = None,
    ) -> None:
        self._followed = slice(None) if followed is None else followed
        self._scenery, self._picture, self._projection = scenery, picture, projection
        self._colours, self._ground = colours, None
        self._parts = _seen_parts(scenery, picture.view)
        with _styled():
            self.figure = Figure(figsize=(SIZE[0] / _DPI, SIZE[1] / _DPI), dpi=_DPI)
            self._canvas = FigureCanvasAgg(self.figure)
            self._axes = self.figure.add_axes(_LINE)
            self.chart = self.figure.add_axes(_CHART)
            self._frame_line()
            self._write_head(strongest)
            self._add_lines(strongest)

    def _frame_line(self) -> None:
        """Leave the line without axes, a metre of height as long as one of length."""
        self._axes.set_axis_off()
        size = self._projection.scale.size
        middle = 0.5 * size * (self._picture.low + self._picture.high)
        half = 0.5 * self._picture.width / ASPECT
        self._axes.set_ylim(middle - half, middle + half)
        if self._picture.view is View.ALONG:
            self._axes.set_xlim(-ASPECT * half, ASPECT * half)

    def _write_head(self, strongest: float | None) -> None:
        """Title, what is drawn larger, and the scales of colours, above everything else."""
        scale, write = self._projection.scale, self.figure.text
        title = self._scenery.data.title[:_MOST_LETTERS]
        size = 21.0 * min(1.0, 46.0 / max(len(title), 1))
        write(_LINE[0], 0.955, title, fontsize=size, fontweight="bold")
        view = self._picture.view
        parts = [f"{'widths' if view is View.PLAN else 'heights'} × {scale.size:g}"]
        if view is View.OBLIQUE:
            parts = [f"heights and widths × {scale.size:g}"]
        if scale.along > 1.0 and view is not View.ALONG and TRAIN in self._scenery.parts:
            parts.append(f"pantographs along the track × {scale.along:g}")
        parts.append(f"motion × {scale.motion:g}")
        if any(shape.schematic for shape in self._scenery.shapes):
            parts.append("arms are schematic")
        write(_LINE[0], 0.896, ",  ".join(parts), fontsize=14, color="#50555c")
        self.words = write(_LINE[0], 0.925, "", fontsize=17, animated=True)
        _, title, low, high = self._colours
        bars: list[tuple[float, tuple[str, ...], float, float, str]] = [
            (0.56, MOTIONS, 1e3 * low, 1e3 * high, f"{title} [mm]")
        ]
        if strongest is not None and DROPPERS in self._scenery.line:
            bars.append((0.79, DROPPER_FORCES, 0.0, strongest, "dropper force [N]"))
        for left, stops, bottom, top, label in bars:
            axes = self.figure.add_axes((left, 0.935, 0.195, 0.016))
            shown = ScalarMappable(Normalize(bottom, top), ramp(stops))
            bar = self.figure.colorbar(shown, cax=axes, orientation="horizontal")
            bar.outline.set_visible(False)  # type: ignore[operator]
            # Zero has no number where that would touch the number of an end.
            apart = min(-bottom, top) > _APART * (top - bottom)
            bar.set_ticks([bottom, 0.0, top] if apart else [bottom, top])
            axes.tick_params(labelsize=13, length=4)
            write(left, 0.965, label, fontsize=14)
        if len(bars) > 1:
            write(0.985, 0.965, "- - -  slack", fontsize=14, color=SLACK, ha="right")

    def _add_lines(self, strongest: float | None) -> None:
        """Add the moving artists, empty, from behind to the front."""
        axes = self._axes

        def lines(**how: Any) -> LineCollection:
            made = LineCollection([], animated=True, capstyle="round", **how)
            axes.add_collection(made, autolim=False)
            return made

        train = PolyCollection([], animated=True, linewidths=0.8, edgecolors="#b6bcc4")
        axes.add_collection(train, autolim=False)
        self._train = train
        self._still = {
            kind: lines(linewidths=_USUAL * LOOKS[kind].thick, colors=LOOKS[kind].colour)
            for kind in (TRACK, MASTS, ARMS, CLAMPS)
        }
        if self._picture.view is View.PLAN:
            self._still[MASTS].set_linewidth(_USUAL * LOOKS[CLAMPS].thick)
        width = _USUAL * LOOKS[DROPPERS].thick
        forces = ramp(DROPPER_FORCES).with_extremes(bad=UNKNOWN)
        self.droppers = lines(linewidths=width, cmap=forces, norm=Normalize(0.0, strongest or 1.0))
        self.slack = lines(linewidths=1.3 * width, colors=SLACK, linestyles=(0, (2.5, 2.0)))
        self.slack.set_capstyle("butt")
        limits = Normalize(1e3 * self._colours.low, 1e3 * self._colours.high)
        self.wires = lines(cmap=ramp(MOTIONS), norm=limits)
        about = self._scenery.parts[PANTOGRAPHS].fields
        self.bodies = lines(
            linewidths=[_USUAL * THICK[kind] for kind in about["kind"].tolist()],
            colors=[COLOURS[p % len(COLOURS)] for p in about["number"].tolist()],
        )
        self._arrows = lines(linewidths=2.0, colors="black")
        self.values = [
            axes.text(
                0.0, 0.0, "", color=COLOURS[p % len(COLOURS)], fontsize=17,
                fontweight="bold", clip_on=True, va="center",
                ha="left" if self._picture.view is View.ALONG else "center", animated=True,
                bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 2.0},
            )
            for p in range(self._scenery.data.n_pantographs)
        ]  # fmt: skip
        still = [self._still[kind] for kind in (TRACK, MASTS, ARMS, CLAMPS)]
        self.moving: list[Artist] = [
            *still[:2], train, *still[2:], self.droppers, self.slack,
            self.bodies, self.wires, self._arrows, *self.values, self.words,
        ]  # fmt: skip
        if self._picture.view is View.PLAN:
            self.moving[:3] = [train, *still[:2]]

    def update(
        self,
        row: int,
        moved: np.ndarray,
        beside: dict[str, Places],
        forces: np.ndarray | None,
        span: tuple[float, float],
    ) -> None:
        """Show a time.

        Parameters
        ----------
        row : int
            Record at that time.
        moved : ndarray, shape (n_nodes, 3)
            Displacements of the line's nodes [m], NaN where they are not known.
        beside : dict
            Parts beside the line, see `Scenery.beside`.
        forces : ndarray, shape (n_droppers,), or None
            Forces of the droppers [N], zero if slack; None if not recorded.
        span : tuple of float
            Line in the picture, from and to [m].
        """
        # Unknown points are beyond the picture, or at rest.
        moved = np.nan_to_num(moved)
        data, view = self._scenery.data, self._picture.view
        low, high = span[0] - _NEAR, span[1] + _NEAR
        eye = 0.0
        if view is View.ALONG:
            eye = data.position[row, self._followed].max() - EYE
            low, high = eye + EYE - _SEEN_BEHIND, eye + EYE + _SEEN_AHEAD
        else:
            self._axes.set_xlim(*span)
        wires: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        for part in self._parts:
            kind, rest, by = part.kind, part.rest, part.moved(moved)
            x = rest[part.cells, 0]
            chosen = (x.max(axis=1) >= low) & (x.min(axis=1) <= high)
            if kind == DROPPERS:
                chosen &= data.gone > data.time[row]
            ends = part.cells[chosen]
            lines = self._projection.seen(rest[ends].reshape(-1, 3), by[ends].reshape(-1, 3), eye)
            lines = lines.reshape(-1, 2, 2)
            if kind in (CONTACT, WIRE):
                colour = 1e3 * by[ends, self._colours.axis].mean(axis=1)
                wires.append((lines, colour, np.full(len(lines), _USUAL * LOOKS[kind].thick)))
            elif kind == DROPPERS:
                self._show_droppers(lines, None if forces is None else forces[chosen])
            else:
                self._still[kind].set_segments(list(lines))
        lines = np.zeros((0, 2, 2))
        if wires:
            lines, colour, thick = (np.concatenate(own) for own in zip(*wires, strict=True))
            self.wires.set_segments(list(lines))
            self.wires.set_array(colour)
            self.wires.set_linewidth(thick.tolist())
        self._show_beside(row, beside, eye, lines)

    def _show_droppers(self, lines: np.ndarray, forces: np.ndarray | None) -> None:
        slack = np.zeros(len(lines), dtype=bool) if forces is None else forces <= 0.0
        self.droppers.set_segments(list(lines[~slack]))
        self.droppers.set_array(np.full(len(lines), np.nan) if forces is None else forces[~slack])
        self.slack.set_segments(list(lines[slack]))

    def _show_beside(
        self, row: int, beside: dict[str, Places], eye: float, wires: np.ndarray
    ) -> None:
        """Show train, track, pantographs and forces, and their values above the ``wires``, whose
        ends (n, 2, 2) are places in the picture."""
        seen, data, parts = self._projection.seen, self._scenery.data, self._scenery.parts
        rest, moved = beside[TRACK]
        if self._picture.view is View.ALONG:
            rest = np.column_stack([np.clip(rest[:, 0], eye, eye + EYE + _SEEN_AHEAD), rest[:, 1:]])
        self._still[TRACK].set_segments(list(seen(rest, moved, eye)[parts[TRACK].cells]))
        if TRAIN in parts:
            corners = seen(*beside[TRAIN], eye)[parts[TRAIN].cells]
            shades = parts[TRAIN].fields["face"]
            self._train.set_verts(corners)
            self._train.set_facecolor([_FACES[face] for face in shades.tolist()])
        rest, moved = (np.array(points) for points in beside[PANTOGRAPHS])
        if self._picture.view is not View.ALONG:
            middle = data.position[row][self._scenery.number]
            along = self._projection.scale.along
            rest[:, 0] = middle + along * (rest[:, 0] - middle)
            moved[:, 0] *= along
        cells = parts[PANTOGRAPHS].cells
        bodies = seen(rest, moved, eye)[cells]
        before = np.ones(data.n_pantographs, dtype=bool)
        if self._picture.view is View.ALONG:
            # Pantographs behind the eye, or beside it, are none of the picture.
            x = (rest + moved)[:, 0]
            np.logical_and.at(before, self._scenery.number, x > eye + NEAREST)
            bodies[~before[self._scenery.number[cells[:, 0]]]] = np.nan
        self.bodies.set_segments(list(bodies))
        above = np.concatenate([wires, bodies]).reshape(-1, 2)
        width = float(np.ptp(self._axes.get_xlim()))
        arrows = []
        tops = seen(*beside[FORCES], eye)
        for force, at, text, is_seen in zip(
            data.force[row].tolist(), tops, self.values, before, strict=True
        ):
            text.set_visible(is_seen)
            arrow = self._arrow(force if is_seen else 0.0) + at
            arrows.append(arrow)
            text.set_text(f"{force:.0f} N")
            top = float(arrow[..., 1].max())
            if self._picture.view is View.ALONG:
                # Wires go up to the edge of the picture.
                text.set_position((at[0] + 0.012 * width, top))
                continue
            near = above[np.abs(above[:, 0] - at[0]) < _BESIDE_VALUE * width, 1]
            text.set_position((at[0], max(top, near.max(initial=top)) + _ABOVE_VALUE * width))
        self._arrows.set_segments(list(np.concatenate(arrows)))

    def _arrow(self, force: float) -> np.ndarray:
        """Stem and tip of the arrow of a force, (3, 2, 2); from above a cross."""
        if self._picture.view is View.PLAN:
            half = 0.6 * float(force != 0.0)
            return half * np.array([[[-1, -1], [1, 1]], [[-1, 1], [1, -1]], [[0, 0], [0, 0]]])
        size = self._projection.scale.size
        length = _ARROW * size * room_above(self._scenery.data) * force
        back, beside = 0.25 * length, 0.12 * length
        tip = [0.0, length]
        return np.array(
            [[[0.0, 0.0], tip], [[-beside, length - back], tip], [[beside, length - back], tip]]
        )

    def pixels(self) -> np.ndarray:
        """The picture as it stands, (height, width, 4) uint8, valid until the next one."""
        with _styled():
            if self._ground is None:
                self.chart.legend(
                    loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False,
                    borderaxespad=0.1,
                )  # fmt: skip
                self._canvas.draw()
                self._ground = self._canvas.copy_from_bbox(self.figure.bbox)
            self._canvas.restore_region(self._ground)
            renderer = self._canvas.get_renderer()
            for artist in self.moving:
                artist.draw(renderer)
        return np.asarray(self._canvas.buffer_rgba())


def ramp(stops: tuple[str, ...]) -> LinearSegmentedColormap:
    """A scale of colours through some."""
    return LinearSegmentedColormap.from_list("ramp", stops)


def _seen_parts(scenery: Scenery, view: View) -> list[LinePart]:
    """Parts of the line that a view shows: from the side an arm is a dot before its mast, and from
    above a mast is a line across the track."""
    found = [one for one in scenery.line.values() if one.kind != ARMS or view is not View.SIDE]
    for number, one in enumerate(found):
        if one.kind == MASTS and view is View.PLAN:
            across = np.tile([-_ACROSS, _ACROSS], len(one.cells))
            rest = np.column_stack([one.rest[:, 0], across, one.rest[:, 2]])
            found[number] = replace(one, rest=rest)
    return found


class ForceChart:
    """The contact force along the track. Not collective.

    Attributes
    ----------
    curves : the force as it is and below 20 Hz, of each pantograph
    moving : artists drawn anew in each picture

    Parameters
    ----------
    axes : where it is drawn
    data : of the run
    rows : records that the chart shows, from the first to one after the last
    width : length of line that is shown [m]
    """

    def __init__(self, axes: Axes, data: FilmData, rows: tuple[int, int], width: float) -> None:
        self._axes, self._data, self._first = axes, data, rows[0]
        # A filter swings below zero after a loss of contact, where the force itself is zero.
        shown = np.stack([data.force[slice(*rows)], data.filtered[slice(*rows)]])
        low = float(np.nanmin(shown, initial=0.0))
        high = float(np.nanmax(shown, initial=1.0))
        axes.set(xlabel="position along the track [m]", ylabel="contact force [N]")
        axes.set_ylim(1.05 * low, 1.05 * high)
        steps = np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 2.0, 5.0]).ravel()
        axes.xaxis.set_major_locator(MultipleLocator(steps[steps > width / _MOST_MARKS].min()))
        axes.xaxis.set_animated(True)
        self.curves = []
        for p, name in enumerate(data.names):
            colour = COLOURS[p % len(COLOURS)]
            label = name + ("" if data.excitation else ", below 20 Hz")
            (raw,) = axes.plot(
                [], [], color=(colour, 0.4), linewidth=1.0, animated=True,
                marker="o", markersize=7, markevery=[-1], markerfacecolor=colour,
            )  # fmt: skip
            (bold,) = axes.plot([], [], color=colour, linewidth=2.5, label=label, animated=True)
            self.curves.append((raw, bold))
        self.moving: list[Artist] = [axes.xaxis, *(one for both in self.curves for one in both)]

    def update(self, row: int, low: float, high: float) -> None:
        """Show the force from ``low`` to ``high`` along the track [m], up to the record number
        ``row``."""
        data = self._data
        self._axes.set_xlim(low, high)
        for p, (raw, bold) in enumerate(self.curves):
            x = data.position[:, p]
            # A pantograph may be behind all that is shown.
            begin = min(max(self._first, int(x.searchsorted(low)) - 1), row)
            end = row + 1
            # Back from the record, which is always shown.
            chosen = slice(
                end - 1, begin - 1 if begin else None, -(1 + (end - begin) // _MOST_POINTS)
            )
            raw.set_data(x[chosen][::-1], data.force[chosen, p][::-1])
            bold.set_data(x[chosen][::-1], data.filtered[chosen, p][::-1])


class RingingChart:
    """Motion of the contact wire over time at the place of a blow. Not collective.

    Attributes
    ----------
    curve : over the time until now
    moving : artists drawn anew in each picture

    Parameters
    ----------
    axes : where it is drawn
    data : of a line that a blow struck
    blow : which
    snapshots, numbers : snapshots, and which of them the film shows
    """

    def __init__(
        self, axes: Axes, data: FilmData, blow: Blow, snapshots: Snapshots, numbers: np.ndarray
    ) -> None:
        nodes = data.wires[data.touched(blow.at)]
        x = data.points[nodes, 0]
        found = [np.interp(blow.at, x, snapshots.uplift(n)[nodes]) for n in numbers.tolist()]
        shown = np.isfinite(found)
        self._data = data
        self._time, self._uplift = snapshots.times[numbers][shown], 1e3 * np.array(found)[shown]
        ends = float(self._uplift.min(initial=0.0)), float(self._uplift.max(initial=1e-3))
        room = 0.05 * (ends[1] - ends[0])
        axes.set(xlabel="time [s]", ylabel=f"uplift at {blow.at:g} m [mm]")
        axes.set_xlim(snapshots.times[numbers[0]], snapshots.times[numbers[-1]])
        axes.set_ylim(ends[0] - room, ends[1] + room)
        # For how long it acted.
        label = f"{blow.kind}, up to {blow.peak:.3g} N"
        axes.axvspan(0.0, blow.duration, color="#6e6e6e", alpha=0.4, label=label)
        (self.curve,) = axes.plot(
            [], [], color=COLOURS[0], linewidth=2.5, label="contact wire", animated=True
        )
        self.moving: list[Artist] = [self.curve]

    def update(self, row: int, low: float, high: float) -> None:
        """Show the motion up to the record number ``row``, whatever part of the line is shown."""
        n = int(self._time.searchsorted(self._data.time[row], side="right"))
        self.curve.set_data(self._time[:n], self._uplift[:n])
