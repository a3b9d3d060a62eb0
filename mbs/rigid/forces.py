"""Forces on bodies: springs and dampers with tables, actuators, gravity, bump stops, point forces.

Each force gives its generalised forces (6 n,): three forces [N] in space axes and three moments
[N m] in body axes a body.

Source: P. E. Nikravesh, Computer-aided analysis of mechanical systems, 1988, chapters 10 and 11.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from catenary.base.errors import InputError
from catenary.mbs.rigid.arrays import ORIGIN, Line, LineForce
from catenary.mbs.rigid.bodies import Motion, Vector
from catenary.mbs.rigid.kinematics import difference, point


class Force(LineForce, Protocol):
    """Interface of a force to a system of bodies."""

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        """Generalised forces at ``time`` [s], shape (6 n,) [N, N m]."""


class Table:
    """A characteristic from a table, straight between its points and beyond its ends.

    Parameters
    ----------
    x, y : arrays, shape (n,), n >= 2, x growing
    what : name of the table in messages
    """

    def __init__(self, x: Vector, y: Vector, what: str = "table") -> None:
        if len(x) != len(y) or len(x) < 2 or np.any(np.diff(x) <= 0.0):
            raise InputError(
                f"The {what} must have at least two points and as many values as growing "
                f"arguments; it has arguments {list(x)} and values {list(y)}."
            )
        self._points = tuple(zip(map(float, x), map(float, y), strict=True))
        self._line: BSpline = make_interp_spline(x, y, k=1)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self._points == other._points

    def __hash__(self) -> int:
        return hash(self._points)

    def __call__(self, x: float) -> float:
        return float(self._line(x))


# A characteristic: a constant slope, or a force as a function (a `Table`, for instance).
Characteristic = float | Callable[[float], float]


def _force_of(characteristic: Characteristic, x: float) -> float:
    return characteristic(x) if callable(characteristic) else characteristic * x


class _Line(NamedTuple):
    """The line between points of two bodies: its length [m], its rate [m/s], d length / d q."""

    length: float
    rate: float
    gradient: np.ndarray


@dataclass(frozen=True)
class _BetweenPoints(ABC):
    """Something that acts along the line between a point of body i and a point of body j."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN

    def line(self, motion: Motion) -> _Line:
        """Length, rate of length and gradient of length (6 n,)."""
        between = difference(point(motion, self.j, self.at_j), point(motion, self.i, self.at_i))
        length = float(np.linalg.norm(between.value))
        if length == 0.0:
            raise InputError(f"Force {self.name!r}: its two points coincide, it has no direction.")
        way = between.value / length
        return _Line(length, float(way @ between.rate), way @ between.jacobian)

    @abstractmethod
    def pull_at(self, length: float, rate: float, time: float) -> float:
        """Force [N] that pulls the points together, at a length [m], its rate [m/s] and a time."""

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        """Generalised forces (6 n,)."""
        line = self.line(motion)
        return -self.pull_at(line.length, line.rate, time) * line.gradient

    def _line(self, **what: Any) -> Line:
        return Line(self.i, self.at_i, self.j, self.at_j, **what)


@dataclass(frozen=True)
class SpringDamper(_BetweenPoints):
    """A spring and a damper side by side between two points.

    ``stiffness`` [N/m], or a function (a `Table`) of the extension [m] that gives the pull [N];
    ``free_length`` [m]; ``damping`` [N s/m], or a function of the rate of extension [m/s].
    """

    stiffness: Characteristic = 0.0
    free_length: float = 0.0
    damping: Characteristic = 0.0

    def pull_at(self, length: float, rate: float, time: float) -> float:
        """The pull [N] at a length [m] and its rate [m/s]."""
        elastic = _force_of(self.stiffness, length - self.free_length)
        return elastic + _force_of(self.damping, rate)

    def on_line(self) -> Line:
        """Constants, or the pull if one of them is a function."""
        if callable(self.stiffness) or callable(self.damping):
            return self._line(pull=self.pull_at)
        return self._line(
            stiffness=self.stiffness, free_length=self.free_length, damping=self.damping
        )


@dataclass(frozen=True)
class Actuator(_BetweenPoints):
    """Pushes two points apart with a given force.

    ``force`` [N], > 0 pushing apart: a number, or a function (a `Table`) of time [s].
    """

    force: float | Callable[[float], float] = 0.0

    def pull_at(self, length: float, rate: float, time: float) -> float:
        """Minus its push [N]."""
        return -(self.force(time) if callable(self.force) else self.force)

    def on_line(self) -> Line:
        """A constant, or the pull if the force is a function."""
        if callable(self.force):
            return self._line(pull=self.pull_at)
        return self._line(preload=-self.force)


@dataclass(frozen=True)
class BumpStop(_BetweenPoints):
    """Keeps the distance of two points between two limits, by a spring and a damper that push only.

    ``shortest``, ``longest`` [m]; ``stiffness`` [N/m], ``damping`` [N s/m] of each stop.
    """

    shortest: float = 0.0
    longest: float = np.inf
    stiffness: float = 0.0
    damping: float = 0.0

    def _depth(self, length: float) -> tuple[float, float]:
        """Depth beyond a limit [m], and the sign of the way back in length."""
        if length < self.shortest:
            return self.shortest - length, 1.0
        return max(length - self.longest, 0.0), -1.0

    def pull_at(self, length: float, rate: float, time: float) -> float:
        """The pull [N] at a length [m] and its rate [m/s]."""
        depth, way_back = self._depth(length)
        if depth == 0.0:
            return 0.0
        # A stop does not hold back what is leaving it.
        return -way_back * max(self.stiffness * depth - way_back * self.damping * rate, 0.0)

    def on_line(self) -> Line:
        """Its pull."""
        return self._line(pull=self.pull_at)


class OffLine:
    """A force that does not act along a line between two points."""

    def on_line(self) -> None:
        """None."""


@dataclass(frozen=True)
class PointForce(OffLine):
    """A force on a point of a body, its direction fixed in space.

    ``force`` (3,) [N], or a function of time [s] that gives it.
    """

    name: str
    body: str
    force: Vector | Callable[[float], Vector]
    at: Vector = ORIGIN

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        """Generalised forces (6 n,)."""
        force = self.force(time) if callable(self.force) else self.force
        return np.asarray(force, dtype=float) @ point(motion, self.body, self.at).jacobian


@dataclass(frozen=True)
class Gravity(OffLine):
    """Weight of all bodies, downward.

    ``masses`` (n,) [kg] in the order of the bodies; ``acceleration`` [m/s^2].
    """

    masses: Vector
    acceleration: float = 9.81
    name: str = "gravity"
    _forces: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        forces = np.zeros((len(self.masses), 6))
        forces[:, 2] = -self.acceleration * np.asarray(self.masses)
        object.__setattr__(self, "_forces", forces.ravel())

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        """Generalised forces (6 n,)."""
        return self._forces.copy()
