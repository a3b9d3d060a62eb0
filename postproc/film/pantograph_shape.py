"""The pantographs of a run as lines, snapshot by snapshot.

Masses and bodies are drawn where the snapshots have them. Where they have none, or nothing is known
of the pantograph's model, it is a schematic of two arms under the head.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.mbs.shape import BELOW_HEAD, BODY, HEAD, Pose, Shape
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.snapshots import Snapshots

# Lower and upper arm, and half the length of a head along and across the track [m].
LOWER_ARM, UPPER_ARM, HALF_HEAD, HALF_STRIP = 1.55, 1.95, 0.45, 0.8
# How far the foot stands ahead of the head, towards the knee [m].
_FOOT_AHEAD = 0.6
# Length of what is drawn of a force that is no pantograph's, and half its width [m].
_STEM, _HALF_STROKE = 0.5, 0.25


class Schematic:
    """Two arms and a head, as high as the record says; a shape as `mbs.shape` has them.

    Parameters
    ----------
    foot : height of the foot of the arms [m]
    """

    cells = np.array([[0, 1], [1, 2], [3, 4], [5, 6]])
    kinds = np.array([BODY, BODY, HEAD, HEAD])
    below = BELOW_HEAD

    def __init__(self, foot: float) -> None:
        self._foot = foot

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Where the points are; foot and knee move by none and half of what the head does."""
        arms, ends = shape(wire, self._foot)
        xz = np.concatenate([arms, ends, [[0.0, wire], [0.0, wire]]])
        aside = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -HALF_STRIP, HALF_STRIP])
        rest = np.column_stack([xz[:, 0], aside, xz[:, 1]])
        now = rest.copy()
        now[:, 2] += np.array([0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0]) * (head - wire)
        return Pose(rest, now)


class Stroke:
    """What is drawn where an excitation acts: a stem up to the wire, with a plate on it."""

    cells = np.array([[0, 1], [2, 3], [4, 5]])
    kinds = np.array([BODY, HEAD, HEAD])
    below = BELOW_HEAD

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Where the points are: under the wire at rest, as what strikes is not simulated."""
        points = np.zeros((6, 3))
        points[0, 2] = -_STEM
        points[[2, 3], 0] = points[[4, 5], 1] = -_HALF_STROKE, _HALF_STROKE
        points[:, 2] += wire
        return Pose(points, points.copy())


class MovingPantographs:
    """All pantographs of a run, or what stands for them. Not collective.

    Attributes
    ----------
    shapes : of each
    roof : height of the roofs that they stand on [m]
    """

    def __init__(
        self, data: FilmData, snapshots: Snapshots, shapes: Sequence[Shape] | None
    ) -> None:
        self._data, self._snapshots = data, snapshots
        contact = float(np.median(data.points[data.wires[data.contact], 2]))
        known = snapshots.n_pantographs == data.n_pantographs
        if data.excitation is not None:
            shapes = [Stroke()]
        elif shapes is None or len(shapes) != data.n_pantographs or not known:
            shapes = [Schematic(contact - BELOW_HEAD)] * data.n_pantographs
        self.shapes = list(shapes)
        self.roof = contact - max(one.below for one in self.shapes)

    def poses(self, number: int) -> list[Pose]:
        """Places of all points in a snapshot, for each pantograph."""
        data = self._data
        row = data.row_at(float(self._snapshots.times[number]))
        wire = data.rest_height(data.position[row])
        known = self._snapshots.pantographs(number)
        found = []
        for p, one in enumerate(self.shapes):
            there = p < len(known) and data.excitation is None
            base, places = known[p] if there else (0.0, np.zeros(0))
            pose = one.pose(places, base, float(data.head_height[row, p]), float(wire[p]))
            x = np.array([data.position[row, p], 0.0, 0.0])
            found.append(Pose(pose.rest + x, pose.now + x))
        return found


def shape(head: float, foot: float) -> tuple[np.ndarray, np.ndarray]:
    """Foot, knee and hinge of the head, and the ends of the head, as (x, z).

    x [m] counts from the middle of the head in the direction of travel, z [m] from the top of rail.

    Parameters
    ----------
    head, foot : heights [m]; arms are stretched where they would not reach

    Returns
    -------
    arms (3, 2), head (2, 2)
    """
    foot_at, head_at = np.array([_FOOT_AHEAD, foot]), np.array([0.0, head])
    across = head_at - foot_at
    distance = float(np.hypot(*across))
    lower, upper = LOWER_ARM, UPPER_ARM
    longer = max(1.0, 1.001 * distance / (lower + upper))
    lower, upper = longer * lower, longer * upper
    distance = max(distance, 1.001 * abs(upper - lower))
    # Law of cosines: how far along the line from foot to head the knee stands, and beside it.
    along = (lower**2 - upper**2 + distance**2) / (2 * distance)
    beside = np.sqrt(max(lower**2 - along**2, 0.0))
    unit = across / max(float(np.hypot(*across)), 1e-9)
    knee = foot_at + along * unit + beside * np.array([unit[1], -unit[0]])
    arms = np.array([foot_at, knee, head_at])
    return arms, np.array([[-HALF_HEAD, head], [HALF_HEAD, head]])
