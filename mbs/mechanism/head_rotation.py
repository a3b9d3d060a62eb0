"""Roll and pitch of a head on its arm: inertia, stiffness and damping.

All follow from the bodies, joints and forces themselves: the head turns as its joints allow, around
where it rests, with the arm held.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from catenary.mbs.head.strips import Turning
from catenary.mbs.mechanism.pantograph_data import MultibodyData, stand
from catenary.mbs.rigid.forces import Characteristic, SpringDamper
from catenary.mbs.rigid.least_squares import least_squares

# About the track and across it.
ROLL, PITCH = 0, 1
# Part of a unit turn that joints may miss where they allow it.
_MISSED = 1e-6
# Travel [m] and speed [m/s] over which characteristics are measured.
_TRAVEL, _SPEED = 1e-3, 1e-3


@lru_cache(maxsize=64)
def head_turning(data: MultibodyData, about: int) -> Turning | None:
    """The head's roll or pitch, None if its joints do not allow it. Not collective.

    Of all motions of the head with a unit turn that with the least kinetic energy is taken.
    Springs are linear; what weight and tension in them do to the turn is left out.
    """
    standing = stand(data)
    system, motion = standing.system, standing.motion
    own = slice(6 * motion.numbers[data.head], 6 * motion.numbers[data.head] + 6)
    turn = np.zeros((1, 6))
    # Turns are counted in the head's axes.
    turn[0, 3:] = motion.rotation[motion.numbers[data.head]][about]
    jacobian = np.vstack([system.constraints(motion, 0.0).jacobian[:, own], turn])
    root = np.sqrt(system.inverse_mass[own])
    wanted = np.append(np.zeros(len(jacobian) - 1), 1.0)
    way = root * least_squares(jacobian * root, wanted, 1e-8)
    if np.abs(jacobian @ way - wanted).max() > _MISSED:
        return None
    stiffness = damping = 0.0
    for force in system.forces:
        if isinstance(force, SpringDamper) and data.head in (force.i, force.j):
            stretch = float(force.line(motion).gradient[own] @ way)
            stiffness += _slope(force.stiffness, _TRAVEL) * stretch**2
            damping += _slope(force.damping, _SPEED) * stretch**2
    return Turning(float(system.mass[own] @ way**2), stiffness, damping)


def _slope(characteristic: Characteristic, step: float) -> float:
    """Slope of a spring's or damper's characteristic around zero."""
    if not callable(characteristic):
        return characteristic
    return (characteristic(step) - characteristic(-step)) / (2.0 * step)
