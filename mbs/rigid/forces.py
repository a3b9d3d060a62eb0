"""Forces on bodies: springs and dampers with tables, actuators, gravity, bump stops, point forces.

Generalised forces (6 n,) are three forces [N] in space axes and three moments [N m] in body axes a
body. Kernels evaluate all forces between points at once.

Source: P. E. Nikravesh, Computer-aided analysis of mechanical systems, 1988, chapters 10 and 11.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import Motion, Vector, number_of, point
from catenary.mbs.rigid.joints import ORIGIN, vectors
from catenary.solver.kernels import native


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


# A constant slope, or a force as a function (a `Table`, for instance).
Characteristic = float | Callable[[float], float]


class Pull(NamedTuple):
    """Pull ``stiffness`` (length - ``free_length``) + ``damping`` d length / dt + ``preload`` of a
    line [N/m], [m], [N s/m], [N], and what a function ``of_length`` [m] says besides [N]."""

    stiffness: float = 0.0
    free_length: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    of_length: Callable[[float], float] | None = None


@dataclass(frozen=True)
class BetweenPoints(ABC):
    """A force along the line between a point of body i and a point of body j."""

    name: str
    i: str
    j: str
    at_i: Vector = ORIGIN
    at_j: Vector = ORIGIN

    @property
    @abstractmethod
    def pull(self) -> Pull:
        """With what it pulls them together."""


@dataclass(frozen=True)
class SpringDamper(BetweenPoints):
    """A spring and a damper side by side between two points.

    ``stiffness`` [N/m], or a function (a `Table`) of the extension [m] that gives the pull [N];
    ``free_length`` [m]; ``damping`` [N s/m].
    """

    stiffness: Characteristic = 0.0
    free_length: float = 0.0
    damping: float = 0.0

    @property
    def pull(self) -> Pull:
        law, free = self.stiffness, self.free_length
        if callable(law):
            return Pull(damping=self.damping, of_length=lambda length: law(length - free))
        return Pull(law, free, self.damping)


@dataclass(frozen=True)
class Actuator(BetweenPoints):
    """Pushes two points apart with a given ``force`` [N]."""

    force: float = 0.0

    @property
    def pull(self) -> Pull:
        return Pull(preload=-self.force)


@dataclass(frozen=True)
class BumpStop(BetweenPoints):
    """Keeps the distance of two points between two limits, by springs that push only.

    ``shortest``, ``longest`` [m]; ``stiffness`` [N/m] of each stop.
    """

    shortest: float = 0.0
    longest: float = np.inf
    stiffness: float = 0.0

    @property
    def pull(self) -> Pull:
        def of_length(length: float) -> float:
            beyond = max(length - self.longest, 0.0) - max(self.shortest - length, 0.0)
            return self.stiffness * beyond

        return Pull(of_length=of_length)


class OffLine(Protocol):
    """Interface of a force that does not act along a line between two points."""

    @property
    def name(self) -> str: ...

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        """Generalised forces at ``time`` [s], shape (6 n,) [N, N m]."""


Force = BetweenPoints | OffLine


@dataclass(frozen=True)
class PointForce:
    """A force on a point of a body, its direction fixed in space.

    ``force`` (3,) [N], or a function of time [s] that gives it.
    """

    name: str
    body: str
    force: Vector | Callable[[float], Vector]
    at: Vector = ORIGIN

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        force = self.force(time) if callable(self.force) else self.force
        return np.asarray(force, dtype=float) @ point(motion, self.body, self.at).jacobian


@dataclass(frozen=True)
class Gravity:
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
        return self._forces.copy()


# Differences of length for slopes of pulls that are given as functions [m].
LENGTH_STEP = 1e-7


class LineGeometry(NamedTuple):
    """Lengths (m,) of lines [m], their rates (m,) [m/s] and gradients (m, 6 n)."""

    length: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray


class FlatLines:
    """Forces between points, evaluated together by kernels.

    Attributes
    ----------
    names : (m,) of them in their order
    damping : (m,) of them [N s/m]

    Parameters
    ----------
    forces : of which those between points are taken
    start : any motion of the system, for the bodies' numbers

    Raises
    ------
    InputError
        A force names a body that there is not.
    """

    def __init__(self, forces: Sequence[Force], start: Motion) -> None:
        lines = [force for force in forces if isinstance(force, BetweenPoints)]
        self.names = tuple(force.name for force in lines)
        self._rows = np.zeros(len(lines), dtype=native.BODY_LINE)
        self._rows["i"] = [number_of(start, force.i) for force in lines]
        self._rows["j"] = [number_of(start, force.j) for force in lines]
        self._rows["at_i"] = vectors([force.at_i for force in lines])
        self._rows["at_j"] = vectors([force.at_j for force in lines])
        pulls = [force.pull for force in lines]
        constants = np.array([pull[:4] for pull in pulls], dtype=float).reshape(-1, 4)
        self._stiffness, self._free, self.damping, self._preload = constants.T.copy()
        self._pulls = [(k, pull.of_length) for k, pull in enumerate(pulls) if pull.of_length]

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

    def pulls(self, length: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Pulls (m,) [N] at lengths [m] and rates [m/s] (m,)."""
        result = self._stiffness * (length - self._free) + self.damping * rate + self._preload
        for k, pull in self._pulls:
            result[k] += pull(float(length[k]))
        return result

    def stiffness(self, length: np.ndarray) -> np.ndarray:
        """Slopes of the pulls (m,) at lengths (m,) [N/m]."""
        result = self._stiffness.copy()
        for k, pull in self._pulls:
            ahead, behind = (pull(float(length[k]) + step) for step in (LENGTH_STEP, -LENGTH_STEP))
            result[k] = (ahead - behind) / (2.0 * LENGTH_STEP)
        return result


def gradient_of(force: BetweenPoints, motion: Motion) -> np.ndarray:
    """Gradient (6 n,) of the length of a force's line."""
    found: np.ndarray = FlatLines([force], motion).geometry(motion).gradient[0]
    return found
