"""A multibody system set up the other way round: half a turn about the vertical.

Bodies, joints and forces between them are the same; what is given in space (places, orientations,
points and axes of joints to the ground) turns with them. Forces whose direction is fixed in space,
such as the wind's, keep it: they meet a pantograph that runs knee first where they met one that
runs knee trailing.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from catenary.mbs.rigid.arrays import Joint
from catenary.mbs.rigid.bodies import SPACE, Body, Vector
from catenary.mbs.rigid.forces import BetweenPoints, Force
from catenary.mbs.rigid.joints import Fixed, PointOnCurve, PrescribedPoint
from catenary.mbs.rigid.system import System


def turned_round(system: System) -> System:
    """Return a system after half a turn about the z axis of space. Not collective."""
    return System(
        tuple(_body(body) for body in system.bodies),
        tuple(_joint(joint) for joint in system.joints),
        tuple(_force(force) for force in system.forces),
    )


def _across(vector: Vector) -> tuple[float, float, float]:
    """A vector of space after half a turn."""
    x, y, z = (float(value) for value in vector)
    return (-x, -y, z)


def _parameters(parameters: np.ndarray) -> tuple[float, ...]:
    """Euler parameters (4,) of an orientation in space after half a turn, e0 >= 0."""
    e0, e1, e2, e3 = (float(value) for value in parameters)
    after = (-e3, -e2, e1, e0)
    return tuple(-value for value in after) if after[0] < 0.0 else after


def _body(body: Body) -> Body:
    turn = _parameters(body.parameters)[1:]
    return replace(body, position=_across(body.position), turn=turn)


def _joint(joint: Joint) -> Joint:
    if isinstance(joint, PointOnCurve):
        # Curves are given for growing x.
        x, y = (tuple(-float(v) for v in reversed(values)) for values in (joint.x, joint.y))
        return replace(joint, x=x, y=y, z=tuple(reversed(tuple(joint.z))))
    if isinstance(joint, PrescribedPoint):
        return replace(joint, along=_across(joint.along))
    changes = _in_space(joint)
    if isinstance(joint, Fixed) and joint.i == SPACE:
        changes["parameters"] = _parameters(np.asarray(joint.parameters, dtype=float))
    return replace(joint, **changes)  # type: ignore[type-var]


def _force(force: Force) -> Force:
    return replace(force, **_in_space(force)) if isinstance(force, BetweenPoints) else force


def _in_space(what: Any) -> dict[str, Any]:
    """Points and axes of a joint or force that are those of space, after half a turn."""
    return {
        field.name: _across(getattr(what, field.name))
        for field in fields(what)
        for end in ("i", "j")
        if field.name.endswith(f"_{end}") and getattr(what, end) == SPACE
    }
