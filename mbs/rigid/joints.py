"""Joints between bodies: constraints Phi(q, t) = 0 with Jacobian and right side of accelerations.

Each joint has a name and gives its rows as a `Quantity`: Phi itself, Phi_q, d Phi/dt, and the
drift, of which gamma in Phi_q dv/dt = gamma is the negative. The first ``n_lengths`` rows are in
metres, the others are cosines of angles that are right ones when the joint is closed.

Source: P. E. Nikravesh, Computer-aided analysis of mechanical systems, 1988, chapter 7.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import SPACE, Motion, Vector, rotation_matrix
from catenary.mbs.rigid.kinematics import (
    Law,
    Quantity,
    along,
    applied_to,
    cross,
    difference,
    direction,
    dot,
    point,
    scaled,
    shifted,
    stacked,
    total,
)

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

ORIGIN = (0.0, 0.0, 0.0)
AXES = np.eye(3)

# A prescribed number [m or rad] with its rates at a time [s].
TimeLaw = Callable[[float], Law]


class Joint(Protocol):
    """Interface of a joint to a system of bodies."""

    @property
    def name(self) -> str: ...

    @property
    def n_lengths(self) -> int: ...

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives at ``time`` [s], one number a row."""


def across(axis: Vector) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors that are perpendicular to an axis and to each other."""
    first, second, _ = _frame(*(float(x) for x in axis))
    return first, second


def unit(axis: Vector) -> np.ndarray:
    """The axis with length one."""
    return _frame(*(float(x) for x in axis))[2]


@lru_cache(maxsize=4096)
def _frame(x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two unit vectors across an axis, and the axis with length one, not to be written to."""
    axis = np.array([x, y, z])
    length = np.linalg.norm(axis)
    if not length > 0.0:
        raise InputError("The axis of a joint must not have zero length.")
    axis /= length
    first = np.cross(axis, AXES[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    frame = first, np.cross(axis, first), axis
    for vector in frame:
        vector.flags.writeable = False
    return frame


@dataclass(frozen=True)
class Constant:
    """A prescribed number that stays as it is."""

    number: float

    def __call__(self, time: float) -> Law:
        return Law(self.number, 0.0, 0.0)


def constant(value: float) -> TimeLaw:
    """A prescribed number that stays as it is."""
    return Constant(value)


def steady(start: float, speed: float) -> TimeLaw:
    """A prescribed number that grows with constant speed from its value at time zero."""
    return lambda time: Law(start + speed * time, speed, 0.0)


def tabulated(times: Vector, values: Vector) -> TimeLaw:
    """A prescribed number from a table, by a cubic spline with free ends."""
    from scipy.interpolate import CubicSpline  # of which few mechanisms have need

    spline = CubicSpline(times, values, bc_type="natural")
    return lambda time: Law(*(float(spline(time, k)) for k in range(3)))


def same_point(motion: Motion, i: str, at_i: Vector, j: str, at_j: Vector) -> Quantity:
    """Three rows: a point of body i is at a point of body j."""
    return difference(point(motion, i, at_i), point(motion, j, at_j))


def right_angles(motion: Motion, i: str, normals: tuple[Vector, ...], axis: Quantity) -> Quantity:
    """A row for each vector of body i that must be perpendicular to ``axis``."""
    return stacked([dot(direction(motion, i, normal), axis) for normal in normals])


@dataclass(frozen=True)
class Spherical:
    """A point of body i is a point of body j: three rows."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    n_lengths: ClassVar[int] = 3

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        return same_point(motion, self.i, self.at_i, self.j, self.at_j)


@dataclass(frozen=True)
class Revolute:
    """Bodies i and j turn about a common axis through a common point: five rows."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    axis_i: Vector = (0.0, 1.0, 0.0)
    axis_j: Vector = (0.0, 1.0, 0.0)
    n_lengths: ClassVar[int] = 3

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        axis = direction(motion, self.j, unit(self.axis_j))
        return stacked(
            [
                same_point(motion, self.i, self.at_i, self.j, self.at_j),
                right_angles(motion, self.i, across(self.axis_i), axis),
            ]
        )


@dataclass(frozen=True)
class PointOnLine:
    """A point of body j stays on a line fixed in body i: two rows."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    axis_i: Vector = (1.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 2

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        gap = same_point(motion, self.j, self.at_j, self.i, self.at_i)
        return right_angles(motion, self.i, across(self.axis_i), gap)


@dataclass(frozen=True)
class Prismatic:
    """Body j slides along an axis of body i without turning: five rows.

    ``normal_i`` and ``normal_j`` are across the axis and point the same way in both bodies.
    """

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    axis_i: Vector = (1.0, 0.0, 0.0)
    axis_j: Vector = (1.0, 0.0, 0.0)
    normal_i: Vector = (0.0, 0.0, 1.0)
    normal_j: Vector = (0.0, 0.0, 1.0)
    n_lengths: ClassVar[int] = 2

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        normals = across(self.axis_i)
        gap = same_point(motion, self.j, self.at_j, self.i, self.at_i)
        side = cross(unit(self.axis_i), unit(self.normal_i))
        return stacked(
            [
                right_angles(motion, self.i, normals, gap),
                right_angles(motion, self.i, normals, direction(motion, self.j, unit(self.axis_j))),
                right_angles(motion, self.i, (side,), direction(motion, self.j, self.normal_j)),
            ]
        )


@dataclass(frozen=True)
class RevolutePrismatic:
    """Body j slides along its own axis and turns about an axis of body i: four rows.

    A massless piece between both turns on body i about ``turn_axis_i`` and lets body j slide along
    ``slide_axis_j``; ``turn_axis_j`` is the axis of turning in axes of body j.
    """

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    turn_axis_i: Vector = (1.0, 0.0, 0.0)
    turn_axis_j: Vector = (1.0, 0.0, 0.0)
    slide_axis_j: Vector = (0.0, 0.0, 1.0)
    n_lengths: ClassVar[int] = 2

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        gap = same_point(motion, self.i, self.at_i, self.j, self.at_j)
        turn_axis = direction(motion, self.i, unit(self.turn_axis_i))
        return stacked(
            [
                right_angles(motion, self.j, across(self.slide_axis_j), gap),
                right_angles(motion, self.j, across(self.turn_axis_j), turn_axis),
            ]
        )


@dataclass(frozen=True)
class Fixed:
    """Body j is held by body i, or in space: six rows.

    ``parameters`` are the unit Euler parameters (4,) of body j as seen from body i.
    """

    name: str
    j: str
    i: str = SPACE
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN
    parameters: Vector = (1.0, 0.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 3

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        axes_i = rotation_matrix(np.asarray(self.parameters)).T
        angles = [
            right_angles(motion, self.i, (axes_i[k],), direction(motion, self.j, AXES[k - 2]))
            for k in range(3)
        ]
        gap = same_point(motion, self.j, self.at_j, self.i, self.at_i)
        return stacked([gap, *angles])


@dataclass(frozen=True)
class PointOnCurve:
    """A point of a body stays on a curve y(x), z(x) in space: two rows.

    ``x``, ``y``, ``z`` are points of the curve, shape (n,) [m], n >= 2, joined by natural cubic
    splines.
    """

    name: str
    body: str
    x: Vector
    y: Vector
    z: Vector
    at: Vector = ORIGIN
    n_lengths: ClassVar[int] = 2
    _splines: tuple[CubicSpline, CubicSpline] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import CubicSpline

        if len(self.x) < 2 or np.any(np.diff(self.x) <= 0.0):
            raise InputError(f"Joint {self.name!r}: x of the curve must grow from point to point.")
        splines = tuple(CubicSpline(self.x, c, bc_type="natural") for c in (self.y, self.z))
        object.__setattr__(self, "_splines", splines)

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        place = point(motion, self.body, self.at)
        x = along(AXES[0], place)
        curves = []
        for axis, spline in zip(AXES[1:], self._splines, strict=True):
            law = Law(*(float(spline(x.value[0], k)) for k in range(3)))
            curves.append(difference(along(axis, place), applied_to(x, law)))
        return stacked(curves)


@dataclass(frozen=True)
class PrescribedPoint:
    """A point of a body has a prescribed coordinate along a direction in space: one row.

    The coordinate [m] is measured from the origin; ``along`` need not have length one.
    """

    name: str
    body: str
    law: TimeLaw
    at: Vector = ORIGIN
    along: Vector = (0.0, 0.0, 1.0)
    n_lengths: ClassVar[int] = 1

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        return shifted(along(unit(self.along), point(motion, self.body, self.at)), self.law(time))


@dataclass(frozen=True)
class PrescribedAngle:
    """Body j is turned by a prescribed angle [rad] about an axis of body i: one row.

    At the angle zero ``normal_j`` points along ``normal_i``; both are across the axis. Whatever
    else keeps the axis in place is up to other joints.
    """

    name: str
    i: str
    j: str
    law: TimeLaw
    axis_i: Vector = (0.0, 1.0, 0.0)
    normal_i: Vector = (1.0, 0.0, 0.0)
    normal_j: Vector = (1.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 0

    def rows(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives."""
        angle, rate, acceleration = self.law(time)
        sine, cosine = np.sin(angle), np.cos(angle)
        forward = unit(self.normal_i)
        side = cross(unit(self.axis_i), forward)
        # The normal of the turned body: cos(angle) side - sin(angle) forward.
        by_side = Law(cosine, -sine * rate, -cosine * rate**2 - sine * acceleration)
        by_forward = Law(-sine, -cosine * rate, sine * rate**2 - cosine * acceleration)
        normal = total(
            scaled(direction(motion, self.i, side), by_side),
            scaled(direction(motion, self.i, forward), by_forward),
        )
        return dot(normal, direction(motion, self.j, unit(self.normal_j)))
