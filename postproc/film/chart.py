"""The contact force along the track up to where the pantographs are, or what a blow leaves, as a
chart whose curves stay and change their data."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.scenery import COLOURS
from catenary.postproc.film.snapshots import Snapshots
from catenary.solver.waves.excitation import Blow

# Points of a curve at most, far more than a picture has columns of; marks along the track at most.
_MOST_POINTS, _MOST_MARKS = 4000, 12


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
