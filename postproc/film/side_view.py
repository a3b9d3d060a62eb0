"""The line, its masts and the pantographs from the side, as actors of a plotter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista
from matplotlib.colors import LinearSegmentedColormap

from catenary.mbs.shape import BODY, HEAD, SPRING, Pose, Shape
from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.scale import Scale
from catenary.postproc.film.train import coaches

# Colours of pantographs by their order, of the line's parts, of droppers that carry nothing.
PANTOGRAPHS = ("#b2182b", "#2166ac", "#1b7837", "#762a83")
MAST, TRACK, VEHICLE, DROPPER, SLACK = "#b8bcc2", "#6b7078", "#d9dde2", "#8c9198", "#e08214"
# Uplift from below to above rest, which is dark on a white ground.
_COLOURS = LinearSegmentedColormap.from_list("uplift", ["#2166ac", "#3a3f45", "#d6301f"])
# How far masts stand out above the highest wire [m].
_MAST_ABOVE = 0.4
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
    pantographs : how they are drawn
    parts : names of the wires and other parts of the line that are shown
    """

    def __init__(
        self,
        plotter: pyvista.Plotter,
        data: FilmData,
        scale: Scale,
        largest_uplift: float,
        pantographs: MovingPantographs,
        parts: Sequence[str],
    ) -> None:
        self._data, self._scale = data, scale
        points = data.points
        self.top = float(points[:, 2].max()) + _MAST_ABOVE
        self.foot = pantographs.roof
        self._add_surroundings(plotter)
        flat = np.column_stack([points[:, 0], np.zeros(len(points)), scale.drawn(points[:, 2])])
        pairs = np.concatenate([data.elements[name] for name in data.wires if name in parts])
        droppers = data.droppers if DROPPERS in parts else data.droppers[:0]
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
        self._droppers = pyvista.PolyData(flat.copy(), lines=segments(droppers))
        self._droppers.cell_data["slack"] = np.zeros(len(droppers))
        plotter.add_mesh(
            self._droppers, scalars="slack", clim=(0, 1), cmap=[DROPPER, SLACK],
            line_width=2, lighting=False, show_scalar_bar=False,
        )  # fmt: skip
        self._pantographs = [
            self._add_pantograph(plotter, PANTOGRAPHS[p % len(PANTOGRAPHS)], shape)
            for p, shape in enumerate(pantographs.shapes)
        ]

    def update(
        self, row: int, uplift: np.ndarray, slack: np.ndarray | None, poses: Sequence[Pose]
    ) -> None:
        """Show a record.

        Parameters
        ----------
        row : of the record
        uplift : (n_nodes,) of the line's nodes [m]
        slack : (n_droppers,) whether droppers carry nothing, None if that is not recorded
        poses : of the pantographs
        """
        # What is not shown is beyond the picture.
        uplift = np.nan_to_num(uplift)
        data, scale = self._data, self._scale
        height = scale.drawn(data.points[:, 2], uplift)
        for mesh in (self._wires, self._droppers):
            mesh.points[:, 2] = height
            mesh.Modified()
        self._wires["uplift"] = 1e3 * uplift
        if slack is not None and self._droppers.n_cells:
            self._droppers.cell_data["slack"] = slack.astype(float)
        self._show_train(row)
        for p, (lines, arrow) in enumerate(self._pantographs):
            x, force = float(data.position[row, p]), max(float(data.force[row, p]), 0.0)
            rest = float(data.rest_height(np.array([x]))[0])
            lifted = float(data.head_height[row, p]) - rest
            nodes = data.wires[data.touched(x)]
            # Lines are drawn through nodes, and so is the head in contact with them.
            on_wire = float(np.interp(x, data.points[nodes, 0], uplift[nodes]))
            at_head = float(scale.drawn(np.array(rest), lifted if force == 0.0 else on_wire))
            drawn = self._drawn(
                poses[p], rest, at_head - float(scale.drawn(np.array(rest), lifted))
            )
            for mesh in lines:
                mesh.points[:] = drawn
                mesh.Modified()
            tip = at_head + _ARROW * force
            arrow.points[:] = [
                [x, -2.0, at_head], [x, -2.0, tip],
                [x - 0.7, -2.0, tip - 1.2], [x + 0.7, -2.0, tip - 1.2],
            ]  # fmt: skip
            if force == 0.0:
                arrow.points[:, 2] = at_head
            arrow.Modified()

    def _drawn(self, pose: Pose, wire: float, more: float) -> np.ndarray:
        """Points of a pantograph in the drawing, ``more`` higher where the head is."""
        rest, moved = pose.rest, pose.now - pose.rest
        share = np.clip((rest[:, 2] - self.foot) / max(wire - self.foot, 0.1), 0.0, 1.0)
        height = self._scale.drawn(rest[:, 2], moved[:, 2]) + share * more
        return np.column_stack([pose.now[:, 0], np.full(len(rest), -1.0), height])

    def _show_train(self, row: int) -> None:
        """Put the coaches under their pantographs."""
        roof, bottom = self._scale.height * self.foot, self._scale.height * (self.foot - 1.0)
        corners = [
            [x, 1.0, z]
            for begin, end in coaches(self._data.position[row])
            for x, z in ((begin, bottom), (end, bottom), (end, roof), (begin, roof))
        ]
        self._coaches.points[:] = corners
        self._coaches.Modified()

    def _add_surroundings(self, plotter: pyvista.Plotter) -> None:
        """Track and masts, which stand still."""
        data, scale = self._data, self._scale
        bottom = scale.height * (self.foot - 1.0)
        top = float(scale.drawn(np.array(self.top)))
        x = np.repeat(data.supports, 2)
        points = np.column_stack([x, np.full(x.size, 3.0), np.tile([bottom, top], x.size // 2)])
        masts = pyvista.PolyData(points, lines=segments(np.arange(x.size).reshape(-1, 2)))
        plotter.add_mesh(masts, color=MAST, line_width=6, lighting=False)
        n = len(coaches(data.position[0]))
        faces = np.column_stack([np.full(n, 4), np.arange(4 * n).reshape(n, 4)])
        self._coaches = pyvista.PolyData(np.zeros((4 * n, 3)), faces=faces.ravel())
        plotter.add_mesh(self._coaches, color=VEHICLE, lighting=False)

    def _add_pantograph(
        self, plotter: pyvista.Plotter, colour: str, shape: Shape
    ) -> tuple[list[pyvista.PolyData], pyvista.PolyData]:
        """Lines of springs, bodies and head, and the arrow of the force."""
        points, lines = np.zeros((int(shape.cells.max()) + 1, 3)), []
        for kind, width in ((SPRING, 1.5), (BODY, 4), (HEAD, 7)):
            cells = shape.cells[shape.kinds == kind]
            if len(cells):
                mesh = pyvista.PolyData(points.copy(), lines=segments(cells))
                plotter.add_mesh(mesh, color=colour, line_width=width, lighting=False)
                lines.append(mesh)
        arrow = pyvista.PolyData(np.zeros((4, 3)), lines=[2, 0, 1, 3, 2, 1, 3])
        plotter.add_mesh(arrow, color="black", line_width=2, lighting=False)
        return lines, arrow
