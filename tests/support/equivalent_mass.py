"""The mass that a point of a multibody system at rest feels like."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.mbs.rigid.arrays import ORIGIN
from catenary.mbs.rigid.bodies import Motion, Vector
from catenary.mbs.rigid.joints import unit
from catenary.mbs.rigid.kinematics import point
from catenary.mbs.rigid.least_squares import null_space
from catenary.mbs.rigid.system import System


def equivalent_mass(
    system: System,
    motion: Motion,
    body: str,
    at: Vector = ORIGIN,
    along: Vector = (0.0, 0.0, 1.0),
    time: float = 0.0,
) -> float:
    """Mass [kg] that a suddenly growing force on a point feels along a direction in space.

    Bodies behind springs that the joints do not move along stand still and do not count.
    """
    jacobian = system.constraints(motion, time).jacobian
    free = null_space(jacobian)
    # Velocities of the point per velocity of each free motion.
    way = unit(along) @ point(motion, body, at).jacobian @ free
    if np.abs(way).max(initial=0.0) < 1e-9:
        raise InputError(f"The joints do not let body {body!r} move along {tuple(along)}.")
    mass = free.T @ (system.mass[:, None] * free)
    return float(1.0 / (way @ linalg.solve(mass, way, assume_a="pos")))
