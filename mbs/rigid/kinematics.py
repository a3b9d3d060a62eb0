"""Points and directions on moving bodies with what their first and second time derivatives need.

Joints and forces are built from these by sums, products and chain rules, so that Jacobians and
acceleration terms follow from one definition each.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import Motion, Vector


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


def cross_matrix(vector: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) that makes ``vector`` x b of b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors (3,): what numpy's does, in a tenth of its time."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def number_of(motion: Motion, body: str) -> int:
    """Number of a body; raises InputError for a name that there is not."""
    if body not in motion.numbers:
        raise InputError(f"There is no body {body!r}; there are {', '.join(motion.numbers)}.")
    return motion.numbers[body]


def _on_body(motion: Motion, body: str, local: Vector, origin: bool) -> Quantity:
    i = number_of(motion, body)
    fixed = np.asarray(local, dtype=float)
    rotation, spin = motion.rotation[i], motion.spin[i]
    arm = rotation @ fixed
    turning = cross(spin, fixed)
    jacobian = np.zeros((3, 6 * motion.n_bodies + 6))
    jacobian[:, 6 * i + 3 : 6 * i + 6] = -rotation @ cross_matrix(fixed)
    value, rate = arm, rotation @ turning
    if origin:
        jacobian[:, 6 * i : 6 * i + 3] = np.eye(3)
        value, rate = arm + motion.position[i], rate + motion.velocity[i]
    drift = rotation @ cross(spin, turning)
    return Quantity(value, jacobian[:, :-6], rate, drift)


def point(motion: Motion, body: str, local: Vector) -> Quantity:
    """A point fixed on a body, given in its axes [m], in space."""
    return _on_body(motion, body, local, origin=True)


def direction(motion: Motion, body: str, local: Vector) -> Quantity:
    """A vector fixed on a body, given in its axes, in space."""
    return _on_body(motion, body, local, origin=False)


def difference(a: Quantity, b: Quantity) -> Quantity:
    """a - b."""
    return Quantity(*(x - y for x, y in zip(a, b, strict=True)))


def total(a: Quantity, b: Quantity) -> Quantity:
    """a + b."""
    return Quantity(*(x + y for x, y in zip(a, b, strict=True)))


def dot(a: Quantity, b: Quantity) -> Quantity:
    """The scalar product of two vectors."""
    return Quantity(
        np.array([a.value @ b.value]),
        (a.value @ b.jacobian + b.value @ a.jacobian)[None, :],
        np.array([a.value @ b.rate + b.value @ a.rate]),
        np.array([a.value @ b.drift + 2.0 * (a.rate @ b.rate) + b.value @ a.drift]),
    )


def along(fixed: Vector, a: Quantity) -> Quantity:
    """Component of a vector along a direction fixed in space."""
    n = np.asarray(fixed, dtype=float)[None, :]
    return Quantity(n @ a.value, n @ a.jacobian, n @ a.rate, n @ a.drift)


def scaled(a: Quantity, by: Law) -> Quantity:
    """c(t) a for a given number c with its time derivatives."""
    return Quantity(
        by.value * a.value,
        by.value * a.jacobian,
        by.value * a.rate + by.first * a.value,
        by.value * a.drift + 2.0 * by.first * a.rate + by.second * a.value,
    )


def shifted(a: Quantity, by: Law) -> Quantity:
    """a - c(t) of one number a, for a given number c with its time derivatives."""
    return Quantity(a.value - by.value, a.jacobian, a.rate - by.first, a.drift - by.second)


def applied_to(a: Quantity, f: Law) -> Quantity:
    """f(a) of one number a, given f and its derivatives there."""
    return Quantity(
        np.array([f.value]),
        f.first * a.jacobian,
        f.first * a.rate,
        f.first * a.drift + f.second * a.rate**2,
    )


def stacked(parts: list[Quantity]) -> Quantity:
    """All numbers of several quantities, one after the other."""
    return Quantity(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
