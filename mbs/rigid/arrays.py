"""Rows of joints and pulls of forces as arrays, so that kernels evaluate all of them at once.

Nearly all joints are made of scalar products of a vector fixed on one body with a vector between
points of two others, or fixed on another; nearly all forces act along the line between two points.
Joints and forces that are not made like that are evaluated by their own methods, in their place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import SPACE, Motion, Vector
from catenary.mbs.rigid.kinematics import Law, Quantity, number_of, part_of, stacked
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
    """Interface of a joint to a system of bodies."""

    @property
    def name(self) -> str: ...

    @property
    def n_lengths(self) -> int: ...

    @property
    def n_rows(self) -> int | None:
        """Number of its rows; None if these are its products."""

    def products(self) -> list[Product]:
        """The scalar products that its rows are made of."""

    def rows(self, products: Quantity, time: float) -> Quantity:
        """Phi with its derivatives at ``time`` [s], made of its products."""


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
        self.ranges: dict[str, slice] = {}  # rows of each joint, by its name
        self._made: list[tuple[slice, Joint]] = []  # rows that are made of these products
        begin = 0
        for joint in joints:
            products = joint.products()
            if joint.n_rows is not None:
                self._made.append((slice(len(flat), len(flat) + len(products)), joint))
            flat += products
            end = begin + (len(products) if joint.n_rows is None else joint.n_rows)
            self.ranges[joint.name] = slice(begin, end)
            begin = end
        self._laws = [(k, row.law) for k, row in enumerate(flat) if row.law]
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
        if not self._made:
            return found
        parts, begin = [], 0
        for products, joint in self._made:
            parts.append(part_of(found, slice(begin, products.start)))
            parts.append(joint.rows(part_of(found, products), time))
            begin = products.stop
        return stacked([*parts, part_of(found, slice(begin, None))])


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


# Differences of length [m] and of its rate [m/s] for slopes of pulls that are given as functions.
LENGTH_STEP, RATE_STEP = 1e-7, 1e-6


class LineGeometry(NamedTuple):
    """Lengths (m,) of lines [m], their rates (m,) [m/s] and gradients (m, 6 n)."""

    length: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray


class LineForce(Protocol):
    """Interface of a force: the line along which it acts, if it does."""

    @property
    def name(self) -> str: ...

    def on_line(self) -> Line | None:
        """The line along which it acts; None for a force that acts otherwise."""


class FlatLines:
    """Forces that act along lines, evaluated together.

    ``names`` (m,) of them in their order. Raises InputError where a force names a body that there
    is not.
    """

    def __init__(self, forces: Sequence[LineForce], start: Motion) -> None:
        found = [(force.name, force.on_line()) for force in forces]
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
        """Geometry of the lines in a motion.

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
