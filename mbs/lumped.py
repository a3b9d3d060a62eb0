"""Pantographs as a chain of lumped masses from the head down to the base, any number of them.

Source: EN 50318, annex (two masses); the benchmark of ten codes of 2015 (three masses).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from catenary.mbs.interface import HeadState


@dataclass(frozen=True)
class LumpedData:
    """A chain of masses, head first.

    ``masses`` [kg], shape (n,); ``stiffnesses`` [N/m] and ``dampings`` [N s/m], shape (n,): entry
    i joins mass i to mass i + 1, the last entry joins the last mass to the base.
    """

    masses: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    dampings: tuple[float, ...]

    @property
    def n_masses(self) -> int:
        return len(self.masses)

    def chain(self, values: tuple[float, ...]) -> np.ndarray:
        """Matrix of springs (or dampers) ``values`` between neighbours, the last to ground, (n, n)."""
        matrix = np.diag(np.asarray(values, dtype=float))
        for i, value in enumerate(values[:-1]):
            matrix[i + 1, i + 1] += value
            matrix[i, i + 1] -= value
            matrix[i + 1, i] -= value
        return matrix


class LumpedPantograph:
    """A lumped-mass pantograph advanced by Newmark's method, implicit in its contact force.

    Coordinates are the masses' heights with the springs relaxed when all are equal. Weights are
    balanced by the lifting mechanism, whose net lift on the last mass is ``static_force`` at the
    nominal head height, raised smoothly from zero over ``raise_time``.

    Parameters
    ----------
    data : LumpedData
    static_force : force on the wire at rest [N]
    nominal_height : head height at which the contact force at rest is ``static_force`` [m]
    raise_time : time over which the lift grows from zero [s]
    dt, beta, gamma : Newmark step [s] and parameters, those of the line
    """

    def __init__(
        self,
        data: LumpedData,
        static_force: float,
        nominal_height: float,
        raise_time: float,
        dt: float,
        beta: float = 0.25,
        gamma: float = 0.5,
    ) -> None:
        self._lift_full = static_force
        self._raise_time = raise_time
        self._dt = dt
        mass = np.diag(np.asarray(data.masses, dtype=float))
        self._mass = mass
        self._stiffness = data.chain(data.stiffnesses)
        self._damping = data.chain(data.dampings)
        # The base spring carries nothing when the head is at its nominal height under the static
        # force, which compresses every spring between head and last mass.
        compression = sum(static_force / k for k in data.stiffnesses[:-1])
        self._base_stiffness = data.stiffnesses[-1]
        self._base_height = nominal_height + compression
        self._inverse = linalg.inv(
            mass + gamma * dt * self._damping + beta * dt**2 * self._stiffness
        )
        self._c_position = beta * dt**2
        self._c_velocity = gamma * dt
        self._c_predict = 0.5 * dt**2 * (1.0 - 2.0 * beta)
        self._c_predict_velocity = dt * (1.0 - gamma)
        # A unit contact force pushes the head down.
        self._response = np.ascontiguousarray(self._inverse[:, 0])
        self._compliance_height = float(self._c_position * self._response[0])
        self._compliance_velocity = float(self._c_velocity * self._response[0])
        n = data.n_masses
        self.position = np.zeros(n)
        self.velocity = np.zeros(n)
        self.acceleration = np.zeros(n)
        self._free_acceleration = np.zeros(n)
        self._free_position = np.zeros(n)
        self._free_velocity = np.zeros(n)

    def lift(self, time: float) -> float:
        """Net lift on the last mass at ``time`` [N]: a half cosine up to the static force."""
        if time >= self._raise_time:
            return self._lift_full
        return self._lift_full * 0.5 * (1.0 - float(np.cos(np.pi * time / self._raise_time)))

    def place(self, head_height: float) -> None:
        """Put all masses at rest at ``head_height`` [m], springs relaxed, no contact."""
        self.position[:] = head_height
        self.velocity[:] = 0.0
        self.acceleration[:] = 0.0

    def predict(self, time: float) -> HeadState:
        """Head at ``time`` [s] as an affine function of the contact force in the coming step."""
        a = self.acceleration
        self._free_position = self.position + self._dt * self.velocity + self._c_predict * a
        self._free_velocity = self.velocity + self._c_predict_velocity * a
        force = -(self._stiffness @ self._free_position) - self._damping @ self._free_velocity
        force[-1] += self.lift(time) + self._base_stiffness * self._base_height
        free = self._inverse @ force
        self._free_acceleration = free
        return HeadState(
            float(self._free_position[0] + self._c_position * free[0]),
            float(self._free_velocity[0] + self._c_velocity * free[0]),
            self._compliance_height,
            self._compliance_velocity,
        )

    def advance(self, contact_force: float) -> None:
        """Take the step predicted last with this contact force [N]."""
        a = self._free_acceleration - contact_force * self._response
        self.acceleration = a
        self.position = self._free_position + self._c_position * a
        self.velocity = self._free_velocity + self._c_velocity * a

    def state(self) -> np.ndarray:
        """Positions, velocities and accelerations, shape (3 n,)."""
        return np.concatenate([self.position, self.velocity, self.acceleration])

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self.position, self.velocity, self.acceleration = np.split(np.array(state), 3)

    def energy(self) -> float:
        """Kinetic energy, and elastic energy of all springs, the base spring included [J]."""
        stretch = self.position - self._base_height
        return float(
            0.5 * self.velocity @ self._mass @ self.velocity
            + 0.5 * stretch @ self._stiffness @ stretch
        )
