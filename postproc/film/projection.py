"""Projection of places and motions of a line to points of a picture, by the view.

A line is a thousand times longer than it moves: heights and widths are drawn larger than lengths,
and motions from rest larger still. All factors stand in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.options import View
from catenary.postproc.record.snapshots.blocks import BESIDE

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
