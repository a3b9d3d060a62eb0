"""Pictures of channels without one made for them: histories, and ranges on the line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from catenary.postproc.evaluate.wording import capital
from catenary.postproc.files.own_files import CHANNEL_PICTURE
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.envelope import thinned
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    colour,
    legend_above,
    own_style,
    stacked,
    tidy,
)
from catenary.postproc.report.pictures.marks import draw_ranges, mark_line, panels_along_track
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

# A channel in metres that stays below this is drawn in millimetres [m].
_SMALL = 0.1


def channel_pictures(results: Results) -> list[tuple[str, str, Callable[[], Figure | None]]]:
    """Name of the file without its end, caption and what draws it, of each such channel."""
    drawn: list[tuple[str, str, Callable[[], Figure | None]]] = []
    for channel in CHANNELS.values():
        if not channel.own_picture and results.has(channel.name) and results.n_rows("time") > 1:
            draw: Callable[[], Figure | None] = partial(_picture_of, results, channel)
            drawn.append((picture_name(channel), f"{capital(channel.meaning)}.", draw))
    recorded = results.energies()
    for channel in ENERGIES.values():
        if channel.energy is not None and not channel.own_picture and channel.name in recorded:
            draw = partial(_of_energy, recorded["time"], recorded[channel.name], channel)
            drawn.append((picture_name(channel), f"{capital(channel.meaning)}.", draw))
    return drawn


def _picture_of(results: Results, channel: Channel) -> Figure | None:
    if channel.per == WIRE_END:
        return _at_ends(results, channel)
    return _on_line(results, channel) if channel.of_line else _of_train(results, channel)


def picture_name(channel: Channel) -> str:
    """Name of a channel's picture without its end."""
    return f"{CHANNEL_PICTURE}{channel.name}"


def _label(channel: Channel) -> str:
    return f"{channel.name.replace('_', ' ')} [{channel.unit}]"


@own_style()
def _of_train(results: Results, channel: Channel) -> Figure:
    """A panel for each pantograph, a curve for each of its columns."""
    word = channel.name.replace("_", " ")
    shown = {p: [(word, p)] for p in range(results.n_pantographs)}
    if channel.per == STRIP:
        for p, own in enumerate(results.strip_columns()):
            words = [f"strip {n + 1}" for n in range(len(own))] if len(own) > 1 else [word]
            shown[p] = list(zip(words, own, strict=True))
    elif channel.per == WIRE:
        shown = {p: list(own.items()) for p, own in enumerate(results.wire_columns())}
    elif channel.per == CONTACT:
        for p, by_name in enumerate(results.contact_columns()):
            shown[p] = [(name or word, column) for name, column in by_name.items()]
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
def _on_line(results: Results, channel: Channel) -> Figure:
    """The range of each column over the run."""
    x = results.line("arm_x" if channel.per == ARM else "dropper_x")
    low, high = results.extremes(channel.name)
    figure, (axes,) = stacked(3.4, 1)
    mark_line(axes, results, float(np.min(x, initial=0.0)), float(np.max(x, initial=1.0)))
    draw_ranges(axes, x, low, high)
    tidy(axes, "position along the track [m]", _label(channel))
    legend_above(axes)
    return figure


@own_style()
def _at_ends(results: Results, channel: Channel) -> Figure | None:
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
            values = results.column(channel.name, column)
            chosen = thinned(values)
            side = "from" if outwards[column] < 0 else "up to"
            label = f"wire {side} {x[column]:g} m"
            time = results.line_time[chosen]
            axes.plot(time, values[chosen], color=colour(k), linewidth=1.2, label=label)
        axes.margins(x=0.0)
        tidy(axes, "", _label(channel), names[number].replace("_", " "))
        if own.size:
            legend_above(axes)
    panels[-1].set_xlabel("time [s]")
    return figure


@own_style()
def _of_energy(time: np.ndarray, values: np.ndarray, channel: Channel) -> Figure:
    figure, (axes,) = stacked(3.0, 1)
    chosen = thinned(values)
    axes.plot(time[chosen], values[chosen], color=COLOURS[0], label=channel.name.replace("_", " "))
    axes.margins(x=0.0)
    tidy(axes, "time [s]", _label(channel))
    legend_above(axes)
    return figure
