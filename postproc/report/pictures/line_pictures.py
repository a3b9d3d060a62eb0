"""Pictures of the line in a run: uplift of arms, forces of droppers, the line at rest, energies.

Channels without a picture made for them follow: histories, and ranges on the line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.wording import capital, wire_words
from catenary.postproc.files.own_files import CHANNEL_PICTURE
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.along_track import (
    POSITION,
    draw_ranges,
    mark_line,
    mark_static,
    panels_along_track,
    with_margin,
)
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    GREY,
    LIGHT,
    LIMIT,
    LINES,
    MARKS,
    colour,
    curve,
    new_figure,
    own_style,
    stacked,
    tidy,
    uprights,
)
from catenary.solver.time_loop.views.channels import (
    ARM,
    CHANNELS,
    CONTACT,
    ENERGIES,
    STRIP,
    WIRE,
    WIRE_END,
    Channel,
)
from catenary.solver.waves.excitation import Blow, excitation_of_facts

if TYPE_CHECKING:
    from catenary.solver.statics.line_at_rest import LineAtTemperature

# A limit so many times the largest uplift is left out of its picture, whose dots would be at zero.
_FAR = 20.0
# Evaluated arms whose passage is drawn.
_MOST_ARMS = 60
# Change of tension that is allowed [%].
_ALLOWED = 10.0
# A channel in metres that stays below this is drawn in millimetres [m].
_SMALL = 0.1


@own_style()
def arm_uplift(results: Results, statistics: RunStatistics, limit: float) -> Figure:
    """Uplift at the evaluated arms as the train passes, or over time after a blow, and the largest
    uplift of every arm.

    Parameters
    ----------
    results : Results
        Results of the run.
    statistics : RunStatistics
        Its statistics.
    limit : float
        Largest uplift that is allowed [m]; NaN without a limit.
    """
    supports = statistics.supports
    figure, (passing, along) = stacked(4.8, 2)
    _passing_train(passing, results, statistics)

    mark_line(along, results, float(supports.x.min(initial=0)), float(supports.x.max(initial=1)))
    along.margins(x=0.02)
    uprights(along, supports.x, 0.0, 1e3 * supports.uplift, color=GREY, linewidth=1.4)
    along.plot(
        supports.x, 1e3 * supports.uplift, "o", color="#222222", ms=4, label="largest uplift"
    )
    along.set_xlim(*with_margin(supports.x))
    if np.isfinite(limit):
        label = f"limit {1e3 * limit:.0f} mm"
        if limit < _FAR * np.nanmax(supports.uplift, initial=0.0):
            along.axhline(1e3 * limit, color=LIMIT, linewidth=1.1, label=label)
        else:
            along.plot([], [], color=LIMIT, linewidth=1.1, label=f"{label}, far above")
    along.set_ylim(bottom=0.0)
    tidy(along, POSITION, "largest uplift [mm]", "All arms", legend=True)
    return figure


def _passing_train(axes: Axes, results: Results, statistics: RunStatistics) -> None:
    """Uplift of evaluated arms over the position of the leading pantograph, or of a force in its
    place, relative to each; of a line that a blow excites over time."""
    facts = results.attributes.get("excitation")
    excited = excitation_of_facts(facts) if facts else None
    supports = statistics.supports
    evaluated = np.flatnonzero(supports.evaluated & np.isfinite(supports.uplift))
    first = results.first_position
    leader = int(np.argmax(first))
    behind = first[leader] - first
    names = [excited.kind] if excited else results.pantograph_names()
    if isinstance(excited, Blow):
        names, over = [], "time [s]"
        abscissa, zero = results.line_time, np.zeros_like(supports.x)
        before, after = 0.0, float(abscissa[-1])
    else:
        who = "leading pantograph" if len(names) > 1 else names[0]
        over = f"position of the {who} relative to the arm [m]"
        abscissa = results.column("contact_position", leader)[:: results.line_record.every]
        zero = supports.x
        before, after = -60.0, float(behind.max()) + 140.0

    def history(arm: int) -> tuple[np.ndarray, np.ndarray]:
        from_to = np.searchsorted(abscissa, zero[arm] + np.array([before, after]))
        rows = slice(*np.clip(from_to, 0, results.n_rows("arm_uplift")).tolist())
        return abscissa[rows] - zero[arm], 1e3 * results.column("arm_uplift", arm, rows)

    worst = int(evaluated[np.argmax(supports.uplift[evaluated])]) if evaluated.size else None
    others = evaluated[evaluated != worst]
    shown = others[np.linspace(0, others.size - 1, min(others.size, _MOST_ARMS)).astype(int)]
    label = "other evaluated arms"
    if shown.size < others.size:
        label += f", {shown.size} of {others.size}"
    for number, arm in enumerate(shown):
        once = label if number == 0 else None
        curve(axes, *history(int(arm)), 0, once, width=0.8, color=LIGHT)
    if worst is not None:
        label = f"largest uplift, arm at {supports.x[worst]:.1f} m"
        curve(axes, *history(worst), 0, label, width=1.6, color="#222222")
    # As far as a curve reaches: the record of a short run ends soon after the last arm.
    known = np.concatenate([behind, *(line.get_xdata() for line in axes.lines)])
    if excited is None and axes.lines:
        before, after = max(before, float(known.min())), min(after, float(known.max()))
    for p, name in enumerate(names):
        label = f"{name} passes"
        axes.axvline(behind[p], color=colour(p), linestyle="--", linewidth=1.1, label=label)
    axes.set_xlim(before, after)
    tidy(axes, over, "uplift [mm]", "Evaluated arms", legend=True)


@own_style()
def dropper_force(results: Results, statistics: RunStatistics) -> Figure:
    """Forces of the worst dropper and of a mid-span one, and the range of every dropper."""
    droppers = statistics.droppers
    x, evaluated = droppers.x, np.flatnonzero(droppers.evaluated)
    figure, (history, along) = stacked(4.8, 2)

    masts, span = results.line("support_x"), results.reference_span
    middle = int(np.argmin(np.abs(x - 0.5 * (masts[span] + masts[span + 1]))))
    chosen = [(middle, f"mid-span dropper at {x[middle]:.1f} m", COLOURS[2])]
    if evaluated.size:
        worst = int(evaluated[np.argmin(droppers.lowest[evaluated])])
        if worst != middle:
            chosen.insert(0, (worst, f"lowest force, dropper at {x[worst]:.1f} m", "#222222"))
    for dropper, label, line_colour in chosen:
        force = results.column("dropper_force", dropper)
        curve(history, results.line_time, force, 0, label, color=line_colour)
    history.axhline(0.0, color=LIMIT, linewidth=1.0, linestyle="--", label="slack")
    history.margins(x=0.0)
    tidy(history, "time [s]", "dropper force [N]", "Histories", legend=True)

    mark_line(along, results, *with_margin(x))
    draw_ranges(along, x, droppers.lowest, droppers.highest)
    slack = droppers.slackened
    along.plot(x[slack], droppers.lowest[slack], "v", color=LIMIT, ms=4, label="slackened")
    along.axhline(0.0, color=GREY, linewidth=0.8)
    tidy(along, POSITION, "dropper force [N]", "All droppers", legend=True)
    return figure


@own_style()
def static_line(results: Results) -> Figure:
    """Contact-wire profile of the span whose elasticity is known and its neighbours; elasticity.

    Of several contact wires each has a curve.
    """
    figure, (profile, compliance) = stacked(4.6, 2)
    _draw_profile(profile, results)
    _draw_elasticity(compliance, results)
    return figure


def _draw_profile(axes: Axes, results: Results) -> None:
    """Contact wires at rest around the span whose elasticity is known."""
    masts, span = results.line("support_x"), results.span_at_rest
    start, end = masts[max(span - 1, 0)], masts[min(span + 2, masts.size - 1)]
    profiles = results.contact_profiles()
    level = min(float(np.interp(masts[span], wire.x, wire.height)) for wire in profiles.values())
    for number, (name, wire) in enumerate(profiles.items()):
        x, height = wire.drawn(wire.height)
        shown = (x >= start) & (x <= end)
        if np.count_nonzero(shown) < 2:
            continue
        heights, label = 1e3 * (height[shown] - level), f"{wire_words(name)} at rest"
        curve(axes, x[shown], heights, number, label, "--" if number else "-", 1.5)
    mark_static(axes, results, float(start), float(end))
    tidy(axes, POSITION, f"height above {level:.3f} m [mm]", "Profile at rest", legend=True)


def _draw_elasticity(axes: Axes, results: Results) -> None:
    """Lift of all contact wires under a unit force, and of each where there are several."""
    at, lift = results.static("elasticity_x"), results.static("elasticity")
    own = results.static("elasticity_of_wires")
    there = np.flatnonzero(np.isfinite(own).any(axis=0)).tolist()
    if len(there) > 1:
        names = list(results.contact_profiles())
        for number in there:
            known, label = np.isfinite(own[:, number]), f"{wire_words(names[number])} alone"
            look = "--" if number else "-"
            curve(axes, at[known], 1e3 * own[known, number], number, label, look, 1.5)
    tone, label = (GREY, "all contact wires") if len(there) > 1 else (COLOURS[0], "elasticity")
    axes.plot(at, 1e3 * lift, color=tone, linewidth=1.5, label=label)
    if at.size:
        mark_static(axes, results, float(at.min()), float(at.max()))
    axes.set_ylim(bottom=0.0)
    title = f"Elasticity along span {results.span_at_rest + 1}"
    tidy(axes, POSITION, "elasticity [mm/N]", title, legend=True)


@own_style()
def energies(results: Results) -> Figure:
    """Energies of the line over time, of a run that recorded them."""
    recorded = results.energies()
    figure, (axes,) = stacked(3.0, 1)
    for number, name in enumerate(("kinetic", "elastic")):
        curve(axes, recorded["time"], recorded[name], number, name, LINES[number], 1.5)
    axes.margins(x=0.0)
    tidy(
        axes, "time [s]", "energy [J]", "Energies of the line relative to equilibrium", legend=True
    )
    return figure


@own_style()
def plan_view(results: Results) -> Figure:
    """Lateral places of contact wires, and radial forces of arms, of wires that move so."""
    registration = results.registration()
    assert registration is not None
    figure, (plan, forces) = stacked(4.6, 2)
    profiles = results.contact_profiles()
    for number, (name, wire) in enumerate(profiles.items()):
        assert wire.y is not None
        label = "contact wire" if len(profiles) == 1 else wire_words(name)
        plan.plot(*wire.drawn(wire.y), color=colour(number), linewidth=1.2, label=label)
    plan.plot(registration.x, registration.stagger, "o", ms=3, color=GREY, label="steady arm")
    plan.axhline(0.0, color=GREY, linewidth=0.6, linestyle="--")
    tidy(plan, POSITION, "to the left [m]", "Contact wire from above", legend=True)
    pushed = registration.pushed
    for which, look, label in (
        (~pushed, "o", "arm that pulls"),
        (pushed, "v", "arm that its wire pushes"),
    ):
        if which.any():
            tone = COLOURS[0] if look == "o" else COLOURS[1]
            at, force = registration.x[which], registration.force[which, 0]
            forces.plot(at, force, look, ms=4, color=tone, label=label)
    forces.axhline(0.0, color=GREY, linewidth=0.8)
    has_arms = bool(forces.get_legend_handles_labels()[0])
    title = "Radial forces of the steady arms"
    tidy(forces, POSITION, "force to the left [N]", title, legend=has_arms)
    forces.set_xlim(plan.get_xlim())
    return figure


@own_style()
def draw_temperatures(rests: Sequence[LineAtTemperature]) -> Figure:
    """A picture of a line at rest at each of several temperatures. Not collective."""
    found = [rest for rest in rests if not rest.why_not]
    names = [wire.name for wire in found[0].wires if wire.ends] if found else []
    figure = new_figure(2.6 * (len(names) + 1))
    panels = figure.subplots(len(names) + 1, 1, squeeze=False)[:, 0]
    # From dark to light without the lightest yellow: neighbours differ in grey by their dashes too.
    warmth = matplotlib.colormaps["viridis"]
    range_ = [rest.warmer for rest in found]
    low, high = min(range_, default=0.0), max(range_, default=1.0)
    for axes, name in zip(panels, names, strict=False):
        for number, rest in enumerate(found):
            wire = next(own for own in rest.wires if own.name == name)
            share = (rest.warmer - low) / max(high - low, 1e-12)
            label = f"{rest.warmer:+g} K" if rest.warmer else "0 K"
            shade, dashes = warmth(0.85 * share), LINES[number % len(LINES)]
            axes.plot(wire.x, 100 * wire.change, color=shade, ls=dashes, lw=1.3, label=label)
        worst = max((np.abs(axes.get_ylim()).max(), 1.0))
        if worst > 0.7 * _ALLOWED:
            for side in (-_ALLOWED, _ALLOWED):
                axes.axhline(side, color=LIMIT, lw=0.9, ls="--")
        tidy(axes, POSITION, "change of tension [%]", wire_words(name))
        if name == names[0]:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    ends = panels[-1]
    for number, (tone, name) in enumerate(zip(COLOURS, names, strict=False)):
        wires = [own for rest in found for own in rest.wires if own.name == name]
        for i, end in enumerate(wires[0].ends):
            moved = [1e3 * own.moved[i] for own in wires]
            # Both ends of a symmetric line move alike: the start is a larger hollow mark.
            at_end = end.outwards > 0
            how: dict[str, Any] = {"color": tone, "marker": MARKS[number % len(MARKS)], "lw": 1.3}
            how |= {"ms": 3} if at_end else {"ms": 8, "mfc": "none", "ls": "--"}
            label = f"{wire_words(name)}, {'end' if at_end else 'start'}"
            ends.plot(range_, moved, label=label, **how)
    ends.axhline(0.0, color=GREY, lw=0.6)
    tidy(ends, "temperature above the installation [K]", "end outwards [mm]", "ends of the wires")
    if names:
        ends.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    return figure


def channel_pictures(results: Results) -> list[tuple[str, str, Callable[[], Figure | None]]]:
    """Name of the file without its end, caption and what draws it, of each such channel."""
    drawn: list[tuple[str, str, Callable[[], Figure | None]]] = []
    for channel in CHANNELS.values():
        if not channel.own_picture and results.has(channel.name) and results.n_rows("time") > 1:
            draw: Callable[[], Figure | None] = partial(_draw_channel, results, channel)
            drawn.append((picture_name(channel), f"{capital(channel.meaning)}.", draw))
    recorded = results.energies()
    for channel in ENERGIES.values():
        if channel.energy is not None and not channel.own_picture and channel.name in recorded:
            draw = partial(_draw_energy, recorded["time"], recorded[channel.name], channel)
            drawn.append((picture_name(channel), f"{capital(channel.meaning)}.", draw))
    return drawn


def _draw_channel(results: Results, channel: Channel) -> Figure | None:
    if channel.per == WIRE_END:
        return _draw_at_ends(results, channel)
    return _draw_on_line(results, channel) if channel.of_line else _draw_of_train(results, channel)


def picture_name(channel: Channel) -> str:
    """Name of a channel's picture without its end."""
    return f"{CHANNEL_PICTURE}{channel.name}"


def _word(channel: Channel) -> str:
    return channel.name.replace("_", " ")


def _label(channel: Channel) -> str:
    return f"{_word(channel)} [{channel.unit}]"


@own_style()
def _draw_of_train(results: Results, channel: Channel) -> Figure:
    """A panel for each pantograph, a curve for each of its columns."""
    word = _word(channel)
    shown = {p: [(word, p)] for p in range(results.n_pantographs)}
    if channel.per == STRIP:
        for p, own in enumerate(results.strip_columns()):
            words = [f"strip {n + 1}" for n in range(len(own))] if len(own) > 1 else [word]
            shown[p] = list(zip(words, own, strict=True))
    elif channel.per == WIRE:
        shown = {
            p: [(wire_words(name), column) for name, column in own.items()]
            for p, own in enumerate(results.wire_columns())
        }
    elif channel.per == CONTACT:
        for p, by_name in enumerate(results.contact_columns()):
            shown[p] = [(wire_words(name) or word, column) for name, column in by_name.items()]
    label, factor = _label(channel), 1.0
    columns = [column for curves in shown.values() for _, column in curves]
    if channel.unit == "m" and _largest(results, channel.name, columns) < _SMALL:
        label, factor = label.replace("[m]", "[mm]"), 1e3
    return panels_along_track(results, channel.name, shown, label, factor=factor)[0]


def _largest(results: Results, name: str, columns: Sequence[int]) -> float:
    """Largest magnitude in columns of a channel; not those without a number."""
    values = (np.abs(results.column(name, column)) for column in columns)
    return max((float(np.nanmax(own, initial=0.0)) for own in values), default=0.0)


@own_style()
def _draw_on_line(results: Results, channel: Channel) -> Figure:
    """The range of each column over the run."""
    x = results.line("arm_x" if channel.per == ARM else "dropper_x")
    low, high = results.extremes(channel.name)
    figure, (axes,) = stacked(3.4, 1)
    mark_line(axes, results, float(np.min(x, initial=0.0)), float(np.max(x, initial=1.0)))
    draw_ranges(axes, x, low, high)
    tidy(axes, POSITION, _label(channel), legend=True)
    return figure


@own_style()
def _draw_at_ends(results: Results, channel: Channel) -> Figure | None:
    """A panel for each wire with the history at each of its ends, None if all stay zero."""
    low, high = results.extremes(channel.name)
    if not (np.any(low) or np.any(high)):
        return None
    x, wire, outwards = (results.line(f"end_{part}") for part in ("x", "wire", "outwards"))
    names = list(results.attributes["wires"])
    there = np.unique(wire).astype(int)
    figure, panels = stacked(0.7 + 2.4 * there.size, there.size)
    for axes, number in zip(panels, there.tolist(), strict=True):
        own = np.flatnonzero((wire == number) & ((low != 0.0) | (high != 0.0)))
        for k, column in enumerate(own.tolist()):
            label = f"wire {'from' if outwards[column] < 0 else 'up to'} {x[column]:g} m"
            curve(axes, results.line_time, results.column(channel.name, column), k, label)
        axes.margins(x=0.0)
        tidy(axes, "", _label(channel), wire_words(names[number]), legend=bool(own.size))
    panels[-1].set_xlabel("time [s]")
    return figure


@own_style()
def _draw_energy(time: np.ndarray, values: np.ndarray, channel: Channel) -> Figure:
    figure, (axes,) = stacked(3.0, 1)
    curve(axes, time, values, 0, _word(channel), width=1.5)
    axes.margins(x=0.0)
    tidy(axes, "time [s]", _label(channel), legend=True)
    return figure
