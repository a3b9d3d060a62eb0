"""A running pantograph from the data of its model: the one place that knows all models."""

from __future__ import annotations

from typing import NamedTuple

from catenary.mbs import head_kernels
from catenary.mbs.base_motion import BaseMotion
from catenary.mbs.interface import Pantograph
from catenary.mbs.lateral import LateralPath
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.multibody import MultibodyData, head_weight_under_way, reduced, stand
from catenary.mbs.raising import RaisingData, RaisingPantograph

# What a pantograph can be described by.
PantographData = LumpedData | MultibodyData


class Operation(NamedTuple):
    """How a pantograph is operated, whatever its model.

    ``static_force`` [N] on a wire at rest at ``nominal_height`` [m] of the head, raised from zero
    over ``raise_time`` [s]; ``dt`` [s], ``beta`` and ``gamma`` of the line's Newmark step.
    ``lateral`` is where the wire crosses the strips, without which the head does not roll, and
    ``base`` how the vehicle moves, without which it does not.
    """

    static_force: float
    nominal_height: float
    raise_time: float
    dt: float
    beta: float
    gamma: float
    lateral: LateralPath | None = None
    base: BaseMotion | None = None


def make_pantograph(data: PantographData, operation: Operation) -> Pantograph:
    """The model that ``data`` describes. Not collective."""
    head_kernels.warm_up()
    if isinstance(data, MultibodyData):
        raising = raising_data(data, operation.static_force, operation.nominal_height)
        return RaisingPantograph(raising, *operation[2:])
    return LumpedPantograph(data, *operation)


def raising_data(data: MultibodyData, static_force: float, nominal_height: float) -> RaisingData:
    """Head and mechanism of a multibody pantograph on a vehicle of the right height.

    Its arm is at the working height when the head, at ``nominal_height`` [m], is pressed down by
    ``static_force`` [N].
    """
    standing = stand(data)
    head = standing.head
    arm = nominal_height + static_force / head.stiffness - head.offset
    return RaisingData(
        frame=reduced(data),
        head_mass=head.mass,
        head_stiffness=head.stiffness,
        head_damping=head.damping,
        head_weight=head_weight_under_way(data),
        head_offset=head.offset,
        base_height=arm - standing.working_height,
    )
