"""The contact force along the track, up to where the pantographs are, as a chart."""

from __future__ import annotations

from typing import Any

import pyvista

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.line_view import PANTOGRAPHS

# Points of a curve at most, far more than a picture has columns of.
_MOST_POINTS = 4000


class ForceCurve:
    """A chart in one subplot of a plotter. Not collective.

    Parameters
    ----------
    plotter : the chart fills its active subplot
    data : of the run
    rows : records that the film shows, from the first to one after the last
    """

    def __init__(self, plotter: pyvista.Plotter, data: FilmData, rows: tuple[int, int]) -> None:
        self._data, self._first = data, rows[0]
        self.chart = pyvista.Chart2D(x_label="place along the track [m]", y_label="force [N]")
        self.chart.background_color = "white"
        plotter.add_chart(self.chart)
        shown = data.force[rows[0] : rows[1]]
        self.chart.y_range = [0.0, 1.05 * float(shown.max(initial=1.0))]
        self._plots: list[tuple[Any, Any]] = []
        for p in range(data.n_pantographs):
            colour = PANTOGRAPHS[p % len(PANTOGRAPHS)]
            raw = self.chart.line([0.0, 1.0], [0.0, 0.0], color=(*_rgb(colour), 90), width=1.0)
            label = f"{data.names[p]}, below 20 Hz"
            bold = self.chart.line([0.0, 1.0], [0.0, 0.0], color=colour, width=2.5, label=label)
            self._plots.append((raw, bold))
        self.chart.legend_visible = True
        for axis in (self.chart.x_axis, self.chart.y_axis):
            axis.label_size, axis.tick_label_size = 16, 14

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

    def sides(self) -> tuple[float, float]:
        """Columns of the picture at the ends of the axis along the track, as drawn last [px]."""
        return float(self.chart.GetPoint1()[0]), float(self.chart.GetPoint2()[0])


def _rgb(colour: str) -> tuple[int, int, int]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))  # type: ignore[return-value]
