"""Steps in which a pantograph runs, and what moves it in them besides its contact forces."""

from __future__ import annotations

from typing import NamedTuple

from catenary.mbs.head.wire_crossing import CrossingPath
from catenary.mbs.vehicle.base_motion import BaseMotion


class Stepping(NamedTuple):
    """Steps of a pantograph, whatever its model.

    Attributes
    ----------
    raise_time : time over which its lift grows from zero [s]
    dt : step of the line [s]
    beta, gamma : the line's parameters of Newmark's method
    lateral : where the wire crosses the strips; without it the head does not roll
    base : how the vehicle moves; without it the base stays
    """

    raise_time: float
    dt: float
    beta: float = 0.25
    gamma: float = 0.5
    lateral: CrossingPath | None = None
    base: BaseMotion | None = None
