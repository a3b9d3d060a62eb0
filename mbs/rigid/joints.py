"""Joints between bodies: constraints Phi(q, t) = 0 with Jacobian and right side of accelerations.

Each joint has a name and the scalar products that its rows are made of; these come as a `Quantity`:
Phi itself, Phi_q, d Phi/dt, and the drift, of which gamma in Phi_q dv/dt = gamma is the negative.
The first ``n_lengths`` rows are in metres, the others are cosines of angles that are right ones
when the joint is closed.

Nearly all joints are made of scalar products of a vector fixed on one body with a vector between
points of two others, or fixed on another. Their rows stand in arrays, so that kernels evaluate all
of them at once; rows of other joints follow from such products by methods of their own.

Source: P. E. Nikravesh, Computer-aided analysis of mechanical systems, 1988, chapter 7.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import (
    SPACE,
    Law,
    Motion,
    Quantity,
    Vector,
    body_products,
    number_of,
    part_of,
    rotation_matrix,
    stacked,
)
from catenary.solver.kernels import native

ORIGIN = (0.0, 0.0, 0.0)

# A prescribed number [m or rad] with its rates at a time [s].
TimeLaw = Callable[[float], Law]


class Product(NamedTuple):
    """n . w less a number given over time: n fixed on a body, w between bodies or on one.

    w goes from the point ``at_start`` of body ``start`` to the point ``at_end`` of body ``end``;
    without a start it is the vector ``at_end`` fixed on ``end``.
    """

    body: str
    normal: Vector
    end: str
    at_end: Vector
    start: str | None = None
    at_start: Vector = ORIGIN
    law: TimeLaw | None = None


class Joint(Protocol):
    """Interface of a joint to a system of bodies; its rows are its products, mostly."""

    @property
    def name(self) -> str: ...

    @property
    def n_lengths(self) -> int: ...

    def products(self) -> list[Product]:
        """The scalar products that its rows are made of."""


class MadeRows(ABC):
    """A joint whose ``n_rows`` rows follow from its products otherwise."""

    n_rows: ClassVar[int]

    @abstractmethod
    def rows(self, products: Quantity, time: float) -> Quantity:
        """Phi with its derivatives at ``time`` [s], made of its products."""


class FlatRows:
    """Rows of several joints, evaluated together.

    Parameters
    ----------
    joints : in the order of their rows
    start : any motion of the system, for the bodies' numbers

    Raises
    ------
    InputError
        A joint names a body that there is not.
    """

    def __init__(self, joints: Sequence[Joint], start: Motion) -> None:
        flat: list[Product] = []
        self.ranges: dict[str, slice] = {}  # rows of each joint, by its name
        self._made: list[tuple[slice, MadeRows]] = []  # rows that are made of these products
        begin = 0
        for joint in joints:
            products, end = joint.products(), begin
            if isinstance(joint, MadeRows):
                self._made.append((slice(len(flat), len(flat) + len(products)), joint))
                end += joint.n_rows
            else:
                end += len(products)
            flat += products
            self.ranges[joint.name] = slice(begin, end)
            begin = end
        self._laws = [(k, row.law) for k, row in enumerate(flat) if row.law]
        self._rows = np.zeros(len(flat), dtype=native.BODY_PRODUCT)
        self._rows["body"] = [number_of(start, row.body) for row in flat]
        self._rows["start"] = [number_of(start, row.start or SPACE) for row in flat]
        self._rows["end"] = [number_of(start, row.end) for row in flat]
        self._rows["between"] = [row.start is not None for row in flat]
        self._rows["normal"] = vectors([row.normal for row in flat])
        self._rows["at_start"] = vectors([row.at_start for row in flat])
        self._rows["at_end"] = vectors([row.at_end for row in flat])

    def __call__(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives, m rows."""
        found = body_products(motion, self._rows)
        for row, law in self._laws:
            for part, number in zip((found.value, found.rate, found.drift), law(time), strict=True):
                part[row] -= number
        if not self._made:
            return found
        parts, begin = [], 0
        for products, joint in self._made:
            parts.append(part_of(found, slice(begin, products.start)))
            parts.append(joint.rows(part_of(found, products), time))
            begin = products.stop
        return stacked([*parts, part_of(found, slice(begin, None))])


def vectors(rows: Sequence[Vector]) -> np.ndarray:
    """Vectors as an array (m, 3)."""
    return np.array([np.asarray(row, dtype=float) for row in rows]).reshape(-1, 3)


AXES = np.eye(3)


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


def steady(start: float, speed: float) -> TimeLaw:
    """A prescribed number that grows with a constant ``speed`` from ``start`` at time zero."""
    return lambda time: Law(start + speed * time, speed, 0.0)


def same_point(i: str, at_i: Vector, j: str, at_j: Vector) -> list[Product]:
    """Three rows: the point ``at_i`` of body ``i`` is at the point ``at_j`` of body ``j`` [m]."""
    return [Product(SPACE, axis, i, at_i, j, at_j) for axis in AXES]


def across_gap(
    i: str, normals: Sequence[Vector], end: str, at_end: Vector, start: str, at_start: Vector
) -> list[Product]:
    """A row for each of ``normals`` of body i, to which the way between two points must be
    perpendicular: from ``at_start`` of body ``start`` to ``at_end`` of body ``end`` [m]."""
    return [Product(i, normal, end, at_end, start, at_start) for normal in normals]


def across_axis(i: str, normals: Sequence[Vector], j: str, axis: Vector) -> list[Product]:
    """A row for each of ``normals`` of body i, to which an ``axis`` of body j must be
    perpendicular."""
    return [Product(i, normal, j, axis) for normal in normals]


@dataclass(frozen=True)
class _BetweenPoints:
    """A joint between a point ``at_i`` of body ``i`` and a point ``at_j`` of body ``j``."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN


@dataclass(frozen=True)
class Spherical(_BetweenPoints):
    """A point of body i is a point of body j: three rows."""

    n_lengths: ClassVar[int] = 3

    def products(self) -> list[Product]:
        return same_point(self.i, self.at_i, self.j, self.at_j)


@dataclass(frozen=True)
class Revolute(_BetweenPoints):
    """Bodies i and j turn about a common axis through a common point: five rows."""

    axis_i: Vector = (0.0, 1.0, 0.0)
    axis_j: Vector = (0.0, 1.0, 0.0)
    n_lengths: ClassVar[int] = 3

    def products(self) -> list[Product]:
        return [
            *same_point(self.i, self.at_i, self.j, self.at_j),
            *across_axis(self.i, across(self.axis_i), self.j, unit(self.axis_j)),
        ]


@dataclass(frozen=True)
class PointOnLine(_BetweenPoints):
    """A point of body j stays on a line fixed in body i: two rows."""

    axis_i: Vector = (1.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 2

    def products(self) -> list[Product]:
        return across_gap(self.i, across(self.axis_i), self.j, self.at_j, self.i, self.at_i)


@dataclass(frozen=True)
class Prismatic(_BetweenPoints):
    """Body j slides along an axis of body i without turning: five rows.

    ``normal_i`` and ``normal_j`` are across the axis and point the same way in both bodies.
    """

    axis_i: Vector = (1.0, 0.0, 0.0)
    axis_j: Vector = (1.0, 0.0, 0.0)
    normal_i: Vector = (0.0, 0.0, 1.0)
    normal_j: Vector = (0.0, 0.0, 1.0)
    n_lengths: ClassVar[int] = 2

    def products(self) -> list[Product]:
        normals = across(self.axis_i)
        side = np.cross(unit(self.axis_i), unit(self.normal_i))
        return [
            *across_gap(self.i, normals, self.j, self.at_j, self.i, self.at_i),
            *across_axis(self.i, normals, self.j, unit(self.axis_j)),
            Product(self.i, side, self.j, self.normal_j),
        ]


@dataclass(frozen=True)
class RevolutePrismatic(_BetweenPoints):
    """Body j slides along its own axis and turns about an axis of body i: four rows.

    A massless piece between both turns on body i about ``turn_axis_i`` and lets body j slide along
    ``slide_axis_j``; ``turn_axis_j`` is the axis of turning in axes of body j.
    """

    turn_axis_i: Vector = (1.0, 0.0, 0.0)
    turn_axis_j: Vector = (1.0, 0.0, 0.0)
    slide_axis_j: Vector = (0.0, 0.0, 1.0)
    n_lengths: ClassVar[int] = 2

    def products(self) -> list[Product]:
        slide, turn = across(self.slide_axis_j), across(self.turn_axis_j)
        return [
            *across_gap(self.j, slide, self.i, self.at_i, self.j, self.at_j),
            *across_axis(self.j, turn, self.i, unit(self.turn_axis_i)),
        ]


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

    def products(self) -> list[Product]:
        axes_i = rotation_matrix(np.asarray(self.parameters)).T
        return [
            *same_point(self.j, self.at_j, self.i, self.at_i),
            *(Product(self.i, axes_i[k], self.j, AXES[k - 2]) for k in range(3)),
        ]


@dataclass(frozen=True)
class PointOnCurve(MadeRows):
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
    n_rows: ClassVar[int] = 2
    _splines: tuple[CubicSpline, CubicSpline] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.x) < 2 or np.any(np.diff(self.x) <= 0.0):
            raise InputError(f"Joint {self.name!r}: x of the curve must grow from point to point.")
        splines = tuple(CubicSpline(self.x, c, bc_type="natural") for c in (self.y, self.z))
        object.__setattr__(self, "_splines", splines)

    def products(self) -> list[Product]:
        """Coordinates of the point."""
        return same_point(self.body, self.at, SPACE, ORIGIN)

    def rows(self, products: Quantity, time: float) -> Quantity:
        x, across = part_of(products, slice(0, 1)), part_of(products, slice(1, 3))
        curve, slope, bend = (
            np.array([spline(x.value[0], k) for spline in self._splines]) for k in range(3)
        )
        return Quantity(
            across.value - curve,
            across.jacobian - slope[:, None] * x.jacobian,
            across.rate - slope * x.rate,
            across.drift - (slope * x.drift + bend * x.rate**2),
        )


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

    def products(self) -> list[Product]:
        return [Product(SPACE, unit(self.along), self.body, self.at, SPACE, ORIGIN, self.law)]


@dataclass(frozen=True)
class PrescribedAngle:
    """Body j is turned by a prescribed ``angle`` [rad] about an axis of body i: one row.

    At the angle zero ``normal_j`` points along ``normal_i``; both are across the axis. Whatever
    else keeps the axis in place is up to other joints.
    """

    name: str
    i: str
    j: str
    angle: float
    axis_i: Vector = (0.0, 1.0, 0.0)
    normal_i: Vector = (1.0, 0.0, 0.0)
    normal_j: Vector = (1.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 0

    def products(self) -> list[Product]:
        """The turned normal across ``normal_i``."""
        forward = unit(self.normal_i)
        side = np.cross(unit(self.axis_i), forward)
        normal = np.cos(self.angle) * side - np.sin(self.angle) * forward
        return across_axis(self.i, [normal], self.j, unit(self.normal_j))
