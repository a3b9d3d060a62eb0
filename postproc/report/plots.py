"""Pictures of a run as figures of matplotlib; nothing here needs a display or touches files."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.read.results import Results
from catenary.postproc.report.envelope import thinned
from catenary.postproc.report.figures import (
    COLOURS,
    GREY,
    LIGHT,
    LIMIT,
    SHADE,
    colour,
    legend_above,
    stacked,
    tidy,
)
from catenary.solver.base.errors import InputError

# Evaluated arms whose passage is drawn.
_MOST_ARMS = 60


def mark_line(axes: Axes, results: Results, start: float, end: float) -> None:
    """Supports as lines, droppers as ticks at the bottom, the evaluation stretch shaded."""
    low, high = results.evaluation
    axes.axvspan(low, high, color=SHADE, zorder=0, label="evaluation stretch")
    support = results.line("support_x")
    support = support[(support >= start) & (support <= end)]
    _uprights(axes, support, 0.9)
    dropper = results.line("dropper_x")
    dropper = dropper[(dropper >= start) & (dropper <= end)]
    transform = axes.get_xaxis_transform()
    axes.plot(
        dropper,
        np.full(dropper.size, 0.015),
        "|",
        color=GREY,
        markersize=5,
        markeredgewidth=0.7,
        transform=transform,
        label="dropper",
        clip_on=True,
    )
    axes.set_xlim(start, end)


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


def arm_uplift(results: Results, statistics: RunStatistics, limit: float | None) -> Figure:
    """Uplift at the evaluated arms as the train passes, and the largest uplift of every arm.

    ``limit`` is the allowed uplift [m], None for none.
    """
    supports = statistics.supports
    figure, (passing, along) = stacked(5.6, 2)
    _passing_train(passing, results, statistics)

    mark_line(along, results, float(supports.x.min(initial=0)), float(supports.x.max(initial=1)))
    along.margins(x=0.02)
    along.vlines(supports.x, 0.0, 1e3 * supports.uplift, color=GREY, linewidth=1.4)
    along.plot(
        supports.x, 1e3 * supports.uplift, "o", color="#222222", ms=4, label="largest uplift"
    )
    if limit is not None:
        along.axhline(1e3 * limit, color=LIMIT, linewidth=1.1, label=f"limit {1e3 * limit:.0f} mm")
    along.set_xlim(*_with_margin(supports.x))
    along.set_ylim(bottom=0.0)
    tidy(along, "position along the track [m]", "largest uplift [mm]", "All arms")
    legend_above(along)
    return figure


def _passing_train(axes: Axes, results: Results, statistics: RunStatistics) -> None:
    """Uplift of evaluated arms over the position of the leading pantograph relative to each."""
    supports = statistics.supports
    evaluated = np.flatnonzero(supports.evaluated & np.isfinite(supports.uplift))
    first = results.first_position
    leader = int(np.argmax(first))
    behind = first[leader] - first
    before, after = -60.0, float(behind.max()) + 140.0
    position = results.column("contact_position", leader)[:: results.line_record.every]

    def curve(arm: int) -> tuple[np.ndarray, np.ndarray]:
        from_to = np.searchsorted(position, supports.x[arm] + np.array([before, after]))
        rows = slice(*np.clip(from_to, 0, results.n_rows("arm_uplift")).tolist())
        uplift = results.column("arm_uplift", arm, rows)
        chosen = thinned(uplift)
        return position[rows][chosen] - supports.x[arm], 1e3 * uplift[chosen]

    worst = int(evaluated[np.argmax(supports.uplift[evaluated])]) if evaluated.size else None
    others = evaluated[evaluated != worst]
    shown = others[np.linspace(0, others.size - 1, min(others.size, _MOST_ARMS)).astype(int)]
    label = "other evaluated arms"
    if shown.size < others.size:
        label += f", {shown.size} of {others.size}"
    for number, arm in enumerate(shown):
        told = label if number == 0 else None
        axes.plot(*curve(int(arm)), color=LIGHT, linewidth=0.8, label=told)
    if worst is not None:
        axes.plot(
            *curve(worst),
            color="#222222",
            linewidth=1.6,
            label=f"largest uplift, arm at {supports.x[worst]:.1f} m",
        )
    for p, name in enumerate(results.pantograph_names()):
        axes.axvline(
            behind[p], color=colour(p), linestyle="--", linewidth=1.1, label=f"{name} passes"
        )
    axes.set_xlim(before, after)
    who = "leading pantograph" if results.n_pantographs > 1 else "pantograph"
    tidy(axes, f"position of the {who} relative to the arm [m]", "uplift [mm]", "Evaluated arms")
    legend_above(axes)


def dropper_force(results: Results, statistics: RunStatistics) -> Figure:
    """Forces of the worst dropper and of a mid-span one, and the range of every dropper."""
    droppers = statistics.droppers
    x, evaluated = droppers.x, np.flatnonzero(droppers.evaluated)
    figure, (history, along) = stacked(5.6, 2)

    masts, span = results.line("support_x"), results.reference_span
    middle = int(np.argmin(np.abs(x - 0.5 * (masts[span] + masts[span + 1]))))
    chosen = [(middle, f"mid-span dropper at {x[middle]:.1f} m", COLOURS[2])]
    if evaluated.size:
        worst = int(evaluated[np.argmin(droppers.lowest[evaluated])])
        if worst != middle:
            chosen.insert(0, (worst, f"lowest force, dropper at {x[worst]:.1f} m", "#222222"))
    for dropper, label, line_colour in chosen:
        force = results.column("dropper_force", dropper)
        shown = thinned(force)
        force = force[shown]
        history.plot(results.line_time[shown], force, color=line_colour, linewidth=1.2, label=label)
    history.axhline(0.0, color=LIMIT, linewidth=1.0, linestyle="--", label="slack")
    history.margins(x=0.0)
    tidy(history, "time [s]", "dropper force [N]", "Histories")
    legend_above(history)

    mark_line(along, results, *_with_margin(x))
    along.vlines(
        x,
        droppers.lowest,
        droppers.highest,
        color=COLOURS[0],
        linewidth=1.6,
        label="range over the run",
    )
    still_marks(along, x, droppers.lowest, droppers.highest)
    slack = droppers.lowest <= 0.0
    along.plot(x[slack], droppers.lowest[slack], "v", color=LIMIT, ms=4, label="slackened")
    along.axhline(0.0, color=GREY, linewidth=0.8)
    tidy(along, "position along the track [m]", "dropper force [N]", "All droppers")
    legend_above(along)
    return figure


def still_marks(axes: Axes, x: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Dashes where ranges are too small for a line that would be seen."""
    still = high - low < 0.01 * (np.nanmax(high, initial=0.0) - np.nanmin(low, initial=0.0))
    axes.plot(x[still], high[still], "_", color=COLOURS[0], ms=3.0)


def static_line(results: Results) -> Figure:
    """Contact-wire profile of the reference span and its neighbours; elasticity along a span.

    Of several contact wires each has a curve.
    """
    profiles = results.contact_profiles()
    at, lift = results.static("elasticity_x"), results.static("elasticity")
    masts, span = results.line("support_x"), results.reference_span
    figure, (profile, compliance) = stacked(5.2, 2)

    start, end = masts[max(span - 1, 0)], masts[min(span + 2, masts.size - 1)]
    level = min(float(np.interp(masts[span], x, height)) for x, height in profiles.values())
    for number, (name, (x, height)) in enumerate(profiles.items()):
        shown = (x >= start) & (x <= end)
        profile.plot(
            x[shown],
            1e3 * (height[shown] - level),
            color=colour(number),
            linewidth=1.5,
            linestyle="--" if number else "-",
            label=f"{name.replace('_', ' ')} at rest",
        )
    _mark_static(profile, results, float(start), float(end))
    tidy(
        profile,
        "position along the track [m]",
        f"height above {level:.3f} m [mm]",
        "Profile at rest",
    )
    legend_above(profile)

    if len(profiles) > 1:
        own = results.static("elasticity_of_wires")
        for number, name in enumerate(profiles):
            known = np.isfinite(own[:, number])
            compliance.plot(
                at[known],
                1e3 * own[known, number],
                color=colour(number),
                linestyle="--" if number else "-",
                label=f"{name.replace('_', ' ')} alone",
            )
    look = (COLOURS[0], "elasticity") if len(profiles) == 1 else (GREY, "all contact wires")
    compliance.plot(at, 1e3 * lift, color=look[0], linewidth=1.5, label=look[1])
    if at.size:
        _mark_static(compliance, results, float(at.min()), float(at.max()))
    compliance.set_ylim(bottom=0.0)
    tidy(
        compliance,
        "position along the track [m]",
        "lift under unit force [mm/N]",
        "Elasticity along a span",
    )
    legend_above(compliance)
    return figure


def energies(results: Results) -> Figure | None:
    """Energies of the line over time; None if the run did not record them."""
    recorded = results.energies()
    if not recorded or not recorded["time"].size:
        return None
    figure, (axes,) = stacked(3.0, 1)
    for number, name in enumerate(("kinetic", "elastic")):
        chosen = thinned(recorded[name])
        curve = recorded["time"][chosen], recorded[name][chosen]
        axes.plot(*curve, color=COLOURS[number], label=name)
    axes.margins(x=0.0)
    tidy(axes, "time [s]", "energy [J]", "Energies of the line relative to equilibrium")
    legend_above(axes)
    return figure


def _mark_static(axes: Axes, results: Results, start: float, end: float) -> None:
    support = results.line("support_x")
    _uprights(axes, support[(support >= start - 1e-6) & (support <= end + 1e-6)], 1.2)
    dropper = results.line("dropper_x")
    dropper = dropper[(dropper >= start) & (dropper <= end)]
    axes.plot(
        dropper,
        np.full(dropper.size, 0.02),
        "|",
        color=GREY,
        markersize=7,
        transform=axes.get_xaxis_transform(),
        label="dropper",
    )
    axes.set_xlim(*_with_margin(np.array([start, end])))


def _uprights(axes: Axes, support: np.ndarray, width: float) -> None:
    """Supports as lines over the whole height: one collection, however many there are."""
    if not support.size:
        return
    lines = [((x, 0.0), (x, 1.0)) for x in support]
    transform = axes.get_xaxis_transform()
    known: dict[str, Any] = {"colors": LIGHT, "linewidths": width, "zorder": 1, "label": "support"}
    axes.add_collection(LineCollection(lines, transform=transform, **known), autolim=False)


def travelled(results: Results) -> tuple[float, float]:
    """From and to of the stretch on which a pantograph was [m]."""
    low, high = results.extremes("contact_position")
    return float(low.min()), float(high.max())


def _with_margin(x: np.ndarray) -> tuple[float, float]:
    if not x.size:
        return 0.0, 1.0
    margin = 0.015 * max(float(np.ptp(x)), 1.0)
    return float(x.min()) - margin, float(x.max()) + margin
