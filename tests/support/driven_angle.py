"""A joint that turns a body by an angle over time, as the crank of an engine is turned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from catenary.mbs.rigid.bodies import Law, Quantity, Vector
from catenary.mbs.rigid.joints import MadeRows, Product, TimeLaw, across_axis, unit


@dataclass(frozen=True)
class DrivenAngle(MadeRows):
    """`PrescribedAngle` with a ``law`` of time for its angle [rad]."""

    name: str
    i: str
    j: str
    law: TimeLaw
    axis_i: Vector = (0.0, 1.0, 0.0)
    normal_i: Vector = (1.0, 0.0, 0.0)
    normal_j: Vector = (1.0, 0.0, 0.0)
    n_lengths: ClassVar[int] = 0
    n_rows: ClassVar[int] = 1

    def products(self) -> list[Product]:
        """Components of the turned normal across ``normal_i`` and along it."""
        forward = unit(self.normal_i)
        normals = [np.cross(unit(self.axis_i), forward), forward]
        return across_axis(self.i, normals, self.j, unit(self.normal_j))

    def rows(self, products: Quantity, time: float) -> Quantity:
        """Phi with its derivatives: cos(angle) of the first less sin(angle) of the second."""
        angle, rate, acceleration = self.law(time)
        sine, cosine = np.sin(angle), np.cos(angle)
        by_side = Law(cosine, -sine * rate, -cosine * rate**2 - sine * acceleration)
        by_forward = Law(-sine, -cosine * rate, sine * rate**2 - cosine * acceleration)
        parts = (
            scaled(Quantity(*(x[k : k + 1] for x in products)), by)
            for k, by in enumerate((by_side, by_forward))
        )
        return Quantity(*(x + y for x, y in zip(*parts, strict=True)))


def scaled(a: Quantity, by: Law) -> Quantity:
    """c(t) a for a given number c, ``by``, with its time derivatives."""
    return Quantity(
        by.value * a.value,
        by.value * a.jacobian,
        by.value * a.rate + by.first * a.value,
        by.value * a.drift + 2.0 * by.first * a.rate + by.second * a.value,
    )
