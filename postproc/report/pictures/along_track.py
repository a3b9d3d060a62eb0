"""Pictures along the track: panels of pantographs, marks of the line, passages over each other.

Marks are supports, droppers and the evaluation stretch. Passages over each other are those of two
runs, or of a run and what was measured.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.wording import capital
from catenary.postproc.read.results import Results, in_stretch
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    GREY,
    LIGHT,
    SHADE,
    curve,
    line,
    own_style,
    stacked,
    thinned_ranges,
    tidy,
    uprights,
)

# More supports or droppers than these are no marks but a grey ground: they are left out.
_MOST_SUPPORTS, _MOST_DROPPERS = 200, 1000
POSITION = "position along the track [m]"
# Label, places along the track (n,) [m], and values (n,) there.
Curve = tuple[str, np.ndarray, np.ndarray]
# Marks of a panel: those of equal values let each other be seen.
_MARKS = ("o", "x", "^", "s")


@own_style()
def panels_along_track(
    results: Results,
    channel: str,
    shown: Mapping[int, Sequence[tuple[str, int]]],
    label: str,
    *,
    low_pass: bool = False,
    dashed: bool = False,
    factor: float = 1.0,
) -> tuple[Figure, list[Axes]]:
    """A panel for each pantograph with curves of a channel over the pantograph's position.

    Parameters
    ----------
    results : Results
        Results of the run.
    channel : str
        Name of the channel.
    shown : mapping
        Name and column of each curve, by number of the pantograph.
    label : str
        Quantity of the channel, with its unit in brackets.
    low_pass : bool, optional
        Take the part below 20 Hz, unless the record is sampled too slowly.
    dashed : bool, optional
        Dash the second of two curves, which may lie on each other.
    factor : float, optional
        Unit of the channel over that of ``label``.
    """
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.3 * len(shown), len(shown), shared=True)
    for axes, (p, curves) in zip(panels, shown.items(), strict=True):
        mark_line(axes, results, start, end, named=axes is panels[0])
        for number, (name, column) in enumerate(curves):
            values = results.column(channel, column)
            if low_pass:
                with contextlib.suppress(InputError):  # the report says so
                    values = filters.low_pass(values, results.dt)
            position, own = results.column("contact_position", p), number if curves[1:] else p
            curve(
                axes, position, factor * values, own, name, "-" if not dashed else line(number % 2)
            )
        tidy(axes, "", label, title_of(results, p), legend=True)
    panels[-1].set_xlabel("position of the pantograph along the track [m]")
    return figure, panels


def mark_line(
    axes: Axes, results: Results, start: float, end: float, *, named: bool = True
) -> None:
    """Mark the line in a panel along the track.

    Supports are lines, droppers ticks at the bottom, the evaluation stretch is shaded.

    Parameters
    ----------
    axes : Axes
        Panel.
    results : Results
        Results of the run.
    start, end : float
        From and to of the panel [m].
    named : bool, optional
        Whether its legend names these marks; of several panels the first one does.
    """
    _shade(axes, results.evaluation, named)
    _mark_parts(axes, results, start, end, named)
    axes.set_xlim(start, end)


def mark_static(axes: Axes, results: Results, start: float, end: float) -> None:
    """Supports and droppers of the line at rest from ``start`` to ``end`` [m], with a margin at
    both ends."""
    _mark_parts(axes, results, start, end, named=True)
    axes.set_xlim(*with_margin(np.array([start, end])))


def _mark_parts(axes: Axes, results: Results, start: float, end: float, named: bool) -> None:
    """Supports as lines over the whole height, in one collection, and droppers as ticks at the
    bottom, where they are not too many."""
    support, dropper = results.line("support_x"), results.line("dropper_x")
    support = support[in_stretch(support, start, end)]
    dropper = dropper[in_stretch(dropper, start, end)]
    transform = axes.get_xaxis_transform()
    if 0 < support.size <= _MOST_SUPPORTS:
        lines = [((x, 0.0), (x, 1.0)) for x in support]
        known: dict[str, Any] = {"colors": LIGHT, "linewidths": 0.9, "zorder": 1}
        known |= {"label": "support" if named else None, "transform": transform}
        axes.add_collection(LineCollection(lines, **known), autolim=False)
    if 0 < dropper.size <= _MOST_DROPPERS:
        uprights(axes, dropper, 0.0, 0.035, color=GREY, linewidth=0.7, transform=transform)
        axes.plot([], [], "|", color=GREY, markersize=5, label="dropper" if named else None)


def draw_ranges(axes: Axes, x: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Ranges over the run from ``low`` to ``high`` (n,) at places ``x`` (n,) as upright lines, with
    dashes where they are too small for a line that would be seen."""
    drawn = thinned_ranges(low, high)
    how: dict[str, Any] = {"color": COLOURS[0], "linewidth": 1.6, "label": "range over the run"}
    uprights(axes, x[drawn], low[drawn], high[drawn], **how)
    still = high - low < 0.01 * (np.nanmax(high, initial=0.0) - np.nanmin(low, initial=0.0))
    axes.plot(x[still], high[still], "_", color=COLOURS[0], ms=3.0)


def title_of(results: Results, pantograph: int) -> str:
    """Title of the panel of a pantograph, empty if it is the only one."""
    names = results.pantograph_names()
    return capital(names[pantograph]) if len(names) > 1 else ""


def travelled(results: Results) -> tuple[float, float]:
    """From and to of the stretch on which a pantograph was [m]."""
    low, high = results.extremes("contact_position")
    return float(low.min()), float(high.max())


def with_margin(x: np.ndarray) -> tuple[float, float]:
    """Limits of an axis on which places ``x`` stand off its ends [m]."""
    if not x.size:
        return 0.0, 1.0
    margin = 0.015 * max(float(np.ptp(x)), 1.0)
    return float(x.min()) - margin, float(x.max()) + margin


@own_style()
def overlaid_forces(
    panels: Sequence[tuple[str, Sequence[Curve]]],
    evaluated: tuple[float, float] | None = None,
    below: str = "",
) -> Figure | None:
    """Contact forces along the track, a panel for each pantograph; None without pantographs.

    Parameters
    ----------
    panels : sequence of tuple
        Name of each pantograph, and its curves of forces [N].
    evaluated : tuple of float, optional
        From and to of the evaluation stretch, which is shaded [m].
    below : str, optional
        Cut-off of forces that are filtered, with its unit.
    """
    if not panels:
        return None
    n = len(panels)
    figure, axes = stacked(0.7 + 2.3 * n, n, shared=True)
    for own, (name, curves) in zip(axes, panels, strict=True):
        for number, (label, place, force) in enumerate(curves):
            curve(own, place, force, number, label, line(number))
        _shade(own, evaluated)
        force_of = f"contact force, {below} [N]" if below else "contact force [N]"
        tidy(own, "", force_of, capital(name), legend=True)
    axes[-1].set_xlabel(POSITION)
    return figure


@own_style()
def overlaid_uplifts(
    curves: Sequence[Curve], evaluated: tuple[float, float] | None = None
) -> Figure | None:
    """Largest uplifts at supports, as marks; None without any.

    Parameters
    ----------
    curves : sequence of Curve
        Curves of uplifts, positive upward [m].
    evaluated : tuple of float, optional
        From and to of the evaluation stretch, which is shaded [m].
    """
    if not curves:
        return None
    figure, (axes,) = stacked(3.2, 1)
    for number, (label, place, uplift) in enumerate(curves):
        curve(axes, place, 1e3 * uplift, number, label, _MARKS[number % len(_MARKS)])
    _shade(axes, evaluated)
    tidy(axes, POSITION, "largest uplift [mm]", legend=True)
    return figure


def _shade(axes: Axes, evaluated: tuple[float, float] | None, named: bool = True) -> None:
    if evaluated is not None:
        label = "evaluation stretch" if named else None
        axes.axvspan(*evaluated, color=SHADE, zorder=0, label=label)
