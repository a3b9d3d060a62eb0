"""Points and directions on moving bodies with what their first and second time derivatives need.

Sums and chain rules of them give Jacobians and acceleration terms from one definition each.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.rigid.bodies import SPACE, Motion, Vector
from catenary.solver.kernels import native


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
