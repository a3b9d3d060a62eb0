"""A running pantograph from the data of its model: the one place that knows all models."""

from __future__ import annotations

from typing import NamedTuple

from catenary.mbs.interface import Pantograph
from catenary.mbs.lumped import LumpedData, LumpedPantograph

# What a pantograph can be described by.
PantographData = LumpedData


class Operation(NamedTuple):
    """How a pantograph is operated, whatever its model.

    ``static_force`` [N] on a wire at rest at ``nominal_height`` [m] of the head, raised from zero
    over ``raise_time`` [s]; ``dt`` [s], ``beta`` and ``gamma`` of the line's Newmark step.
    """

    static_force: float
    nominal_height: float
    raise_time: float
    dt: float
    beta: float
    gamma: float


def make_pantograph(data: PantographData, operation: Operation) -> Pantograph:
    """The model that ``data`` describes. Not collective."""
    return LumpedPantograph(data, *operation)
