"""Constraints that remove the idle rotation of links between two balls.

Nothing drives such a spin and little resists it; a link whose mass lies above the line between its
balls tips over by itself, which no real link with its bolts does. Reduced mechanisms leave spins
out; this leaves them out of systems with all bodies.
"""

from __future__ import annotations

import numpy as np

from catenary.mbs.rigid.bodies import SPACE, Body, Motion
from catenary.mbs.rigid.joints import PrescribedAngle, Spherical
from catenary.mbs.rigid.system import System

_ACROSS, _ALONG = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
# A link closer than this to the direction across the track (a sine) is measured along it.
_CLOSE = 0.1


def without_spins(system: System, motion: Motion) -> System:
    """The system with a joint more for each body that only two balls hold.

    The joint keeps a vector of the body, across the line between its balls, perpendicular to the
    direction across the track (or along it, for a link across): one row each, which lets a
    mechanism move in its plane as before.

    Parameters
    ----------
    system : System
        Bodies with their joints and forces.
    motion : Motion
        Assembled motion, whose spins are kept.
    """
    holders = [
        holder for body in system.bodies if (holder := _holder(system, body, motion)) is not None
    ]
    return system.with_joints(*holders)


def _holder(system: System, body: Body, motion: Motion) -> PrescribedAngle | None:
    joints = [
        joint
        for joint in system.joints
        if body.name in (getattr(joint, key, None) for key in ("i", "j", "body"))
    ]
    if len(joints) != 2 or not all(isinstance(joint, Spherical) for joint in joints):
        return None
    ends = [
        np.asarray(joint.at_i if joint.i == body.name else joint.at_j, dtype=float)
        for joint in joints
        if isinstance(joint, Spherical)
    ]
    rotation = motion.rotation[motion.numbers[body.name]]
    line = rotation @ (ends[1] - ends[0])
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return None
    fixed = _ACROSS
    if np.linalg.norm(np.cross(line / length, fixed)) < _CLOSE:
        fixed = _ALONG
    side = np.cross(line, fixed)
    side /= np.linalg.norm(side)
    # The angle zero of `PrescribedAngle` about an axis a with a normal n has the row
    # (a x n) . vector = 0: here a x n is the fixed direction.
    normal = side
    axis = np.cross(normal, fixed)
    return PrescribedAngle(
        f"no spin of {body.name}",
        SPACE,
        body.name,
        0.0,
        axis_i=tuple(axis),
        normal_i=tuple(normal),
        normal_j=tuple(rotation.T @ side),
    )
