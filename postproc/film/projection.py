"""How places and motions of a line become points of a picture, by where it is looked at from.

Pictures lie in VTK's plane of x and z, and y is the layer: what has a smaller one is in front. A
line is a thousand times longer than it moves: heights and widths are drawn larger than lengths, and
motions from rest larger still. Both factors stand in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.view import View

# Share of the room between the wires that the largest motion fills in a drawing.
_SHARE = 0.4
# Room beside the track in a picture from above that motions are compared with [m], and how far it
# reaches at least to either side, and beyond the wires [m].
_BESIDE, _LEAST, _BEYOND = 1.0, 1.3, 0.6
# Room above a contact wire without another wire [m].
_LEAST_ABOVE = 0.8
# Motions smaller than this are drawn as if they were that large [m].
_SMALLEST = 1e-4


@dataclass(frozen=True)
class Scale:
    """Factors of a drawing: of heights and widths at rest, and of motions from there [-]."""

    size: float
    motion: float

    def drawn(self, rest: np.ndarray, moved: np.ndarray | float = 0.0) -> np.ndarray:
        """Height or width in the drawing of what rests at one [m] and has moved [m]."""
        return np.asarray(self.size * rest + self.motion * moved)


@dataclass(frozen=True)
class Projection:
    """A view with its scale."""

    view: View
    scale: Scale

    def seen(self, rest: np.ndarray, moved: np.ndarray | float, layer: float) -> np.ndarray:
        """Points of the picture, (n, 3), of points at rest that have moved.

        Lengths along the track, and motions along it, are drawn as they are.

        Parameters
        ----------
        rest, moved : (n, 3) along the track, to the left and upward [m]
        layer : of the picture
        """
        moved = np.broadcast_to(moved, rest.shape)
        aside, up = (self.scale.drawn(rest[:, axis], moved[:, axis]) for axis in (1, 2))
        along = rest[:, 0] + moved[:, 0]
        across, high = {
            View.SIDE: (along, up),
            View.PLAN: (along, aside),
            View.ALONG: (-aside, up),
        }[self.view]
        return np.column_stack([across, np.full(len(rest), layer), high])


class Colours(NamedTuple):
    """What colours of wires show: the motion along an ``axis`` (1 to the left, 2 upward), what it
    is called, and the end of its scale [m]."""

    axis: int
    title: str
    largest: float


@dataclass(frozen=True)
class Picture:
    """What a drawing of a run has to hold.

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

    def scale(
        self, data: FilmData, snapshots: Snapshots, numbers: np.ndarray, motion: float | None
    ) -> Scale:
        """The scale that fills it.

        Parameters
        ----------
        numbers : of the snapshots
        motion : the factor of motions if it is given
        """
        axes = {View.SIDE: (2,), View.PLAN: (1,), View.ALONG: (1, 2)}[self.view]
        largest = max(snapshots.largest(numbers, axis) for axis in axes)
        if self.view is View.PLAN:
            between, room = _BESIDE, 2.0 * self.half_width(data)
        else:
            between, room = room_between(data), self.high - self.low
        return scale_for(self.width, room, self.aspect, between, largest, motion)

    def colours(self, snapshots: Snapshots, numbers: np.ndarray) -> Colours:
        """What colours show in some snapshots: uplift, from above the motion sideways if there is
        one."""
        if self.view is View.PLAN:
            aside = snapshots.largest(numbers, 1)
            if aside >= _SMALLEST:
                return Colours(1, "sideways", _round_up(aside))
        return Colours(2, "uplift", _round_up(max(snapshots.largest(numbers, 2), _SMALLEST)))

    @staticmethod
    def half_width(data: FilmData) -> float:
        """How far a picture from above reaches to either side [m]."""
        return max(_LEAST, float(np.abs(data.points[:, 1]).max()) + _BEYOND)


def room_between(data: FilmData) -> float:
    """Height from the contact wire to what hangs above it at a support [m]."""
    heights = data.points[:, 2]
    return float(heights.max() - np.median(heights[data.wires[data.contact]]))


def room_above(data: FilmData) -> float:
    """Height above the contact wire that arrows have, also where nothing hangs there [m]."""
    return max(room_between(data), _LEAST_ABOVE)


def scale_for(
    width_m: float,
    room_m: float,
    aspect: float,
    between_m: float,
    largest_m: float,
    motion: float | None = None,
) -> Scale:
    """The scale that fills a picture.

    Parameters
    ----------
    width_m : length of line in the picture
    room_m : from the lowest to the highest thing drawn, or from side to side
    aspect : width of the picture over its height
    between_m : room that motions are compared with
    largest_m : motion that is drawn; nothing moves if it is smaller than a tenth of a millimetre
    motion : the factor of motions if it is given, at least that of heights otherwise
    """
    size = round_down(width_m / aspect / room_m)
    if motion is None:
        wanted = _SHARE * between_m * size / max(largest_m, _SMALLEST)
        motion = max(round_down(wanted), size) if largest_m >= _SMALLEST else size
    return Scale(size, motion)


def _round_up(value: float) -> float:
    """Two digits that are not below the value."""
    digit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / digit - 1e-9) * digit:.2g}")


def round_down(value: float) -> float:
    """The next smaller of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
    return float(steps[steps <= value / power + 1e-9].max() * power)
