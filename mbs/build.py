"""A running pantograph from the data of its model: the only place with all models.

The machinery of multibody systems is imported for pantographs that are mechanisms.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from catenary.base.errors import InputError
from catenary.mbs.air import Airflow, AirForces, SteadyForces
from catenary.mbs.head.laws import Regulator, given_way
from catenary.mbs.head.pantograph import Pantograph, SteppedHead
from catenary.mbs.head.stepping import Lowering, Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph

if TYPE_CHECKING:
    from catenary.mbs.mechanism.multibody_pantograph import MultibodyData
    from catenary.mbs.mechanism.reduction import RaisingData

# Data that describe a pantograph.
PantographData: TypeAlias = "LumpedData | MultibodyData"


class Operation(NamedTuple):
    """Operation of a pantograph, whatever its model.

    Attributes
    ----------
    static_force : force on a wire at rest at the nominal height, fully raised [N]
    nominal_height : height of the head [m]
    stepping : Stepping
    air : the air that it meets; without it there is none
    lowering : how it is lowered on the way, None if it is not
    regulator : what regulates its lift, None if nothing does
    rolls : whether a head may roll that can
    """

    static_force: float
    nominal_height: float
    stepping: Stepping
    air: Airflow | None = None
    lowering: Lowering | None = None
    regulator: Regulator | None = None
    rolls: bool = True


def make_pantograph(data: PantographData, operation: Operation) -> Pantograph:
    """The model that ``data`` describes. Not collective.

    Raises
    ------
    InputError
        A pantograph with all its bodies in the loop has laws, or a regulated lift.
    """
    model = _model(data, operation)
    if isinstance(model, SteppedHead):
        model.regulate(operation.regulator)
    elif operation.regulator is not None or data.laws:
        raise InputError(
            "Laws and regulated lifts act on lumped pantographs and on mechanisms that are reduced "
            "to tables, not on one with all its bodies in the loop."
        )
    lowering, raise_time = operation.lowering, operation.stepping.raise_time
    if lowering is not None:
        model.follow(lowering.course(operation.static_force, raise_time))
        model.lower(lowering)
    return model


def _model(data: PantographData, operation: Operation) -> Pantograph:
    force, height, stepping = operation[:3]
    air, on_frame = None, 0.0
    if operation.air is not None and data.meets_air:
        air = AirForces(operation.air, data.uplift, stepping.raise_time)
        on_frame = steady_forces(data, operation.air.speed).on_frame
    if isinstance(data, LumpedData):
        data = data if operation.rolls else replace(data, roll=None)
        return LumpedPantograph(data, force, height, stepping, air, on_frame)
    pressing = force + on_frame
    if data.all_bodies is not None:
        # Its methods are imported for pantographs that are simulated with it.
        from catenary.mbs.mechanism.full_pantograph import FullPantograph

        way = data.all_bodies
        return FullPantograph(data, pressing, height, stepping, air, way.handling, way.substeps)
    from catenary.mbs.mechanism.reduction import RaisingPantograph

    raising = raising_data(data, pressing, height)
    if not operation.rolls:
        raising = replace(raising, head=raising.head._replace(roll=None))
    return RaisingPantograph(raising, stepping, air)


def steady_forces(data: PantographData, speed: float) -> SteadyForces:
    """Forces of still air on the open line at a train's speed [m/s]; those on a mechanism's bodies
    are at its working height. Not collective."""
    on_head = on_frame = 0.0
    if data.uplift is not None:
        on_head, on_frame = (float(force) for force in data.uplift.at(np.array(speed)))
    if not isinstance(data, LumpedData):
        from catenary.mbs.mechanism.multibody_pantograph import arm_lift, head_lift

        on_head, on_frame = on_head + head_lift(data), on_frame + arm_lift(data)
    return SteadyForces(on_head, on_frame)


def has_joints(data: PantographData) -> bool:
    """Whether joints of a running pantograph may open, because all its bodies are moved."""
    return not isinstance(data, LumpedData) and data.all_bodies is not None


def actuator_force(data: PantographData) -> float | None:
    """Constant force of a multibody pantograph's actuator at its static force [N], None if it has
    none that was calibrated."""
    if isinstance(data, LumpedData):
        return None
    from catenary.mbs.mechanism.multibody_pantograph import stand

    return stand(data).actuator_force


def touching_mass(data: PantographData) -> float:
    """Mass that one contact meets first [kg]: a strip on its suspension, or its share of the
    head."""
    if data.strips.suspension is not None:
        return data.strips.suspension.mass
    if isinstance(data, LumpedData):
        return data.masses[0] / data.strips.number
    from catenary.mbs.mechanism.multibody_pantograph import stand

    return stand(data).head.mass / data.strips.number


def raising_data(data: MultibodyData, pressing: float, nominal_height: float) -> RaisingData:
    """Head and mechanism of a multibody pantograph on a vehicle of the right height.

    Its arm is at the working height when the head, at ``nominal_height`` [m], is pressed down on
    the arm by ``pressing`` [N]: the static force, and what the air lifts the arm with.
    """
    from catenary.mbs.mechanism.multibody_pantograph import head_lift, reduced, stand
    from catenary.mbs.mechanism.reduction import RaisingData

    standing = stand(data)
    head = standing.head
    strips = data.strips
    if strips.number > 1:
        strips = replace(strips, pitch=head.pitch)
    pressed = given_way(pressing, head.stiffness, data.laws, 0) + strips.compression(pressing)
    arm = nominal_height + pressed - head.offset
    return RaisingData(
        frame=reduced(data),
        head=head,
        base_height=arm - standing.working_height,
        strips=strips,
        blown_head=head_lift(data),
        laws=data.laws,
        rest=(nominal_height + strips.compression(pressing), nominal_height + pressed),
    )
