"""Figures of matplotlib in one style: made empty, labelled, and turned into PNG or SVG.

Nothing here needs a display or touches files. A user's ``matplotlibrc`` changes no picture. Long
curves are thinned so that every peak stays visible.
"""

from __future__ import annotations

import contextlib
import io
import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator, NullFormatter
from matplotlib.transforms import ScaledTranslation
from PIL import Image

from catenary.base.errors import CatenaryError
from catenary.postproc.evaluate.wording import with_minus

logger = logging.getLogger("catenary.pictures")

# Okabe and Ito's colours, which the colour-blind tell apart; stripes are blue, yellow and orange.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000")
GREY, LIGHT, SHADE, LIMIT = "#6b6b6b", "#c9c9c9", "#e1e8f2", "#b3261e"
RUN_IN, WORST = "#fff4cc", "#fbd9b5"
# Lines, marks and hatches of a panel, which a print without colours tells apart: the first colours
# are nearly the same grey.
LINES, MARKS, HATCHES = ("-", "--", "-.", ":"), ("o", "s", "^", "D"), ("", "//", "..", "xx")
WIDTH = 9.0
_RESOLUTION = 130
# Room around panels whose layout is not computed [inch]: tick labels of six characters and a
# label at the left; half a tick label at the right; a legend or a title above; tick labels and a
# label below.
_LEFT, _RIGHT, _ABOVE, _BELOW = 0.9, 0.2, 0.32, 0.52
# Between panels that share their x axis, whose inner tick labels are not drawn.
_SHARED_GAP = 0.44
# Intervals between ticks at most, along x and y, and their sizes: a tick with its label and its
# line of the grid takes as long to draw as a curve.
_MOST_TICKS, STEPS = (8, 5), (1.0, 2.0, 2.5, 5.0, 10.0)
# Compression of a PNG: a higher level costs half as much time again and saves a twentieth.
_LEVEL = 3
# Curves of fewer points are drawn as they are; of others two points a bin, the smallest and the
# largest value: several bins for each dot of a picture.
MOST_POINTS, _BINS = 20_000, 5_000

_in_own_style = False  # whether a function of ``own_style`` is at work


class FewTicks(MaxNLocator):
    """Round places for ticks, none beyond the limits of its axis.

    Matplotlib's own has one more at either end, which is made and not drawn: a tick is three lines
    and two texts, and most of the work of a picture.
    """

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Places between ``vmin`` and ``vmax``."""
        low, high = sorted((vmin, vmax))
        slack = 1e-9 * (high - low)
        places = np.asarray(super().tick_values(vmin, vmax))
        return places[(places >= low - slack) & (places <= high + slack)]


@contextlib.contextmanager
def own_style() -> Iterator[None]:
    """Matplotlib's default settings in place of the user's, until the context ends.

    A context manager, and as ``@own_style()`` a decorator of every function that makes a figure:
    lines and texts take the settings of the moment in which they are made.
    """
    global _in_own_style
    if _in_own_style:
        yield
        return
    # To set a backend would import pyplot, which nothing here needs.
    usual = {key: value for key, value in matplotlib.rcParamsDefault.items() if key != "backend"}
    # A tick tells its value by itself, not what is to be added to a number in a corner.
    usual["axes.formatter.useoffset"] = False
    with matplotlib.rc_context(usual):
        _in_own_style = True
        try:
            yield
        finally:
            _in_own_style = False


class ShownFigure(Figure):
    """A figure that a notebook shows without pyplot, which has to be imported for others."""

    def _repr_png_(self) -> bytes:
        """The figure as it is now, which IPython asks for."""
        stream = io.BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()


def new_figure(height: float) -> Figure:
    """An empty figure of the report's width, its layout computed when it is drawn.

    The computation costs as much as the drawing; ``stacked`` does without.

    Parameters
    ----------
    height : float
        Height of the figure [inch].
    """
    figure = ShownFigure(figsize=(WIDTH, height), dpi=_RESOLUTION, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def panels(height: float, rows: int = 1, columns: int = 1, **how: Any) -> tuple[Figure, Any]:
    """A figure as of ``new_figure`` and its panels, as ``Figure.subplots`` gives them for ``how``.

    Parameters
    ----------
    height : float
        Height of the figure [inch].
    rows, columns : int, optional
        Number of panels one below the other and side by side.
    **how : dict
        Further arguments of Matplotlib's ``subplots``.
    """
    figure = new_figure(height)
    return figure, figure.subplots(rows, columns, **how)


def stacked(height: float, n: int, *, shared: bool = False) -> tuple[Figure, list[Axes]]:
    """A figure of the report's width with ``n`` panels one below the other, and the panels.

    The layout is given, not computed: there is room for one line of title and legend above each
    panel and for tick labels of six characters at its left.

    Parameters
    ----------
    height : float
        Height of the figure [inch].
    n : int
        Number of panels, at least 1.
    shared : bool, optional
        Whether the panels have one x axis, whose labels stand below the last one, and one scale of
        y.
    """
    figure = ShownFigure(figsize=(WIDTH, height), dpi=_RESOLUTION)
    FigureCanvasAgg(figure)
    gap = _SHARED_GAP if shared else _ABOVE + _BELOW
    panel = (height - _ABOVE - _BELOW - (n - 1) * gap) / n
    panels = figure.subplots(
        n,
        1,
        sharex=shared,
        sharey=shared,
        squeeze=False,
        gridspec_kw={
            "left": _LEFT / WIDTH,
            "right": 1.0 - _RIGHT / WIDTH,
            "bottom": _BELOW / height,
            "top": 1.0 - _ABOVE / height,
            "hspace": gap / panel,
        },
    )
    return figure, list(panels[:, 0])


def _in_turns(looks: Sequence[str]) -> Callable[[int], str]:
    """Looks by the number of a pantograph or curve, after the last one the first again."""
    return lambda number: looks[number % len(looks)]


# Colour of a pantograph, the same in all pictures; line, mark and hatching in a panel of several.
colour, line, mark, hatch = map(_in_turns, (COLOURS, LINES, MARKS, HATCHES))


def curve(
    axes: Axes,
    x: Any,
    y: Any,
    number: int,
    label: str | None = None,
    look: str = "-",
    width: float = 1.2,
    **how: Any,
) -> None:
    """Draw a curve with the colour of a number, a long one by its extremes.

    Parameters
    ----------
    axes : Axes
        Panel.
    x, y : array_like, shape (n,)
        Points of the curve, in the units of the panel.
    number : int
        Number of the pantograph or curve, which has its colour.
    label : str, optional
        Entry of the legend; none without it.
    look : str, optional
        Matplotlib's format of markers and line.
    width : float, optional
        Width of the line [pt].
    **how : dict
        Further properties of Matplotlib's line, which win.
    """
    usual: dict[str, Any] = {"color": colour(number), "linewidth": width, "ms": 3.5, "label": label}
    shown = thinned(np.asarray(y))
    if isinstance(shown, np.ndarray):
        x, y = np.asarray(x)[shown], np.asarray(y)[shown]
    axes.plot(x, y, look, **(usual | how))


def uprights(axes: Axes, x: np.ndarray, low: Any, high: Any, **how: Any) -> None:
    """Draw upright lines as one curve: a picture has hundreds, and a PDF takes each apart.

    Parameters
    ----------
    axes : Axes
        Panel.
    x : ndarray, shape (n,)
        Places of the lines, in the unit of the panel.
    low, high : array_like, shape (n,) or ()
        Their ends.
    **how : dict
        Properties of Matplotlib's line.
    """
    ends = np.broadcast_arrays(low, high, np.nan, x)[:3]
    axes.plot(np.repeat(x, 3), np.stack(ends, axis=1).ravel(), solid_capstyle="butt", **how)


def tidy(axes: Axes, x_label: str, y_label: str, title: str = "", *, legend: bool = False) -> None:
    """Give a panel labels, a light grid, few ticks and no box.

    Parameters
    ----------
    axes : Axes
        Panel.
    x_label, y_label : str
        Quantity of each axis, with its unit in brackets.
    title : str, optional
        Title above the panel, at its left.
    legend : bool, optional
        Whether a legend stands above the panel, at its right.
    """
    for axis, most in zip((axes.xaxis, axes.yaxis), _MOST_TICKS, strict=True):
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(FewTicks(most, steps=STEPS))
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    _fix_labels(axes)
    axes.set_title(title, loc="left", fontsize="medium", y=1.0)
    axes.grid(True, color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if legend:
        legend_above(axes)


def wrapped(label: str, width: int = 22) -> str:
    """A label in lines of at most ``width`` characters, its unit on the line of its last word."""
    kept = fill(label.replace(" [", "\u00a0["), width, break_on_hyphens=False)
    return kept.replace("\u00a0", " ")


def log_log(axes: Axes) -> None:
    """Logarithmic axes with plain numbers, 1, 2 and 5 of each decade."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def legend_above(axes: Axes, columns: int = 8) -> Legend:
    """Legend above the axes at the right, where no curve can pass.

    Where it is too long to stand beside the title, ``png`` makes room for it.

    Parameters
    ----------
    axes : Axes
        Panel, whose curves have labels.
    columns : int, optional
        Entries side by side, at most.
    """
    return axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=columns,
        frameon=False,
        fontsize="small",
        borderaxespad=0.1,
        handlelength=1.6,
        columnspacing=1.2,
    )


def painted(name: str, draw: Callable[[], Figure | None]) -> dict[str, bytes]:
    """A picture as ``{name: file}``, PNG, SVG or JSON of Plotly by its suffix; empty if none can be
    drawn.

    A failure is logged and costs this picture alone. Results that are damaged, a `CatenaryError`,
    are not a failure of drawing and are raised.

    Parameters
    ----------
    name : str
        Name of the file, with its suffix.
    draw : callable
        Makes the figure, or returns None if there is nothing to show.
    """
    try:
        with own_style():
            figure = draw()
            if figure is None:
                return {}
            if name.endswith(".json"):
                from catenary.postproc.report.pictures.interactive import as_json

                return {name: as_json(figure).encode()}
            return {name: file_of(figure, name)}
    except CatenaryError:
        raise
    except Exception as error:
        reason = str(error) or type(error).__name__
        logger.warning("%s was not drawn (%s); all figures are in the other files", name, reason)
        return {}


def file_of(figure: Figure, name: str) -> bytes:
    """``figure`` as the bytes of a file, SVG or PNG by the suffix of its ``name``."""
    return svg(figure) if name.endswith(".svg") else png(figure)


@own_style()
def png(figure: Figure) -> bytes:
    """``figure`` as the bytes of a PNG file. A dollar sign in a text is one, and no formula."""
    canvas = _prepared(figure)
    with warnings.catch_warnings():
        # Names may be written in letters that the font has not; boxes stand for them.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        canvas.draw()  # once; savefig draws twice, to measure and to paint
    picture = Image.frombuffer("RGBA", canvas.get_width_height(), canvas.buffer_rgba())
    stream = io.BytesIO()
    resolution = (_RESOLUTION, _RESOLUTION)
    picture.convert("RGB").save(stream, "png", compress_level=_LEVEL, dpi=resolution)
    return stream.getvalue()


@own_style()
def svg(figure: Figure) -> bytes:
    """``figure`` as the bytes of an SVG file, whose texts are texts."""
    _prepared(figure)
    stream = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "catenary"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


@own_style()
def fitted(figure: Figure) -> Figure:
    """``figure`` with room for its legends, and no formulas in its texts."""
    _prepared(figure)
    return figure


def _prepared(figure: Figure) -> FigureCanvasAgg:
    """The canvas of a figure whose legends have room and whose texts are no formulas."""
    for text in _texts(figure):
        text.set_text(with_minus(text.get_text()))
        if "$" in text.get_text():
            text.set_parse_math(False)
    canvas = figure.canvas
    if not isinstance(canvas, FigureCanvasAgg):  # a figure that `new_figure` has not made
        canvas = FigureCanvasAgg(figure)
    _make_room_for_legends(figure, canvas)
    return canvas


def _make_room_for_legends(figure: Figure, canvas: FigureCanvasAgg) -> None:
    """Enlarge a figure of ``stacked`` where a legend does not fit beside its title.

    The legend then has fewer columns, and the title stands above it.
    """
    if figure.get_layout_engine() is not None:
        return
    width, height = figure.get_size_inches()
    room = (width - _LEFT - _RIGHT) * figure.dpi
    grown = {
        axes: _room_above(axes, legend, canvas, room)
        for axes in figure.axes
        if (legend := axes.get_legend()) is not None
    }
    if not any(grown.values()):
        return
    taller = height + sum(grown.values())
    places = {axes: axes.get_position() for axes in figure.axes}
    figure.set_size_inches(width, taller)
    below = 0.0
    for axes in sorted(figure.axes, key=lambda one: places[one].y0):
        at = places[axes]
        low = at.y0 * height + below
        axes.set_position((at.x0, low / taller, at.width, at.height * height / taller))
        below += grown.get(axes, 0.0)


def _room_above(axes: Axes, legend: Legend, canvas: FigureCanvasAgg, room: float) -> float:
    """Height that the legend of a panel needs beyond a line [inch]; its title moves above it.

    ``room`` is the width of the panel [px].
    """
    title = axes.get_title(loc="left")
    labels = [text.get_text() for text in legend.get_texts()]
    # A letter is 8 px wide at most and the sign of an entry with its gaps some 60: shorter legends,
    # as most are, need no measuring.
    if 8 * (len(title) + sum(map(len, labels))) + 60 * len(labels) < room:
        return 0.0
    renderer = canvas.get_renderer()
    written = axes.set_title(title, loc="left", fontsize="medium", y=1.0)
    beside = written.get_window_extent(renderer)
    columns = len(labels)
    legend = legend_above(axes, columns)
    while True:
        box = legend.get_window_extent(renderer)
        if box.width <= room or columns == 1:
            break
        columns -= 1
        legend = legend_above(axes, columns)
    if len(labels) <= columns and box.width + beside.width + 10 <= room:
        return 0.0
    dpi = axes.figure.dpi
    gap = box.height / dpi
    if title:
        axes.set_title(title, loc="left", fontsize="medium", y=1.0, pad=72.0 * gap + 6.0)
        gap += beside.height / dpi + 0.12
    return float(max(gap - _ABOVE, 0.0))


def _fix_labels(axes: Axes) -> None:
    """Put the labels of a panel of ``stacked`` where their room is, without measuring ticks."""
    figure = axes.figure
    assert isinstance(figure, Figure)
    if figure.get_layout_engine() is not None:
        return
    below = ScaledTranslation(0.0, 0.06 - _BELOW, figure.dpi_scale_trans)
    beside = ScaledTranslation(0.06 - _LEFT, 0.0, figure.dpi_scale_trans)
    axes.xaxis.set_label_coords(0.5, 0.0, axes.transAxes + below)
    axes.yaxis.set_label_coords(0.0, 0.5, axes.transAxes + beside)
    axes.xaxis.label.set_verticalalignment("bottom")
    axes.yaxis.label.set_verticalalignment("top")


def _texts(artist: Artist) -> Iterator[Text]:
    """All texts of a figure but those of ticks, which are not there before it is drawn."""
    for child in artist.get_children():
        if isinstance(child, Text):
            yield child
        elif isinstance(child, Axis):
            yield child.label
        else:
            yield from _texts(child)


def thinned(y: np.ndarray) -> np.ndarray | slice:
    """Points of a curve that are drawn, as an index for ``x`` and ``y``.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Values of the curve in order; NaN leaves a gap where all values of a bin are NaN.
    """
    return slice(None) if y.size <= MOST_POINTS else _extremes(y)


def thinned_ranges(low: np.ndarray, high: np.ndarray) -> np.ndarray | slice:
    """Likewise of ranges, from ``low`` to ``high`` (n,): the extremes of both ends are drawn."""
    if low.size <= MOST_POINTS:
        return slice(None)
    return np.union1d(_extremes(low), _extremes(high))


def _extremes(y: np.ndarray) -> np.ndarray:
    """Indices of the smallest and the largest value of each bin."""
    size = -(-y.size // _BINS)
    n_whole = y.size // size
    blocks = y[: n_whole * size].reshape(n_whole, size)
    first = size * np.arange(n_whole)
    lowest, highest = _place(blocks, np.argmin, np.inf), _place(blocks, np.argmax, -np.inf)
    ends = [0, y.size - 1]
    return np.unique(
        np.concatenate([ends, first + lowest, first + highest, np.arange(n_whole * size, y.size)])
    )


def _place(
    blocks: np.ndarray, which: Callable[[np.ndarray], np.intp], instead: float
) -> np.ndarray:
    """Index of the extreme in each block; 0 if all values are NaN."""
    found = np.empty(blocks.shape[0], dtype=np.int64)
    for number, block in enumerate(blocks):
        gaps = np.isnan(block)
        found[number] = which(np.where(gaps, instead, block) if gaps.any() else block)
    return found
