"""Pictures of the contact force: along the track, of strips and wires, its statistics."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy import signal

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.along_track import (
    mark_line,
    panels_along_track,
    title_of,
    travelled,
)
from catenary.postproc.report.pictures.figures import (
    GREY,
    LIMIT,
    RUN_IN,
    colour,
    curve,
    hatch,
    legend_above,
    line,
    own_style,
    stacked,
    tidy,
)

# Frequencies that a spectrum shows [Hz], and fewest records of one.
_HIGHEST, _FEWEST = 60.0, 64


@own_style()
def contact_force(results: Results) -> Figure:
    """Contact force of each pantograph along the track: unfiltered light, 20 Hz low-pass bold."""
    n = results.n_pantographs
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.3 * n, n, shared=True)
    arrivals = results.attributes.get("arrivals", {}).get("pantographs", [])
    for p, axes in enumerate(panels):
        mark_line(axes, results, start, end, named=p == 0)
        if p < len(arrivals):
            _mark_arrivals(axes, results.evaluation[0], arrivals[p])
        position, force = (results.column(f"contact_{name}", p) for name in ("position", "force"))
        curve(axes, position, force, p, "unfiltered", width=0.6, alpha=0.3)
        with contextlib.suppress(InputError):  # sampled too slowly; the report says so
            force = filters.contact_force(results, p)
            curve(axes, position, force, p, "20 Hz low-pass", width=1.5)
        tidy(axes, "", "contact force [N]", title_of(results, p), legend=True)
    panels[-1].set_xlabel("position along the track [m]")
    return figure


def _mark_arrivals(axes: Axes, evaluated_from: float, facts: Mapping[str, Any]) -> None:
    """The run-in of a pantograph, and where reflections of the line's ends reach it."""
    if facts.get("start_m") is not None and facts["start_m"] < evaluated_from:
        axes.axvspan(facts["start_m"], evaluated_from, color=RUN_IN, zorder=0, label="run-in")
    for end, style in (("near", ":"), ("far", "-.")):
        met = facts.get(f"{end}_end_met_at_m")
        if met is not None:
            label = f"{end}-end reflection"
            axes.axvline(met, color=LIMIT, linestyle=style, linewidth=1.3, label=label)


@own_style()
def force_spectrum(results: Results, lengths: Mapping[str, float]) -> Figure:
    """Power spectral density of the unfiltered force of each pantograph in the evaluation stretch.

    Parameters
    ----------
    results : Results
        Results of the run.
    lengths : mapping
        Lengths by which the line repeats [m], by name; the speed over each is a frequency.
    """
    start, end = results.evaluation
    figure, (axes,) = stacked(3.4, 1)
    speed = results.fact("speed")
    for p, name in enumerate(results.pantograph_names()):
        position = results.column("contact_position", p)
        force = results.column("contact_force", p)[(position >= start) & (position <= end)]
        if force.size < _FEWEST:
            continue
        # Four lines of the spectrum to the lowest frequency that is marked, if the record has them.
        wanted = int(4.0 * max(lengths.values()) / speed / results.dt)
        stretch = min(force.size, max(wanted, _FEWEST))
        frequency, power = signal.welch(force, 1.0 / results.dt, nperseg=stretch, detrend="linear")
        shown = (frequency > 0.0) & (frequency <= _HIGHEST)
        curve(axes, frequency[shown], power[shown], p, name, line(p), 1.3)
    for (word, length), style in zip(lengths.items(), ("--", ":"), strict=False):
        first = speed / length
        label = f"{word} passing, {first:.2f} Hz and multiples"
        for multiple in range(1, 4):
            if multiple * first <= _HIGHEST:
                how: Any = {"linestyle": style, "linewidth": 1.2 if multiple == 1 else 0.6}
                axes.axvline(multiple * first, color=GREY, label=label, **how)
                label = ""
    axes.axvline(filters.CUT_OFF, color=LIMIT, linewidth=0.9, label="end of the filtered band")
    axes.set_yscale("log")
    axes.set_xlim(0.0, _HIGHEST)
    tidy(axes, "frequency [Hz]", "spectral density [N²/Hz]", legend=True)
    return figure


@own_style()
def contact_height(
    results: Results, heights: Mapping[str, tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> Figure:
    """Height of the contact point and its gradient along the track.

    Parameters
    ----------
    results : Results
        Results of the run.
    heights : mapping
        Places [m], heights [m] and gradients [-], ndarrays of shape (n,), by name of the
        pantograph.
    """
    figure, (height, gradient) = stacked(4.8, 2)
    start, end = travelled(results)
    for axes, number, factor, label in (
        (height, 1, 1.0, "height above rail [m]"),
        (gradient, 2, 1e3, "gradient [‰]"),
    ):
        mark_line(axes, results, start, end, named=axes is height)
        for p, (name, own) in enumerate(heights.items()):
            curve(axes, own[0], factor * own[number], p, name, line(p))
        tidy(axes, "", label, legend=True)
    gradient.set_xlabel("position of the pantograph along the track [m]")
    return figure


@own_style()
def strip_forces(results: Results) -> Figure:
    """Share of each strip in the contact force along the track, 20 Hz low-pass, for pantographs
    with more than one."""
    shown = {
        p: list(zip(("leading strip", "trailing strip"), own, strict=True))
        for p, own in enumerate(results.strip_columns())
        if len(own) > 1
    }
    label = "force of a strip [N]"
    return panels_along_track(results, "strip_force", shown, label, low_pass=True)[0]


@own_style()
def wire_forces(results: Results) -> Figure:
    """Share of each contact wire in the contact force along the track, 20 Hz low-pass."""
    shown = {
        p: [(wire_words(name), column) for name, column in own.items()]
        for p, own in enumerate(results.wire_columns())
    }
    channel, label = "contact_wire_force", "force on a contact wire [N]"
    return panels_along_track(results, channel, shown, label, low_pass=True, dashed=True)[0]


@own_style()
def force_statistics(statistics: RunStatistics) -> Figure:
    """Bars of mean, deviation, extremes and mean +- 3 sigma of each pantograph."""
    groups = {
        **{"mean": "mean", "std": "standard\ndeviation", "maximum": "maximum"},
        **{"minimum": "minimum", "stat_max": "mean + 3 sigma", "stat_min": "mean − 3 sigma"},
    }
    shown = [(i, p) for i, p in enumerate(statistics.pantographs) if not p.complaint]
    figure, (axes,) = stacked(3.4, 1)
    width = 0.8 / max(len(shown), 1)
    for place, (index, pantograph) in enumerate(shown):
        at = np.arange(len(groups)) + (place - 0.5 * (len(shown) - 1)) * width
        values = np.array([getattr(pantograph, name) for name in groups])
        look: dict[str, Any] = {"color": colour(index), "hatch": hatch(index)}
        bars = axes.bar(at, values, 0.92 * width, label=pantograph.name, **look)
        labels_of_bars = [f"{round(value)}" for value in values]
        axes.bar_label(bars, labels_of_bars, padding=2, fontsize=8 if len(shown) < 4 else 6)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(np.arange(len(groups)), list(groups.values()))
    axes.margins(y=0.12)
    tidy(axes, "", "contact force, 20 Hz [N]", "Statistics in the evaluation stretch", legend=True)
    axes.grid(False, axis="x")
    return figure


@own_style()
def force_histogram(statistics: RunStatistics) -> Figure:
    """Share of time that the 20 Hz force of each pantograph spends in each bin."""
    shown = [(i, p) for i, p in enumerate(statistics.pantographs) if not p.complaint]
    figure, (axes,) = stacked(3.2, 1)
    for place, (index, pantograph) in enumerate(shown):
        edges, percent = pantograph.histogram_edges, pantograph.histogram_percent
        bin_width = edges[1] - edges[0]
        width = 0.86 * bin_width / len(shown)
        left = edges[:-1] + 0.07 * bin_width + place * width
        look: dict[str, Any] = {"color": colour(index), "hatch": hatch(index)}
        axes.bar(left, percent, width, align="edge", label=pantograph.name, **look)
    axes.xaxis.set_major_locator(MaxNLocator(12, steps=[1, 2, 2.5, 5, 10]))
    widths = sorted({f"{np.diff(p.histogram_edges[:2])[0]:g}" for _, p in shown}, key=float)
    title = f"Histogram, bins of {' and '.join(widths)} N"
    tidy(axes, "contact force, 20 Hz [N]", "share of time [%]", title, legend=True)
    return figure


@own_style()
def lateral_places(results: Results) -> Figure:
    """Lateral position of each contact wire on each strip along the track, and where strips end."""
    shown = {
        p: [(wire_words(word or "contact_wire"), column) for word, column in own.items()]
        for p, own in enumerate(results.contact_columns())
    }
    label = "position on the strip, to the left [m]"
    figure, panels = panels_along_track(results, "lateral_place", shown, label)
    for axes, half_length in zip(panels, results.facts_of("strip_half_length"), strict=True):
        if np.isfinite(half_length):
            for side, word in ((1.0, "end of the strips"), (-1.0, None)):
                at = side * float(half_length)
                axes.axhline(at, color="0.35", linestyle="--", linewidth=1.0, label=word)
            legend_above(axes)
    return figure
