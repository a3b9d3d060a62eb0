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

    @property
    def strip_offsets(self) -> tuple[float, ...]:
        """One strip, in the pantograph's own place [m]."""
        return (0.0,)

    def chain(self, values: tuple[float, ...]) -> np.ndarray:
        """Matrix of springs (or dampers) between neighbours, the last to ground, shape (n, n)."""
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
        self.strip_offsets = data.strip_offsets
        self._lift_full = static_force
        self._raise_time = raise_time
        n = data.n_masses
        self._mass = np.diag(np.asarray(data.masses, dtype=float))
        self._stiffness = data.chain(data.stiffnesses)
        damping = data.chain(data.dampings)
        # The base spring carries nothing when the head is at its nominal height under the static
        # force, which compresses every spring between head and last mass.
        compression = sum(static_force / k for k in data.stiffnesses[:-1])
        self._base_height = nominal_height + compression
        self._base_force = data.stiffnesses[-1] * self._base_height
        # A step is linear: new state = step @ state + lift * by_lift + by_base - force * by_force,
        # with the state (positions, velocities, accelerations).
        one, none = np.eye(n), np.zeros((n, n))
        predict_position = np.hstack([one, dt * one, dt**2 * (0.5 - beta) * one])
        predict_velocity = np.hstack([none, one, dt * (1.0 - gamma) * one])
        inverse = linalg.inv(self._mass + gamma * dt * damping + beta * dt**2 * self._stiffness)
        free = -inverse @ (self._stiffness @ predict_position + damping @ predict_velocity)
        self._step = np.vstack(
            [
                predict_position + beta * dt**2 * free,
                predict_velocity + gamma * dt * free,
                free,
            ]
        )
        unit = np.vstack([beta * dt**2 * inverse, gamma * dt * inverse, inverse])
        self._by_force = unit[:, 0].copy()
        self._by_lift = unit[:, -1].copy()
        self._by_base = self._base_force * self._by_lift
        self._n = n
        self._state = np.zeros(3 * n)
        self._free = np.zeros(3 * n)
        # The head's share of the step, which shows what ``predict`` finds.
        self._head = HeadState(
            self._free[:1],
            self._free[n : n + 1],
            self._by_force[:1].reshape(1, 1),
            self._by_force[n : n + 1].reshape(1, 1),
        )
        self._extrapolation = np.vstack([predict_position[:1], predict_velocity[:1]])

    def lift(self, time: float) -> float:
        """Net lift on the last mass at ``time`` [N]: a half cosine up to the static force."""
        if time >= self._raise_time:
            return self._lift_full
        return self._lift_full * 0.5 * (1.0 - float(np.cos(np.pi * time / self._raise_time)))

    @property
    def position(self) -> np.ndarray:
        """Heights of the masses, head first, shape (n,) [m]."""
        return self._state[: self._n]

    @property
    def velocity(self) -> np.ndarray:
        """Velocities of the masses, upward, shape (n,) [m/s]."""
        return self._state[self._n : 2 * self._n]

    def place(self, head_height: float) -> None:
        """Put all masses at rest at ``head_height`` [m], springs relaxed, no contact."""
        n = self._n
        self._state[:n] = head_height
        self._state[n : 2 * n] = 0.0
        force = -self._stiffness @ self.position
        force[-1] += self.lift(0.0) + self._base_force
        # A start from any other acceleration than what these forces cause loses an order in dt.
        self._state[2 * n :] = linalg.solve(self._mass, force)

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Height and velocity of the head by Newmark's predictor (paper eq. 2.5), (1,) each."""
        height, velocity = self._extrapolation @ self._state
        return np.array([height]), np.array([velocity])

    def predict(self, time: float) -> HeadState:
        """Head at ``time`` [s] as an affine function of the contact force in the coming step."""
        np.matmul(self._step, self._state, out=self._free)
        self._free += self.lift(time) * self._by_lift + self._by_base
        return self._head

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with this contact force (1,) [N]."""
        np.multiply(self._by_force, -contact_force[0], out=self._state)
        self._state += self._free

    def state(self) -> np.ndarray:
        """Positions, velocities and accelerations, shape (3 n,)."""
        return self._state.copy()

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self._state = np.array(state, dtype=float)

    def energy(self) -> float:
        """Kinetic energy, and elastic energy of all springs, the base spring included [J]."""
        stretch = self.position - self._base_height
        return float(
            0.5 * self.velocity @ self._mass @ self.velocity
            + 0.5 * stretch @ self._stiffness @ stretch
        )
