"""Rows of joints as arrays, so that kernels evaluate all of them at once.

Nearly all joints are made of scalar products of a vector fixed on one body with a vector between
points of two others, or fixed on another. Rows of other joints follow from such products by methods
of their own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from catenary.mbs.rigid.bodies import SPACE, Motion, Vector
from catenary.mbs.rigid.kinematics import Law, Quantity, body_products, number_of, part_of, stacked
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
