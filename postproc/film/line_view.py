"""The line, its masts and the pantographs from one side, as actors of a plotter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista
from matplotlib.colors import LinearSegmentedColormap

from catenary.mbs.shape import BODY, HEAD, SPRING, Pose, Shape
from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.film.beside_line import boxes, contacts, faces_of, rails
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.pantograph_shape import MovingPantographs
from catenary.postproc.film.projection import Colours, Projection, room_above
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.view import View
from catenary.postproc.record.snapshots.blocks import BESIDE

# Colours of pantographs by their order, of the line's parts, of droppers that carry nothing.
PANTOGRAPHS = ("#b2182b", "#2166ac", "#1b7837", "#762a83")
MAST, TRACK, VEHICLE, DROPPER, SLACK = "#b8bcc2", "#6b7078", "#d9dde2", "#8c9198", "#e08214"
# Uplift from below to above rest, which is dark on a white ground.
_COLOURS = LinearSegmentedColormap.from_list("uplift", ["#2166ac", "#3a3f45", "#d6301f"])
# How far masts stand out above the highest wire [m].
_MAST_ABOVE = 0.4
# Length of the arrow of a force: share of the drawn room above the contact wire per N.
_ARROW = 0.0035
# Length of line that is seen from behind the train, from behind the first pantograph on [m].
_SEEN_BEHIND, _SEEN_AHEAD = 2.0, 65.0
# How far lines across the track reach to either side [m].
_ACROSS = 50.0
# Where what is not seen is put.
_NOWHERE = -1e6


def segments(pairs: np.ndarray) -> np.ndarray:
    """Pairs of points as VTK's cells of lines."""
    return np.column_stack([np.full(len(pairs), 2), pairs]).ravel()


class LineView:
    """Actors of a line and its train in one subplot of a plotter. Not collective.

    Attributes
    ----------
    foot, top : heights of the roofs and of the tops of masts [m]

    Parameters
    ----------
    plotter : its active subplot is drawn into
    data : of the run
    projection : of the drawing
    colours : what colours of wires show
    pantographs : how they are drawn
    snapshots : whose parts of the line are shown
    """

    def __init__(
        self,
        plotter: pyvista.Plotter,
        data: FilmData,
        projection: Projection,
        colours: Colours,
        pantographs: MovingPantographs,
        snapshots: Snapshots,
    ) -> None:
        self._data, self._projection = data, projection
        points, parts = data.points, snapshots.parts
        self.top = float(points[:, 2].max()) + _MAST_ABOVE
        self.foot = pantographs.roof
        self._add_surroundings(plotter)
        flat = projection.seen(points, 0.0, 0.0)
        droppers = data.droppers if DROPPERS in parts else data.droppers[:0]
        self._hinges, self._held = snapshots.arms()
        if projection.view is View.SIDE:
            self._hinges, self._held = self._hinges[:0], self._held[:0]
        k = len(self._held)
        arms = np.column_stack([np.arange(k), k + np.arange(k)])
        self._arms = pyvista.PolyData(np.zeros((2 * k, 3)), lines=segments(arms))
        if k:
            plotter.add_mesh(self._arms, color=MAST, line_width=3, lighting=False)
        self._axis, title, largest = colours
        shown = [name for name in data.wires if name in parts]
        contacts = [name for name in shown if name in data.contacts]
        self._wires: list[pyvista.PolyData] = []
        for names, thick in ((contacts, 5), ([one for one in shown if one not in contacts], 3)):
            if not names:
                continue
            pairs = np.concatenate([data.elements[name] for name in names])
            mesh = pyvista.PolyData(flat.copy(), lines=segments(pairs))
            mesh["moved"] = np.zeros(len(points))
            plotter.add_mesh(
                mesh,
                scalars="moved",
                clim=(-1e3 * largest, 1e3 * largest),
                cmap=_COLOURS,
                line_width=thick,
                lighting=False,
                show_scalar_bar=not self._wires,
                scalar_bar_args={
                    "title": f"{title} [mm]\n", "vertical": False, "height": 0.07, "width": 0.28,
                    "position_x": 0.7, "position_y": 0.87, "n_labels": 3, "fmt": "%.3g",
                    "label_font_size": 14, "title_font_size": 14, "color": "black",
                },
            )  # fmt: skip
            self._wires.append(mesh)
        # Each has points of its own: where wires are cut, a dropper is there whole or not at all.
        self._ends = droppers
        pairs = np.arange(droppers.size).reshape(-1, 2)
        self._droppers = pyvista.PolyData(flat[droppers.ravel()], lines=segments(pairs))
        self._droppers.cell_data["slack"] = np.zeros(len(droppers))
        if len(droppers):
            plotter.add_mesh(
                self._droppers, scalars="slack", clim=(0, 1), cmap=[DROPPER, SLACK],
                line_width=2, lighting=False, show_scalar_bar=False,
            )  # fmt: skip
        self._pantographs = [
            self._add_pantograph(plotter, PANTOGRAPHS[p % len(PANTOGRAPHS)], shape)
            for p, shape in enumerate(pantographs.shapes)
        ]

    def update(
        self, row: int, moved: np.ndarray, slack: np.ndarray | None, poses: Sequence[Pose]
    ) -> None:
        """Show a record.

        Parameters
        ----------
        row : of the record
        moved : (n_nodes, 3) how far the line's nodes have moved [m]
        slack : (n_droppers,) whether droppers carry nothing, None if that is not recorded
        poses : of the pantographs
        """
        # What is not shown is beyond the picture.
        moved = np.nan_to_num(moved)
        data, projection = self._data, self._projection
        drawn = projection.seen(data.points, moved, 0.0)
        hung = drawn[self._ends.ravel()]
        hung[np.repeat(data.gone[: len(self._ends)] <= data.time[row], 2)] = _NOWHERE
        hinges = projection.seen(self._hinges, 0.0, 0.5)
        if projection.view is View.ALONG:
            first = float(data.position[row].max())
            low, high = first - _SEEN_BEHIND, first + _SEEN_AHEAD
            self._cut(drawn, low, high)
            far = (self._hinges[:, 0] < low) | (self._hinges[:, 0] > high)
            hinges[far] = drawn[self._held[far]]
            x = data.points[self._ends[:, 1], 0]
            hung[np.repeat((x < low) | (x > high), 2)] = _NOWHERE
        for mesh in self._wires:
            mesh.points[:] = drawn
            mesh.Modified()
        self._droppers.points[:] = hung
        self._droppers.Modified()
        self._arms.points[:] = np.concatenate([hinges, drawn[self._held]])
        self._arms.Modified()
        for mesh in self._wires:
            mesh["moved"] = 1e3 * moved[:, self._axis]
        if slack is not None and self._droppers.n_cells:
            self._droppers.cell_data["slack"] = slack.astype(float)
        if self._coaches is not None:
            self._coaches.points[:] = projection.seen(
                boxes(data.position[row], self.foot), 0.0, 1.0
            )
            self._coaches.Modified()

        def moved_at(wire: str, x: float, axis: int = 1) -> float:
            nodes = data.wires[wire]
            return float(np.interp(x, data.points[nodes, 0], moved[nodes, axis]))

        heads = contacts(data, row, moved_at)
        for p, (lines, arrow) in enumerate(self._pantographs):
            at, by = heads[0][p], heads[1][p]
            x, force, lifted = at[0], max(float(data.force[row, p]), 0.0), by[2]
            # Lines are drawn through nodes, and so is the head in contact with them.
            by[2] = moved_at(data.touched(x), x, 2) if force > 0.0 else lifted
            pose = _raised(poses[p], self.foot, at[2], by[2] - lifted)
            shape = projection.seen(pose.rest, pose.now - pose.rest, -1.0)
            for mesh in lines:
                mesh.points[:] = shape
                mesh.Modified()
            touched = projection.seen(at[None], by[None], -2.0)[0]
            arrow.points[:] = self._arrow(touched, force)
            arrow.Modified()

    def _cut(self, drawn: np.ndarray, low: float, high: float) -> None:
        """Let the wires end at places along the track: what is beyond goes to their ends there."""
        x = self._data.points[:, 0]
        for nodes in self._data.wires.values():
            first, last = np.searchsorted(x[nodes], [low, high])
            if first >= last:
                drawn[nodes] = _NOWHERE
            else:
                drawn[nodes[:first]], drawn[nodes[last:]] = (
                    drawn[nodes[first]],
                    drawn[nodes[last - 1]],
                )

    def _arrow(self, at: np.ndarray, force: float) -> np.ndarray:
        """Stem and tip of the arrow of a force in the picture; from above a cross."""
        if self._projection.view is View.PLAN:
            half = 0.6
            ends = [[-half, 0.0, -half], [half, 0.0, half], [-half, 0.0, half], [half, 0.0, -half]]
            return at + (np.array(ends) if force > 0.0 else 0.0)
        size = self._projection.scale.size
        length = _ARROW * size * room_above(self._data) * force
        head = min(0.12 * size, 0.5 * length)
        return at + np.array(
            [
                [0.0, 0.0, 0.0], [0.0, 0.0, length],
                [-0.6 * head, 0.0, length - head], [0.6 * head, 0.0, length - head],
            ]
        )  # fmt: skip

    def _add_surroundings(self, plotter: pyvista.Plotter) -> None:
        """Track and masts, which stand still; from above a line across the track at each mast."""
        data, n = self._data, self._data.supports.size
        ends = np.zeros((n, 2, 3))
        ends[:, :, 0] = data.supports[:, None]
        if self._projection.view is View.PLAN:
            ends[:, 0, 1], ends[:, 1, 1] = -_ACROSS, _ACROSS
        else:
            ends[:, :, 1] = BESIDE
            ends[:, 0, 2], ends[:, 1, 2] = self.foot - 1.0, self.top
        points = self._projection.seen(ends.reshape(-1, 3), 0.0, 3.0)
        masts = pyvista.PolyData(points, lines=segments(np.arange(2 * n).reshape(-1, 2)))
        width = 2 if self._projection.view is View.PLAN else 6
        plotter.add_mesh(masts, color=MAST, line_width=width, lighting=False)
        if self._projection.view is View.PLAN:
            points, lines = rails(data)
            mesh = pyvista.PolyData(self._projection.seen(points, 0.0, 2.0), lines=segments(lines))
            plotter.add_mesh(mesh, color=TRACK, line_width=2, lighting=False)
        self._coaches: pyvista.PolyData | None = None
        if data.excitation is None:
            corners = np.zeros_like(boxes(data.position[0], self.foot))
            corners_of = faces_of(len(corners) // 8)
            faces = np.column_stack([np.full(len(corners_of), 4), corners_of])
            self._coaches = pyvista.PolyData(corners, faces=faces.ravel())
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
        joined = [2, 0, 1, 2, 2, 3] if self._projection.view is View.PLAN else [2, 0, 1, 3, 2, 1, 3]
        arrow = pyvista.PolyData(np.zeros((4, 3)), lines=joined)
        plotter.add_mesh(arrow, color="black", line_width=2, lighting=False)
        return lines, arrow


def _raised(pose: Pose, foot: float, wire: float, more: float) -> Pose:
    """A pantograph whose head is ``more`` [m] higher, and what is below it in proportion."""
    share = np.clip((pose.rest[:, 2] - foot) / max(wire - foot, 0.1), 0.0, 1.0)
    return Pose(pose.rest, pose.now + share[:, None] * np.array([0.0, 0.0, more]))
