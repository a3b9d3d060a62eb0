"""The contact force along the track up to where the pantographs are, or what a blow leaves, as a
chart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.line_view import PANTOGRAPHS
from catenary.postproc.film.snapshots import Snapshots
from catenary.solver.waves.excitation import Blow

# Points of a curve at most, far more than a picture has columns of.
_MOST_POINTS = 4000
# Of the time in which a blow acts.
_GREY = (110, 110, 110, 110)


class _Chart:
    """A chart in one subplot of a plotter. Not collective."""

    def __init__(self, plotter: pyvista.Plotter, x_label: str, y_label: str) -> None:
        self.chart = pyvista.Chart2D(x_label=x_label, y_label=y_label)
        self.chart.background_color = "white"
        plotter.add_chart(self.chart)
        self.chart.legend_visible = True
        for axis in (self.chart.x_axis, self.chart.y_axis):
            axis.label_size, axis.tick_label_size = 16, 14

    def sides(self) -> tuple[float, float]:
        """Columns of the picture at the ends of the horizontal axis, as drawn last [px]."""
        return float(self.chart.GetPoint1()[0]), float(self.chart.GetPoint2()[0])


class ForceCurve(_Chart):
    """The contact force along the track. Not collective.

    Parameters
    ----------
    plotter : the chart fills its active subplot
    data : of the run
    rows : records that the film shows, from the first to one after the last
    """

    def __init__(self, plotter: pyvista.Plotter, data: FilmData, rows: tuple[int, int]) -> None:
        super().__init__(plotter, "place along the track [m]", "force [N]")
        self._data, self._first = data, rows[0]
        shown = data.force[rows[0] : rows[1]]
        low, high = float(shown.min(initial=0.0)), float(shown.max(initial=1.0))
        self.chart.y_range = [1.05 * low, 1.05 * high]
        self._plots: list[tuple[Any, Any]] = []
        for p in range(data.n_pantographs):
            colour = PANTOGRAPHS[p % len(PANTOGRAPHS)]
            raw = self.chart.line([0.0, 1.0], [0.0, 0.0], color=(*_rgb(colour), 90), width=1.0)
            label = data.names[p] + (", below 20 Hz" if data.excitation is None else "")
            bold = self.chart.line([0.0, 1.0], [0.0, 0.0], color=colour, width=2.5, label=label)
            self._plots.append((raw, bold))

    def update(self, row: int, low: float, high: float) -> None:
        """Show the force from ``low`` to ``high`` along the track [m], up to a record."""
        data = self._data
        self.chart.x_range = [low, high]
        for p, (raw, bold) in enumerate(self._plots):
            x = data.position[:, p]
            begin = max(self._first, int(x.searchsorted(low)) - 1)
            end = max(row + 1, begin + 2)
            chosen = slice(begin, end, max(1, (end - begin) // _MOST_POINTS))
            raw.update(x[chosen], data.force[chosen, p])
            bold.update(x[chosen], data.filtered[chosen, p])


class RingingCurve(_Chart):
    """How the contact wire rings over time where a blow struck it. Not collective.

    Attributes
    ----------
    shown : the curve, over the time until now

    Parameters
    ----------
    plotter : the chart fills its active subplot
    data : of a line that a blow struck
    blow : which
    snapshots, numbers : those that the film shows
    """

    def __init__(
        self,
        plotter: pyvista.Plotter,
        data: FilmData,
        blow: Blow,
        snapshots: Snapshots,
        numbers: np.ndarray,
    ) -> None:
        super().__init__(plotter, "time [s]", f"uplift at {blow.at:g} m [mm]")
        self._data, wire = data, data.touched(blow.at)
        found = [snapshots.uplift_at(number, wire, blow.at) for number in numbers.tolist()]
        shown = np.isfinite(found)
        self._time, self._uplift = snapshots.times[numbers][shown], 1e3 * np.array(found)[shown]
        ends = float(self._uplift.min(initial=0.0)), float(self._uplift.max(initial=1e-3))
        room = 0.05 * (ends[1] - ends[0])
        self.chart.x_range = snapshots.times[numbers[[0, -1]]].tolist()
        self.chart.y_range = [ends[0] - room, ends[1] + room]
        # For how long it acted.
        label = f"{blow.kind}, up to {blow.peak:.3g} N"
        self.chart.area(
            [0.0, blow.duration],
            [ends[0] - room] * 2,
            [ends[1] + room] * 2,
            color=_GREY,
            label=label,
        )
        self.shown = self.chart.line(
            [0.0, 1.0], [0.0, 0.0], color=PANTOGRAPHS[0], width=2.5, label="contact wire"
        )

    def update(self, row: int, low: float, high: float) -> None:
        """Show the motion up to a record, wherever the line is shown from and to [m]."""
        n = max(2, int(self._time.searchsorted(self._data.time[row], side="right")))
        self.shown.update(self._time[:n], self._uplift[:n])


def _rgb(colour: str) -> tuple[int, int, int]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))  # type: ignore[return-value]
