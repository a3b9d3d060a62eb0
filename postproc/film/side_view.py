"""The line, its masts and the pantographs from the side, as actors of a plotter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
from matplotlib.colors import LinearSegmentedColormap

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import BELOW_HEAD, shape
from catenary.postproc.film.scale import Scale

# Colours of pantographs by their order, of the line's parts, of droppers that carry nothing.
PANTOGRAPHS = ("#b2182b", "#2166ac", "#1b7837", "#762a83")
MAST, TRACK, VEHICLE, DROPPER, SLACK = "#b8bcc2", "#6b7078", "#d9dde2", "#8c9198", "#e08214"
# Uplift from below to above rest, which is dark on a white ground.
_COLOURS = LinearSegmentedColormap.from_list("uplift", ["#2166ac", "#3a3f45", "#d6301f"])
# How far masts stand out above the highest wire, and a vehicle beyond its pantograph [m].
_MAST_ABOVE, _HALF_VEHICLE = 0.4, 12.5
# Length of the arrow of a force in the drawing [m of drawn height per N].
_ARROW = 0.03


def segments(pairs: np.ndarray) -> np.ndarray:
    """Pairs of points as VTK's cells of lines."""
    return np.column_stack([np.full(len(pairs), 2), pairs]).ravel()


class SideView:
    """Actors of a line and its train in one subplot of a plotter. Not collective.

    Parameters
    ----------
    plotter : its active subplot is drawn into
    data : of the run
    scale : of the drawing
    largest_uplift : end of the scale of colours [m]
    """

    def __init__(
        self, plotter: pyvista.Plotter, data: FilmData, scale: Scale, largest_uplift: float
    ) -> None:
        self._data, self._scale = data, scale
        points = data.points
        self.top = float(points[:, 2].max()) + _MAST_ABOVE
        self.foot = float(data.rest_height(data.position.mean(axis=0)).min()) - BELOW_HEAD
        self._add_surroundings(plotter)
        flat = np.column_stack([points[:, 0], np.zeros(len(points)), scale.drawn(points[:, 2])])
        pairs = np.concatenate(list(data.elements.values()))
        self._wires = pyvista.PolyData(flat.copy(), lines=segments(pairs))
        self._wires["uplift"] = np.zeros(len(points))
        plotter.add_mesh(
            self._wires,
            scalars="uplift",
            clim=(-1e3 * largest_uplift, 1e3 * largest_uplift),
            cmap=_COLOURS,
            line_width=4,
            lighting=False,
            scalar_bar_args={
                "title": "uplift [mm]", "vertical": False, "height": 0.07, "width": 0.28,
                "position_x": 0.7, "position_y": 0.9, "n_labels": 3, "fmt": "%.0f",
                "label_font_size": 14, "title_font_size": 14, "color": "black",
            },
        )  # fmt: skip
        self._droppers = pyvista.PolyData(flat.copy(), lines=segments(data.droppers))
        self._droppers.cell_data["slack"] = np.zeros(len(data.droppers))
        plotter.add_mesh(
            self._droppers, scalars="slack", clim=(0, 1), cmap=[DROPPER, SLACK],
            line_width=2, lighting=False, show_scalar_bar=False,
        )  # fmt: skip
        self._pantographs = [
            self._add_pantograph(plotter, PANTOGRAPHS[p % len(PANTOGRAPHS)])
            for p in range(data.n_pantographs)
        ]

    def update(self, row: int, uplift: np.ndarray, slack: np.ndarray | None) -> None:
        """Show a record.

        Parameters
        ----------
        row : of the record
        uplift : (n_nodes,) of the line's nodes [m]
        slack : (n_droppers,) whether droppers carry nothing, None if that is not recorded
        """
        data, scale = self._data, self._scale
        height = scale.drawn(data.points[:, 2], uplift)
        for mesh in (self._wires, self._droppers):
            mesh.points[:, 2] = height
            mesh.Modified()
        self._wires["uplift"] = 1e3 * uplift
        if slack is not None:
            self._droppers.cell_data["slack"] = slack.astype(float)
        for p, (arms, head, vehicle, arrow) in enumerate(self._pantographs):
            x, force = float(data.position[row, p]), max(float(data.force[row, p]), 0.0)
            rest = float(data.rest_height(np.array([x]))[0])
            lifted = float(data.head_height[row, p]) - rest
            nodes = data.wires[data.touched(x)]
            # Lines are drawn through nodes, and so is the head in contact with them.
            on_wire = float(np.interp(x, data.points[nodes, 0], uplift[nodes]))
            at_head = float(scale.drawn(np.array(rest), lifted if force == 0.0 else on_wire))
            arms_xz, head_xz = shape(at_head / scale.height, self.foot)
            for mesh, xz in ((arms, arms_xz), (head, head_xz)):
                mesh.points[:] = np.column_stack(
                    [x + xz[:, 0], np.full(len(xz), -1.0), scale.height * xz[:, 1]]
                )
                mesh.Modified()
            roof = scale.height * self.foot
            vehicle.points[:] = [[x - _HALF_VEHICLE, 1.0, roof], [x + _HALF_VEHICLE, 1.0, roof]]
            vehicle.Modified()
            tip = at_head + _ARROW * force
            arrow.points[:] = [
                [x, -2.0, at_head], [x, -2.0, tip],
                [x - 0.7, -2.0, tip - 1.2], [x + 0.7, -2.0, tip - 1.2],
            ]  # fmt: skip
            if force == 0.0:
                arrow.points[:, 2] = at_head
            arrow.Modified()

    def _add_surroundings(self, plotter: pyvista.Plotter) -> None:
        """Track and masts, which stand still."""
        data, scale = self._data, self._scale
        bottom = scale.height * (self.foot - 0.6)
        top = float(scale.drawn(np.array(self.top)))
        x = np.repeat(data.supports, 2)
        points = np.column_stack([x, np.full(x.size, 3.0), np.tile([bottom, top], x.size // 2)])
        masts = pyvista.PolyData(points, lines=segments(np.arange(x.size).reshape(-1, 2)))
        plotter.add_mesh(masts, color=MAST, line_width=6, lighting=False)

    def _add_pantograph(
        self, plotter: pyvista.Plotter, colour: str
    ) -> tuple[pyvista.PolyData, ...]:
        """Arms, head, roof of the vehicle and arrow of the force."""
        arms = pyvista.PolyData(np.zeros((3, 3)), lines=[3, 0, 1, 2])
        head = pyvista.PolyData(np.zeros((2, 3)), lines=[2, 0, 1])
        vehicle = pyvista.PolyData(np.zeros((2, 3)), lines=[2, 0, 1])
        arrow = pyvista.PolyData(np.zeros((4, 3)), lines=[2, 0, 1, 3, 2, 1, 3])
        how: dict[str, Any] = {"lighting": False}
        plotter.add_mesh(vehicle, color=VEHICLE, line_width=10, **how)
        plotter.add_mesh(arms, color=colour, line_width=4, **how)
        plotter.add_mesh(head, color=colour, line_width=7, **how)
        plotter.add_mesh(arrow, color="black", line_width=2, **how)
        return arms, head, vehicle, arrow
