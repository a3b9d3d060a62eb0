"""Rigid bodies in Cartesian coordinates, their orientations as Euler parameters, points on them.

Points and directions on moving bodies have with them what their first and second time derivatives
need. Sums and chain rules of them give Jacobians and acceleration terms from one definition each.

Source: P. E. Nikravesh, Computer-aided analysis of mechanical systems, 1988, chapters 6 and 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.kernels import native

# Name of the frame at rest, to which bodies can be joined as well.
SPACE = "space"

Vector = Sequence[float] | np.ndarray


def rotation_matrix(parameters: np.ndarray) -> np.ndarray:
    """Matrices from body to space axes of unit Euler parameters (..., 4), shape (..., 3, 3)."""
    rows = np.asarray(parameters, dtype=float)
    matrices = np.empty((*rows.shape[:-1], 3, 3))
    native.rotation_matrices(np.ascontiguousarray(rows.reshape(-1, 4)), matrices.reshape(-1, 3, 3))
    return matrices


def normalised(parameters: np.ndarray) -> np.ndarray:
    """Euler parameters (..., 4) scaled to p^T p = 1."""
    return parameters / np.linalg.norm(parameters, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Body:
    """A rigid body; its axes are principal axes of inertia through its centre of mass.

    ``mass`` [kg]; ``inertia`` about the body's axes, shape (3,) [kg m^2]; ``position`` of the
    centre of mass [m] and ``turn``, the Euler parameters e1, e2, e3, at the start (e0 >= 0
    follows from p^T p = 1).
    """

    name: str
    mass: float
    inertia: Vector
    position: Vector = (0.0, 0.0, 0.0)
    turn: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.name == SPACE:
            raise InputError(f"A body must not be named {SPACE!r}, the name of the frame at rest.")
        if self.mass <= 0.0 or len(self.inertia) != 3 or min(self.inertia) <= 0.0:
            raise InputError(
                f"Body {self.name!r}: mass {self.mass} and inertia {tuple(self.inertia)} "
                "must be positive, with three moments of inertia."
            )
        # Half a turn has e0 = 0, which round-off must not refuse.
        if np.dot(self.turn, self.turn) > 1.0 + 1e-12:
            raise InputError(
                f"Body {self.name!r}: turn {tuple(self.turn)} is longer than 1, "
                "so that there is no e0 to it."
            )

    @property
    def parameters(self) -> np.ndarray:
        """Euler parameters at the start, shape (4,)."""
        e0 = np.sqrt(max(0.0, 1.0 - np.dot(self.turn, self.turn)))
        return normalised(np.array([e0, *self.turn]))


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of n bodies; the last row of each array is the frame at rest.

    ``position`` (n + 1, 3) [m], ``parameters`` (n + 1, 4), ``velocity`` (n + 1, 3) [m/s] in space
    axes, ``spin`` (n + 1, 3) [rad/s], the angular velocities in body axes. Displacements and
    velocities of all bodies as one vector (6 n,) hold three translations, in space axes, and
    three rotations, in body axes, a body.
    """

    numbers: dict[str, int]
    position: np.ndarray
    parameters: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    rotation: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", rotation_matrix(self.parameters))

    @property
    def n_bodies(self) -> int:
        return len(self.position) - 1

    @property
    def velocities(self) -> np.ndarray:
        """Velocities and angular velocities, shape (6 n,)."""
        return np.hstack([self.velocity, self.spin])[:-1].ravel()

    def moved(self, displacement: np.ndarray) -> Motion:
        """Return this motion after a displacement (6 n,) [m, rad], with the same velocities."""
        position, parameters = self.position.copy(), self.parameters.copy()
        native.move_bodies(position, parameters, np.ascontiguousarray(displacement))
        return Motion(self.numbers, position, parameters, self.velocity, self.spin)

    def with_velocities(self, velocities: np.ndarray) -> Motion:
        """Return this place with other velocities (6 n,) [m/s, rad/s]."""
        return Motion(self.numbers, self.position, self.parameters, *_split(velocities))

    def to_vector(self) -> np.ndarray:
        """Positions and Euler parameters (7 n), then velocities (6 n): shape (13 n,)."""
        places = np.hstack([self.position, self.parameters])[:-1].ravel()
        return np.concatenate([places, self.velocities])

    def restored(self, state: np.ndarray) -> Motion:
        """The motion that ``to_vector`` gave as ``state``, to the last digit."""
        n = self.n_bodies
        places = state[: 7 * n].reshape(n, 7)
        position = np.vstack([places[:, :3], np.zeros(3)])
        parameters = np.vstack([places[:, 3:], [1.0, 0.0, 0.0, 0.0]])
        return Motion(self.numbers, position, parameters, *_split(state[7 * n :]))


def _split(velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and spins (n + 1, 3), the frame's included, of velocities (6 n,)."""
    parts = np.zeros((2, len(velocities) // 6 + 1, 3))
    parts[:, :-1] = velocities.reshape(-1, 2, 3).transpose(1, 0, 2)
    return parts[0], parts[1]


def initial_motion(bodies: Sequence[Body]) -> Motion:
    """All bodies at rest where their data put them."""
    n = len(bodies)
    numbers = {body.name: i for i, body in enumerate(bodies)} | {SPACE: n}
    if len(numbers) != n + 1:
        raise InputError(f"Bodies must have different names: {[body.name for body in bodies]}.")
    position = np.array([*(body.position for body in bodies), (0.0, 0.0, 0.0)], dtype=float)
    parameters = np.array([*(body.parameters for body in bodies), (1.0, 0.0, 0.0, 0.0)])
    return Motion(numbers, position, parameters, np.zeros((n + 1, 3)), np.zeros((n + 1, 3)))


class Quantity(NamedTuple):
    """Something that depends on the motion of bodies: k numbers x.

    ``value`` x (k,); ``jacobian`` (k, 6 n) with dx/dt = J v + what depends on time alone;
    ``rate`` dx/dt (k,); ``drift`` (k,), the part of d^2x/dt^2 without accelerations of bodies:
    d^2x/dt^2 = J dv/dt + drift.
    """

    value: np.ndarray
    jacobian: np.ndarray
    rate: np.ndarray
    drift: np.ndarray


class Law(NamedTuple):
    """A number with its first and second derivative."""

    value: float
    first: float
    second: float


def number_of(motion: Motion, body: str) -> int:
    """Number of a body; raises InputError for a name that there is not."""
    if body not in motion.numbers:
        raise InputError(f"There is no body {body!r}; there are {', '.join(motion.numbers)}.")
    return motion.numbers[body]


def body_products(motion: Motion, rows: np.ndarray) -> Quantity:
    """Scalar products of vectors of bodies, ``rows`` (m,) ``native.BODY_PRODUCT``."""
    m = rows.size
    value, rate, drift = np.empty((3, m))
    found = Quantity(value, np.empty((m, 6 * motion.n_bodies)), rate, drift)
    native.body_products(motion, rows, found)
    return found


def point(motion: Motion, body: str, local: Vector) -> Quantity:
    """A point of a ``body``, at ``local`` in its axes [m], in space."""
    rows = np.zeros(3, dtype=native.BODY_PRODUCT)
    rows["body"] = rows["start"] = motion.numbers[SPACE]
    rows["end"], rows["at_end"] = number_of(motion, body), local
    rows["normal"], rows["between"] = np.eye(3), True
    return body_products(motion, rows)


def stacked(parts: list[Quantity]) -> Quantity:
    """All numbers of several quantities, one after the other."""
    return Quantity(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def part_of(a: Quantity, numbers: slice) -> Quantity:
    """Some of the numbers of a quantity."""
    return Quantity(*(x[numbers] for x in a))
