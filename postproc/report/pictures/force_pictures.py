"""Pictures of the contact force: along the track, of strips and wires, its statistics."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.envelope import thinned
from catenary.postproc.report.pictures.figures import (
    GREY,
    colour,
    legend_above,
    own_style,
    stacked,
    tidy,
)
from catenary.postproc.report.pictures.marks import mark_line, travelled


@own_style()
def contact_force(results: Results) -> Figure:
    """Contact force of each pantograph along the track: unfiltered light, 20 Hz low-pass bold."""
    names = results.pantograph_names()
    n = results.n_pantographs
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.7 * n, n, shared=True)
    for p, axes in enumerate(panels):
        mark_line(axes, results, start, end)
        force = results.column("contact_force", p)
        chosen = thinned(force)
        light: dict[str, Any] = {"alpha": 0.3, "linewidth": 0.6, "label": "unfiltered"}
        curves = [(chosen, force[chosen], light)]
        try:
            force = filters.low_pass(force, results.dt)
        except InputError:  # sampled too slowly; the report says so
            pass
        else:
            chosen = thinned(force)
            curves.append((chosen, force[chosen], {"linewidth": 1.5, "label": "20 Hz low-pass"}))
        del force
        position = results.column("contact_position", p)
        for chosen, values, style in curves:
            axes.plot(position[chosen], values, color=colour(p), **style)
        del position
        tidy(axes, "", "contact force [N]", names[p].capitalize())
        legend_above(axes)
    panels[-1].set_xlabel("position along the track [m]")
    return figure


@own_style()
def strip_forces(results: Results) -> Figure:
    """Share of each strip in the contact force along the track, 20 Hz low-pass, for pantographs
    with more than one."""
    shown = [(p, own) for p, own in enumerate(results.strip_columns()) if len(own) > 1]
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.7 * len(shown), len(shown), shared=True)
    for axes, (p, columns) in zip(panels, shown, strict=True):
        mark_line(axes, results, start, end)
        for number, column in enumerate(columns):
            force = results.column("strip_force", column)
            with contextlib.suppress(InputError):  # sampled too slowly; the report says so
                force = filters.low_pass(force, results.dt)
            label = ("leading strip", "trailing strip")[number]
            chosen = thinned(force)
            force = force[chosen]
            position = results.column("contact_position", p)[chosen]
            axes.plot(position, force, color=colour(number), linewidth=1.2, label=label)
        name = results.pantograph_names()[p]
        tidy(axes, "", "force of a strip [N]", name.capitalize())
        legend_above(axes)
    panels[-1].set_xlabel("position of the pantograph along the track [m]")
    return figure


@own_style()
def wire_forces(results: Results) -> Figure:
    """Share of each contact wire in the contact force along the track, 20 Hz low-pass."""
    names = results.pantograph_names()
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.7 * len(names), len(names), shared=True)
    for p, (axes, columns) in enumerate(zip(panels, results.wire_columns(), strict=True)):
        mark_line(axes, results, start, end)
        position = results.column("contact_position", p)
        for number, (name, column) in enumerate(columns.items()):
            force = results.column("contact_wire_force", column)
            with contextlib.suppress(InputError):  # sampled too slowly; the report says so
                force = filters.low_pass(force, results.dt)
            # Two wires side by side may have the same force: the second is dashed.
            style: dict[str, Any] = {"linewidth": 1.2, "linestyle": ("-", "--")[number % 2]}
            chosen = thinned(force)
            axes.plot(
                position[chosen],
                force[chosen],
                color=colour(number),
                label=name.replace("_", " "),
                **style,
            )
        tidy(axes, "", "force on a contact wire [N]", names[p].capitalize())
        legend_above(axes)
    panels[-1].set_xlabel("position of the pantograph along the track [m]")
    return figure


@own_style()
def force_statistics(results: Results, statistics: RunStatistics) -> Figure:
    """Bars of mean, deviation, extremes and mean +- 3 sigma of each pantograph."""
    groups = ("mean", "std", "maximum", "minimum", "stat_max", "stat_min")
    labels = (
        "mean",
        "standard\ndeviation",
        "maximum",
        "minimum",
        "mean + 3 sigma",
        "mean - 3 sigma",
    )
    shown = [(i, p) for i, p in enumerate(statistics.pantographs) if not p.complaint]
    figure, (axes,) = stacked(3.4, 1)
    width = 0.8 / max(len(shown), 1)
    for place, (index, pantograph) in enumerate(shown):
        at = np.arange(len(groups)) + (place - 0.5 * (len(shown) - 1)) * width
        values = np.array([getattr(pantograph, name) for name in groups])
        bars = axes.bar(at, values, 0.92 * width, color=colour(index), label=pantograph.name)
        labels_of_bars = [f"{round(value)}" for value in values]
        axes.bar_label(bars, labels_of_bars, padding=2, fontsize=8 if len(shown) < 4 else 6)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(np.arange(len(groups)), labels)
    axes.margins(y=0.12)
    tidy(axes, "", "contact force, 20 Hz [N]", "Statistics in the evaluation stretch")
    axes.grid(False, axis="x")
    legend_above(axes)
    return figure


@own_style()
def force_histogram(results: Results, statistics: RunStatistics) -> Figure:
    """Share of time that the 20 Hz force of each pantograph spends in each bin."""
    shown = [(i, p) for i, p in enumerate(statistics.pantographs) if not p.complaint]
    figure, (axes,) = stacked(3.2, 1)
    for place, (index, pantograph) in enumerate(shown):
        edges, percent = pantograph.histogram_edges, pantograph.histogram_percent
        bin_width = edges[1] - edges[0]
        width = 0.86 * bin_width / len(shown)
        left = edges[:-1] + 0.07 * bin_width + place * width
        axes.bar(left, percent, width, align="edge", color=colour(index), label=pantograph.name)
    axes.xaxis.set_major_locator(MaxNLocator(12, steps=[1, 2, 2.5, 5, 10]))
    widths = sorted({f"{np.diff(p.histogram_edges[:2])[0]:g}" for _, p in shown}, key=float)
    title = f"Histogram, bins of {' and '.join(widths)} N"
    tidy(axes, "contact force, 20 Hz [N]", "share of time [%]", title)
    legend_above(axes)
    return figure
