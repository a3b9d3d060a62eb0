"""Joints and forces of a system as arrays, so that kernels evaluate all of them at once.

Nearly all joints are made of scalar products of a vector fixed on one body with a vector between
points of two others, or fixed on another; nearly all forces act along the line between two points.
Joints and forces that are not made like that are evaluated by their own methods, in their place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import singledispatch
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import SPACE, Motion, Vector, rotation_matrix
from catenary.mbs.rigid.forces import Actuator, BumpStop, Force, SpringDamper
from catenary.mbs.rigid.joints import (
    AXES,
    ORIGIN,
    Constant,
    Fixed,
    Joint,
    PointOnLine,
    PrescribedAngle,
    PrescribedPoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
    TimeLaw,
    across,
    unit,
)
from catenary.mbs.rigid.kinematics import Quantity, cross, number_of
from catenary.solver.kernels import native


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


@singledispatch
def products_of(joint: object) -> list[Product] | None:
    """What rows a joint is made of, None for one that is not made of scalar products alone."""
    return None


def _same_point(i: str, at_i: Vector, j: str, at_j: Vector) -> list[Product]:
    return [Product(SPACE, axis, i, at_i, j, at_j) for axis in AXES]


def _across_gap(
    i: str, normals: Sequence[Vector], end: str, at_end: Vector, start: str, at_start: Vector
) -> list[Product]:
    return [Product(i, normal, end, at_end, start, at_start) for normal in normals]


def _across_axis(i: str, normals: Sequence[Vector], j: str, axis: Vector) -> list[Product]:
    return [Product(i, normal, j, axis) for normal in normals]


@products_of.register
def _(joint: Spherical) -> list[Product]:
    return _same_point(joint.i, joint.at_i, joint.j, joint.at_j)


@products_of.register
def _(joint: Revolute) -> list[Product]:
    return [
        *_same_point(joint.i, joint.at_i, joint.j, joint.at_j),
        *_across_axis(joint.i, across(joint.axis_i), joint.j, unit(joint.axis_j)),
    ]


@products_of.register
def _(joint: PointOnLine) -> list[Product]:
    normals = across(joint.axis_i)
    return _across_gap(joint.i, normals, joint.j, joint.at_j, joint.i, joint.at_i)


@products_of.register
def _(joint: Prismatic) -> list[Product]:
    i, j, normals = joint.i, joint.j, across(joint.axis_i)
    side = cross(unit(joint.axis_i), unit(joint.normal_i))
    return [
        *_across_gap(i, normals, j, joint.at_j, i, joint.at_i),
        *_across_axis(i, normals, j, unit(joint.axis_j)),
        Product(i, side, j, joint.normal_j),
    ]


@products_of.register
def _(joint: RevolutePrismatic) -> list[Product]:
    i, j = joint.i, joint.j
    return [
        *_across_gap(j, across(joint.slide_axis_j), i, joint.at_i, j, joint.at_j),
        *_across_axis(j, across(joint.turn_axis_j), i, unit(joint.turn_axis_i)),
    ]


@products_of.register
def _(joint: Fixed) -> list[Product]:
    axes_i = rotation_matrix(np.asarray(joint.parameters)).T
    return [
        *_same_point(joint.j, joint.at_j, joint.i, joint.at_i),
        *(Product(joint.i, axes_i[k], joint.j, AXES[k - 2]) for k in range(3)),
    ]


@products_of.register
def _(joint: PrescribedPoint) -> list[Product]:
    way = unit(joint.along)
    return [Product(SPACE, way, joint.body, joint.at, SPACE, ORIGIN, joint.law)]


@products_of.register
def _(joint: PrescribedAngle) -> list[Product] | None:
    if not isinstance(joint.law, Constant):
        return None
    angle, forward = joint.law.number, unit(joint.normal_i)
    side = cross(unit(joint.axis_i), forward)
    normal = np.cos(angle) * side - np.sin(angle) * forward
    return [Product(joint.i, normal, joint.j, unit(joint.normal_j))]


def body_products(motion: Motion, rows: np.ndarray) -> Quantity:
    """Scalar products of vectors of bodies, ``rows`` (m,) ``native.BODY_PRODUCT``."""
    m = rows.size
    value, rate, drift = np.empty((3, m))
    found = Quantity(value, np.empty((m, 6 * motion.n_bodies)), rate, drift)
    native.body_products(motion, rows, found)
    return found


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
        self._odd: list[tuple[int, Joint]] = []  # and before which flat row it stands
        self._laws: list[tuple[int, TimeLaw]] = []
        for joint in joints:
            rows = products_of(joint)
            if rows is None:
                self._odd.append((len(flat), joint))
                continue
            self._laws += [(len(flat) + k, row.law) for k, row in enumerate(rows) if row.law]
            flat += rows
        self._rows = np.zeros(len(flat), dtype=native.BODY_PRODUCT)
        self._rows["body"] = [number_of(start, row.body) for row in flat]
        self._rows["start"] = [number_of(start, row.start or SPACE) for row in flat]
        self._rows["end"] = [number_of(start, row.end) for row in flat]
        self._rows["between"] = [row.start is not None for row in flat]
        self._rows["normal"] = _vectors([row.normal for row in flat])
        self._rows["at_start"] = _vectors([row.at_start for row in flat])
        self._rows["at_end"] = _vectors([row.at_end for row in flat])

    def __call__(self, motion: Motion, time: float) -> Quantity:
        """Phi with its derivatives, m rows."""
        found = body_products(motion, self._rows)
        for row, law in self._laws:
            for part, number in zip((found.value, found.rate, found.drift), law(time), strict=True):
                part[row] -= number
        if not self._odd:
            return found
        return self._with_odd(found, motion, time)

    def _with_odd(self, found: Quantity, motion: Motion, time: float) -> Quantity:
        parts, begin = [], 0
        for end, joint in self._odd:
            parts += [Quantity(*(x[begin:end] for x in found)), joint.rows(motion, time)]
            begin = end
        parts.append(Quantity(*(x[begin:] for x in found)))
        return Quantity(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _vectors(rows: Sequence[Vector]) -> np.ndarray:
    return np.array([np.asarray(row, dtype=float) for row in rows]).reshape(-1, 3)


class Line(NamedTuple):
    """A line between a point of body i and a point of body j, and what pulls along it.

    ``pull`` gives the force [N] that pulls the points together, of length [m], its rate [m/s] and
    time [s]; ``stiffness`` [N/m], ``free_length`` [m] and ``damping`` [N s/m] are what it is made
    of if there is no such function, with the constant ``preload`` [N].
    """

    i: str
    at_i: Vector
    j: str
    at_j: Vector
    stiffness: float = 0.0
    free_length: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    pull: Callable[[float, float, float], float] | None = None


@singledispatch
def line_of(force: object) -> Line | None:
    """The line along which a force acts, None for one that acts otherwise."""
    return None


@line_of.register
def _(force: SpringDamper) -> Line:
    ends = force.i, force.at_i, force.j, force.at_j
    if callable(force.stiffness) or callable(force.damping):
        return Line(*ends, pull=lambda length, rate, time: force.pull_at(length, rate))
    return Line(*ends, force.stiffness, force.free_length, force.damping)


@line_of.register
def _(force: Actuator) -> Line:
    ends, push = (force.i, force.at_i, force.j, force.at_j), force.force
    if callable(push):
        return Line(*ends, pull=lambda length, rate, time: -push(time))
    return Line(*ends, preload=-push)


@line_of.register
def _(force: BumpStop) -> Line:
    ends = force.i, force.at_i, force.j, force.at_j
    return Line(*ends, pull=lambda length, rate, time: force.pull_at(length, rate))


# Differences of length [m] and of its rate [m/s] for slopes of pulls that are given as functions.
LENGTH_STEP, RATE_STEP = 1e-7, 1e-6


class LineGeometry(NamedTuple):
    """Lengths (m,) of lines [m], their rates (m,) [m/s] and gradients (m, 6 n)."""

    length: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray


class FlatLines:
    """Those of several forces that act along lines, evaluated together.

    ``names`` (m,) of them in their order. Raises InputError where a force names a body that there
    is not.
    """

    def __init__(self, forces: Sequence[Force], start: Motion) -> None:
        found = [(force.name, line_of(force)) for force in forces]
        lines = [line for _, line in found if line is not None]
        self.names = tuple(name for name, line in found if line is not None)
        self._rows = np.zeros(len(lines), dtype=native.BODY_LINE)
        self._rows["i"] = [number_of(start, line.i) for line in lines]
        self._rows["j"] = [number_of(start, line.j) for line in lines]
        self._rows["at_i"] = _vectors([line.at_i for line in lines])
        self._rows["at_j"] = _vectors([line.at_j for line in lines])
        constants = [(x.stiffness, x.free_length, x.damping, x.preload) for x in lines]
        columns = np.array(constants, dtype=float).reshape(-1, 4).T.copy()
        self._stiffness, self._free, self._damping, self._preload = columns
        self._pulls = [(k, line.pull) for k, line in enumerate(lines) if line.pull]

    def __len__(self) -> int:
        return len(self.names)

    def geometry(self, motion: Motion) -> LineGeometry:
        """How the lines are in a motion.

        Raises InputError where the two points of a line coincide.
        """
        m = self._rows.size
        length, rate = np.empty((2, m))
        found = LineGeometry(length, rate, np.empty((m, 6 * motion.n_bodies)))
        native.body_lines(motion, self._rows, found)
        if not length.all():
            name = self.names[int(np.argmin(length))]
            raise InputError(f"Force {name!r}: its two points coincide, it has no direction.")
        return found

    def pulls(self, length: np.ndarray, rate: np.ndarray, time: float) -> np.ndarray:
        """Pulls (m,) [N] at lengths and rates (m,)."""
        result = self._stiffness * (length - self._free) + self._damping * rate + self._preload
        for k, pull in self._pulls:
            result[k] = pull(float(length[k]), float(rate[k]), time)
        return result

    def slopes(
        self, length: np.ndarray, rate: np.ndarray, time: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the pulls to length [N/m] and to its rate [N s/m], shape (m,) each."""
        if not self._pulls:
            return self._stiffness, self._damping
        stiffness, damping = self._stiffness.copy(), self._damping.copy()
        for k, pull in self._pulls:
            far, fast = float(length[k]), float(rate[k])
            stiffness[k] = pull(far + LENGTH_STEP, fast, time) - pull(far - LENGTH_STEP, fast, time)
            damping[k] = pull(far, fast + RATE_STEP, time) - pull(far, fast - RATE_STEP, time)
            stiffness[k] /= 2.0 * LENGTH_STEP
            damping[k] /= 2.0 * RATE_STEP
        return stiffness, damping
