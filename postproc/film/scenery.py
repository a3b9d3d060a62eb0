"""Drawn parts of a run, their looks, and their projection: what films and ParaView are drawn by.

The line comes from the snapshots part by part. Beside it stand the pantographs, the forces at their
heads, the train and the track. Points are places at rest, with how far they have moved from there,
so that motions can be drawn larger than heights. A line is a thousand times longer than it moves:
a `Projection` draws heights and widths larger than lengths, and motions from rest larger still, by
the view. All factors stand in the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from catenary.mbs.shape import BELOW_HEAD, BODY, HEAD, SPRING, Pose, Shape, schematic
from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.film.film_data import FilmData, Frame, Snapshots
from catenary.postproc.film.options import View
from catenary.postproc.record.snapshots.contents import ARMS, BESIDE, CLAMPS, FIXED, MASTS

CONTACT, WIRE = "contact", "wire"
PANTOGRAPHS, FORCES, TRAIN, TRACK = "pantographs", "forces", "train", "track"
# Half the distance of the rails [m].
_HALF_GAUGE = 0.75
# Length of a coach and of the gap to the next one, how far the first one reaches ahead of the
# first pantograph; half its width, and the height of its floor [m].
COACH, GAP, AHEAD = 25.0, 0.6, 8.0
_HALF_WIDTH, _FLOOR = 1.45, 1.0
# Corners of the faces of a box, those in front behind the others from the right, above and ahead.
_FACES = np.array(
    [[2, 3, 7, 6], [0, 1, 3, 2], [0, 2, 6, 4], [1, 3, 7, 5], [4, 5, 7, 6], [0, 1, 5, 4]]
)
# Length of what is drawn of a force that is no pantograph's, and half its width [m].
_STEM, _HALF_STROKE = 0.5, 0.25
# A view from the right and above shows wires that lie so far apart sideways [m].
_APART = 0.05
# Thickness of the lines of a pantograph by their kind, and its colour by its order, as in reports.
THICK = {SPRING: 0.5, BODY: 1.0, HEAD: 1.7}
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
# From the smallest to the largest motion, and from no force of a dropper to the largest one: both
# grow darker or lighter all the way, also to eyes that see no red or no green.
MOTIONS = ("#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#a8d327")
DROPPER_FORCES = ("#d9c29a", "#c08f4f", "#8c5a23", "#4a2c0f")
SLACK, UNKNOWN = "#d6006c", "#8c9198"
# Share of the room between the wires that the largest motion fills in a drawing.
_SHARE = 0.4
# Room beside the track in a picture from above that motions are compared with [m], and how far it
# reaches at least to either side, and beyond the wires [m].
_BESIDE, _LEAST, _BEYOND = 1.0, 1.3, 0.6
# Room above a contact wire without another wire [m].
_LEAST_ABOVE = 0.8
# Smaller motions are not seen [m].
_SMALLEST = 1e-4
# From the right and above: how far along the track, and up, what is a metre to the left is drawn.
_DEPTH = 0.25, 0.35
# From behind: how far the eye is behind the first thing seen, and the nearest that it sees [m].
EYE, NEAREST = 12.0, 1.5


class Look(NamedTuple):
    """Thickness of lines, of the usual one, and colour; None where a motion or a force gives it."""

    thick: float
    colour: str | None


LOOKS = {
    CONTACT: Look(1.2, None),
    WIRE: Look(0.8, None),
    DROPPERS: Look(0.6, None),
    CLAMPS: Look(0.6, "#6b7078"),
    ARMS: Look(0.8, "#8c9198"),
    MASTS: Look(2.0, "#b8bcc2"),
    TRACK: Look(0.8, "#6b7078"),
    TRAIN: Look(0.2, "#d9dde2"),
}


class Stroke:
    """Mark where an excitation acts: a stem up to the wire, with a plate on it."""

    cells = np.array([[0, 1], [2, 3], [4, 5]])
    kinds = np.array([BODY, HEAD, HEAD])
    below = BELOW_HEAD
    schematic = False

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Places of the points: under the wire at rest, as what strikes is not simulated."""
        points = np.zeros((6, 3))
        points[0, 2] = -_STEM
        points[[2, 3], 0] = points[[4, 5], 1] = -_HALF_STROKE, _HALF_STROKE
        points[:, 2] += wire
        return Pose(points, points.copy())


@dataclass(frozen=True)
class LinePart:
    """A part of the line.

    Attributes
    ----------
    kind : key of ``LOOKS``
    cells : (m, 2) points of its lines
    rest : (n, 3) its points [m]
    nodes : (n,) nodes of the line that they move with, ``FIXED`` for one that stays
    """

    kind: str
    cells: np.ndarray
    rest: np.ndarray
    nodes: np.ndarray

    def moved(self, nodes: np.ndarray) -> np.ndarray:
        """Displacements of its points from those of the line's nodes, (n, 3) [m]."""
        return np.where((self.nodes == FIXED)[:, None], 0.0, nodes[self.nodes])


@dataclass(frozen=True)
class Part:
    """A part beside the line.

    Attributes
    ----------
    cells : (m, k) points of its dots, lines or faces, k = 1, 2, 4
    fields : of its cells by name, (m,) each
    moves : whether it is elsewhere at each time
    """

    cells: np.ndarray
    fields: dict[str, np.ndarray] = field(default_factory=dict)
    moves: bool = True


class Places(NamedTuple):
    """Points of a part at a time, (n, 3) [m]: at rest, and how far they have moved from there."""

    rest: np.ndarray
    moved: np.ndarray


class Scenery:
    """A run as parts that can be drawn. Not collective.

    Attributes
    ----------
    data : of the run
    line : parts of the line by name
    parts : parts beside it, by name; no train where an excitation stands for it
    shapes : of the pantographs
    roof : height of the roofs that they stand on [m]
    number : pantograph of each point of ``parts["pantographs"]``

    Parameters
    ----------
    snapshots : of the line
    shapes : of the pantographs, None for schematics
    """

    def __init__(
        self, data: FilmData, snapshots: Snapshots, shapes: Sequence[Shape] | None = None
    ) -> None:
        self.data = data
        self.line = {name: _line_part(name, data, snapshots) for name in snapshots.parts}
        contact = float(np.median(data.points[data.wires[data.contact], 2]))
        known = snapshots.n_pantographs == data.n_pantographs
        if data.excitation is not None:
            shapes = [Stroke()]
        elif shapes is None or len(shapes) != data.n_pantographs or not known:
            shapes = [schematic()] * data.n_pantographs
        self._known = known and data.excitation is None
        self.shapes = list(shapes)
        self.roof = contact - max(one.below for one in self.shapes)
        sizes = [1 + int(shape.cells.max()) for shape in self.shapes]
        self.number = np.repeat(np.arange(len(sizes)), sizes)
        starts = np.cumsum([0, *sizes])
        cells = [one.cells + begin for one, begin in zip(self.shapes, starts, strict=False)]
        fields = {
            "number": np.repeat(np.arange(len(sizes)), [len(one.cells) for one in self.shapes]),
            "kind": np.concatenate([one.kinds for one in self.shapes]),
        }
        self.parts = {
            PANTOGRAPHS: Part(np.concatenate(cells), fields),
            FORCES: Part(np.arange(data.n_pantographs)[:, None]),
            TRACK: Part(np.array([[0, 1], [2, 3]]), moves=False),
        }
        if data.excitation is None:
            n = len(coaches(data.position[0]))
            faces = np.concatenate([8 * k + _FACES for k in range(n)])
            self.parts[TRAIN] = Part(faces, {"face": np.tile(np.arange(len(_FACES)), n)})

    @property
    def track(self) -> np.ndarray:
        """Points (4, 3) of the rails, from end to end of the line [m]."""
        ends = self.data.points[:, 0].min(), self.data.points[:, 0].max()
        return np.array([[x, side, 0.0] for side in (-_HALF_GAUGE, _HALF_GAUGE) for x in ends])

    @property
    def best_view(self) -> View:
        """From the right and above where wires lie beside each other, from the side otherwise."""
        if len(self.data.contacts) > 1 or float(np.ptp(self.data.points[:, 1])) > _APART:
            return View.OBLIQUE
        return View.SIDE

    def beside(self, time: float, frame: Frame) -> dict[str, Places]:
        """Places of the parts beside the line at a time.

        A head that presses on a wire is drawn where the wire is, which is drawn between its nodes;
        the arms below it give way in proportion.

        Parameters
        ----------
        time : float
            Time [s].
        frame : Frame
            The line at that time.
        """
        data, row = self.data, self.data.row_at(time)
        position, height = data.position[row], data.rest_height(data.position[row])
        touched = self._contacts(row, np.nan_to_num(frame.moved))
        poses = []
        for p, one in enumerate(self.shapes):
            base, places = frame.places[p] if self._known else (0.0, np.zeros(0))
            head, wire = float(data.head_height[row, p]), float(height[p])
            pose = one.pose(places, base, head, wire)
            more = float(touched.rest[p, 2] + touched.moved[p, 2]) - head
            share = np.clip(1.0 + (pose.rest[:, 2] - wire) / one.below, 0.0, 1.0)
            pose.now[:, 2] += share * more
            if one.schematic:  # it counts from the wire, and stands on the roof wherever that is
                for points in pose:
                    points[:, 2] += (1.0 - share) * (self.roof + one.below - wire)
            poses.append(Pose(*(points + [position[p], 0.0, 0.0] for points in pose)))
        rest, now = (np.concatenate(own) for own in zip(*poses, strict=True))
        found = {
            PANTOGRAPHS: Places(rest, now - rest),
            FORCES: touched,
            TRACK: Places(self.track, np.zeros((4, 3))),
        }
        if TRAIN in self.parts:
            corners = _boxes(position, self.roof)
            found[TRAIN] = Places(corners, np.zeros_like(corners))
        return found

    def _contacts(self, row: int, moved: np.ndarray) -> Places:
        """Places at rest of the lowest wires above the heads, and their displacements; heads that
        touch no wire have displacements up to their own height."""
        data = self.data
        rest, by = np.zeros((2, data.n_pantographs, 3))
        for p, x in enumerate(data.position[row].tolist()):
            above = []
            for name in data.contacts_at(x):
                nodes = data.wires[name]
                own = data.points[nodes]
                there = [np.interp(x, own[:, 0], column) for column in (*own.T, *moved[nodes].T)]
                above.append((there[2] + there[5], there))
            there = min(above)[1]
            rest[p], by[p] = (x, *there[1:3]), (0.0, *there[4:6])
            if not data.force[row, p] > 0.0:
                by[p, 2] = data.head_height[row, p] - rest[p, 2]
        return Places(rest, by)


def _line_part(name: str, data: FilmData, snapshots: Snapshots) -> LinePart:
    if name in data.wires:
        kind = CONTACT if name in data.contacts else WIRE
        return LinePart(kind, data.elements[name], data.points, np.arange(len(data.points)))
    if name == DROPPERS:
        nodes = data.droppers.ravel()
        return LinePart(name, np.arange(nodes.size).reshape(-1, 2), data.points[nodes], nodes)
    block = snapshots.block(name)
    cells = np.arange(len(block.points)).reshape(-1, 2)
    return LinePart(name, cells, block.points, block.nodes)


def coaches(position: np.ndarray) -> np.ndarray:
    """From and to of the coaches along the track, (n, 2) [m], as many as carry the pantographs.

    Parameters
    ----------
    position : ndarray, shape (n_pantographs,)
        Places of the pantographs along the track [m].
    """
    front = float(position.max()) + AHEAD
    n = 1 + int((front - float(position.min())) // (COACH + GAP))
    begin = front - (COACH + GAP) * np.arange(n)
    return np.column_stack([begin - COACH, begin])


def _boxes(position: np.ndarray, roof: float) -> np.ndarray:
    """Corners of the coaches under a roof (8 n, 3) [m]."""
    corners = [
        [x, side * _HALF_WIDTH, z]
        for begin, end in coaches(position)
        for z in (_FLOOR, roof)
        for side in (-1.0, 1.0)
        for x in (begin, end)
    ]
    return np.array(corners)


@dataclass(frozen=True)
class Scale:
    """Factors of a drawing: of heights and widths at rest, of motions from there, and of lengths of
    pantographs along the track, which are tall and thin otherwise [-]."""

    size: float
    motion: float
    along: float = 1.0


@dataclass(frozen=True)
class Projection:
    """A view with its scale; from behind, with the height at which lines along the track meet."""

    view: View
    scale: Scale
    horizon: float = 0.0

    def seen(
        self, rest: np.ndarray, moved: np.ndarray | float = 0.0, eye: float = 0.0
    ) -> np.ndarray:
        """Points of the picture, (n, 2), of points at rest that have moved.

        Lengths along the track, and motions along it, are drawn as they are.

        Parameters
        ----------
        rest : ndarray, shape (n, 3)
            Points at rest: along the track, to the left and upward [m].
        moved : ndarray, shape (n, 3), or float, optional
            Displacements of these points [m].
        eye : float, optional
            Place along the track of the observer of the view from behind [m].
        """
        moved = np.broadcast_to(moved, rest.shape)
        aside, up = (self.scale.size * rest[:, 1:] + self.scale.motion * moved[:, 1:]).T
        along = rest[:, 0] + moved[:, 0]
        if self.view is View.PLAN:
            return np.column_stack([along, aside])
        if self.view is View.ALONG:
            near = EYE / np.maximum(along - eye, NEAREST)
            horizon = self.scale.size * self.horizon
            return np.column_stack([-aside * near, horizon + (up - horizon) * near])
        if self.view is View.OBLIQUE:
            along, up = along + _DEPTH[0] * aside, up + _DEPTH[1] * aside
        return np.column_stack([along, up])


class Colours(NamedTuple):
    """Colour scale of the wires: motion along an ``axis`` (1 to the left, 2 upward), its name, and
    the ends of the scale [m]."""

    axis: int
    title: str
    low: float
    high: float


@dataclass(frozen=True)
class Picture:
    """Frame of a drawing of a run.

    Attributes
    ----------
    view : where it is looked at from
    width : length of line in the picture [m]
    aspect : width of the picture over its height
    low, high : heights of the lowest and the highest thing drawn [m]
    """

    view: View
    width: float
    aspect: float
    low: float
    high: float

    @classmethod
    def of(cls, view: View, data: FilmData, roof: float, width: float, aspect: float) -> Picture:
        """Frame of a run, from the train's roof to above the wires; from above, from side to side.

        From behind lengths are not seen: one metre of height is one metre of the picture.

        Parameters
        ----------
        view : View
            Direction from which the run is seen.
        data : FilmData
            Line and motion of the run.
        roof : float
            Height of the train's roof [m].
        width : float
            Length of line in the picture [m].
        aspect : float
            Width of the picture over its height.
        """
        low, high = roof - 1.0, float(data.points[:, 2].max()) + 0.6
        if view is View.PLAN:
            high = max(_LEAST, float(np.abs(data.points[:, 1]).max()) + _BEYOND)
            low = -high
        elif view is View.OBLIQUE:
            high += _DEPTH[1] * BESIDE
        elif view is View.ALONG:
            width = aspect * (high - low)
        return cls(view, width, aspect, low, high)

    def scale(self, data: FilmData, extremes: np.ndarray, motion: float | None) -> Scale:
        """The scale that fills it.

        Parameters
        ----------
        data : FilmData
            Data of the film.
        extremes : ndarray, shape (2, 3)
            Smallest and largest motion [m], see `Snapshots.extremes`.
        motion : float or None
            Factor of motions; if None, the largest motion fills a share of the room between the
            wires, and nothing is drawn larger that hardly moves.
        """
        plan = self.view is View.PLAN
        axes = {View.SIDE: [2], View.PLAN: [1]}.get(self.view, [1, 2])
        largest = float(np.abs(extremes[:, axes]).max())
        size = round_down(self.width / self.aspect / (self.high - self.low))
        if motion is None:
            wanted = _SHARE * size * (_BESIDE if plan else room_between(data))
            motion = size if largest < _SMALLEST else max(size, round_down(wanted / largest))
        return Scale(size, motion, max(1.0, round_down(np.sqrt(size))))

    def colours(self, extremes: np.ndarray) -> Colours:
        """Scale of the colours: of uplift, or from above of the motion sideways if there is one."""
        axis, title = 2, "uplift"
        if self.view is View.PLAN and np.abs(extremes[:, 1]).max() >= _SMALLEST:
            axis, title = 1, "to the left"
        low, high = extremes[:, axis]
        return Colours(axis, title, -_round_up(-low), _round_up(max(high, _SMALLEST)))


def room_between(data: FilmData) -> float:
    """Height from the contact wire to what hangs above it at a support [m]."""
    heights = data.points[:, 2]
    return float(heights.max() - np.median(heights[data.wires[data.contact]]))


def room_above(data: FilmData) -> float:
    """Height above the contact wire that arrows have, also where nothing hangs there [m]."""
    return max(room_between(data), _LEAST_ABOVE)


def _round_up(value: float) -> float:
    """Two digits that are not below the value, zero of what is smaller than can be seen."""
    if value < _SMALLEST:
        return 0.0
    digit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / digit - 1e-9) * digit:.2g}")


def round_down(value: float) -> float:
    """The next smaller of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
    return float(steps[steps <= value / power + 1e-9].max() * power)
