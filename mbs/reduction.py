"""A mechanism that can only raise and lower, reduced to the height of one of its points.

With h the height, m(h) dh^2/dt^2 + 1/2 dm/dh (dh/dt)^2 = F(h) - c(h) dh/dt + p, where p is a force
that lifts the point: Lagrange's equation of the mechanism with everything but h eliminated. Tables
of m, F and c over h hold all of it, so that a step costs a few interpolations.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg
from scipy.interpolate import CubicSpline

from catenary.mbs.bodies import Vector
from catenary.mbs.joints import ORIGIN, PrescribedPoint, constant
from catenary.mbs.kinematics import point
from catenary.mbs.statics import equilibrium
from catenary.mbs.system import System
from catenary.solver.errors import InputError


@dataclass(frozen=True)
class ReducedMechanism:
    """Tables over the height of a point, joined by cubic splines.

    ``heights`` [m], growing; ``masses`` [kg], equivalent mass at the point; ``lifts`` [N], upward
    force on the point at rest; ``dampings`` [N s/m]; all of shape (n,), n >= 4.
    """

    heights: np.ndarray
    masses: np.ndarray
    lifts: np.ndarray
    dampings: np.ndarray
    _table: CubicSpline = field(init=False, repr=False, compare=False)
    _slopes: CubicSpline = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        columns = np.stack([self.masses, self.lifts, self.dampings], axis=1)
        object.__setattr__(self, "_table", CubicSpline(self.heights, columns))
        object.__setattr__(self, "_slopes", self._table.derivative())

    def at(self, height: float) -> tuple[np.ndarray, np.ndarray]:
        """Mass, lift and damping at a height [m], shape (3,), and their slopes, per metre.

        Raises
        ------
        InputError
            The height is not within the tables.
        """
        if not self.heights[0] <= height <= self.heights[-1]:
            raise InputError(
                f"The height {height:g} m is not within the {self.heights[0]:g} m to "
                f"{self.heights[-1]:g} m that the mechanism was reduced for."
            )
        return self._table(height), self._slopes(height)

    def acceleration(self, height: float, speed: float, push: float = 0.0) -> float:
        """Acceleration upward [m/s^2] at a height [m] and speed upward [m/s].

        ``push`` [N] is a further force on the point, upward. Raises InputError as ``at`` does.
        """
        (mass, lift, damping), (mass_slope, _, _) = self.at(height)
        force = lift - damping * speed - 0.5 * mass_slope * speed**2 + push
        return float(force / mass)


def reduce_mechanism(
    system: System, body: str, heights: Vector, at: Vector = ORIGIN
) -> ReducedMechanism:
    """Tables of a mechanism for heights of the point ``at`` of a body.

    Forces must not depend on time, and dampers be linear. What moves besides the raising (links
    that spin between two balls) is taken to stay at rest, as it does in a plane mechanism.

    Parameters
    ----------
    heights : shape (n,) [m], growing, n >= 4

    Raises
    ------
    InputError
        Heights do not grow, or the mechanism does not reach one of them.
    """
    table = np.asarray(heights, dtype=float)
    if len(table) < 4 or np.any(np.diff(table) <= 0.0):
        raise InputError(f"A mechanism is reduced for at least four growing heights, not {table}.")
    # Heights are visited from the one that is nearest to the start, each from its neighbour.
    start = system.assemble(system.start()).motion
    first = int(np.argmin(np.abs(table - point(start, body, at).value[2])))
    columns = np.empty((len(table), 3))
    for order in (range(first, len(table)), range(first, -1, -1)):
        motion = start
        for k in order:
            holder = PrescribedPoint("height", body, constant(float(table[k])), at)
            motion = equilibrium(system.with_joints(holder), motion).motion
            rows = holder.rows(motion, 0.0)
            jacobian = np.vstack([system.constraints(motion, 0.0).jacobian, rows.jacobian])
            # Of all velocities with unit speed of the point those of least kinetic energy.
            root = np.sqrt(system.inverse_mass)
            unit_speed = np.append(np.zeros(len(jacobian) - 1), 1.0)
            way = root * linalg.lstsq(jacobian * root, unit_speed, cond=1e-8)[0]
            lift = way @ system.generalised_forces(motion, 0.0)
            moving = motion.with_velocities(way)
            damping = lift - way @ system.generalised_forces(moving, 0.0)
            columns[k] = system.mass @ way**2, lift, damping
    return ReducedMechanism(table, *columns.T)
