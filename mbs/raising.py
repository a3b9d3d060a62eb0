"""A pantograph of a head on springs over a reduced raising mechanism, with the line's fixed step.

    m_head y'' = -k (y - z) - c (y' - z') - f
    m(h) z'' + 1/2 dm/dh z'^2 = r(t) S(h) - c_frame(h) z' + k (y - z) + c (y' - z')

y is the head's height, z the height at which the arm below would carry it without contact,
h the arm's height above the base, S the static force at that height: the mechanism's lift less the
head's weight; r grows from 0 to 1 while the pantograph is raised. The head neither rolls nor is
carried along the track, and links between two balls do not spin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.mbs.interface import HeadState
from catenary.mbs.reduction import ReducedMechanism


@dataclass(frozen=True)
class RaisingData:
    """A head on a mechanism.

    ``frame``: mass, lift and damping over the arm's height above the base; ``head_mass`` [kg],
    ``head_stiffness`` [N/m] and ``head_damping`` [N s/m] between head and arm; ``head_weight`` [N];
    ``head_offset`` [m], height of the head above the arm at rest without contact; ``base_height``
    [m] of the base, in the line's heights.
    """

    frame: ReducedMechanism
    head_mass: float
    head_stiffness: float
    head_damping: float
    head_weight: float
    head_offset: float
    base_height: float = 0.0


class RaisingPantograph:
    """The two equations above, by Newmark's method, implicit in the contact force.

    The mechanism's tables are taken at the predicted height and its lift is linear from there: an
    error of order dt^2 in coefficients, so that a step stays affine in the contact force.

    Parameters
    ----------
    data : RaisingData
    raise_time : time over which the static force grows from zero [s]
    dt, beta, gamma : Newmark step [s] and parameters, those of the line
    """

    def __init__(
        self,
        data: RaisingData,
        raise_time: float,
        dt: float,
        beta: float = 0.25,
        gamma: float = 0.5,
    ) -> None:
        self._data = data
        self._raise_time = raise_time
        self._dt, self._beta, self._gamma = dt, beta, gamma
        self._position, self._velocity, self._acceleration = np.zeros((3, 2))
        self._free = np.zeros(6)
        self._by_force = np.zeros(6)
        self._head = HeadState(
            self._free[:1],
            self._free[2:3],
            self._by_force[:1].reshape(1, 1),
            self._by_force[2:3].reshape(1, 1),
        )
        self._between = np.array([[1.0, -1.0], [-1.0, 1.0]])

    @property
    def strip_offsets(self) -> tuple[float, ...]:
        """One strip, in the pantograph's own place."""
        return (0.0,)

    @property
    def position(self) -> np.ndarray:
        """Heights y and z, shape (2,) [m]."""
        return self._position

    def place(self, head_height: float) -> None:
        """Put the pantograph at rest with its head at this height [m], without contact."""
        self._position = np.full(2, float(head_height))
        self._velocity = np.zeros(2)
        force, masses, _, _ = self._forces(0.0, self._position, self._velocity)
        self._acceleration = force / masses

    def predict(self, time: float) -> HeadState:
        """Head at ``time`` [s] as an affine function of the contact force in the coming step."""
        dt, by_place, by_speed = self._dt, self._beta * self._dt**2, self._gamma * self._dt
        velocity = self._velocity + (dt - by_speed) * self._acceleration
        position = (
            self._position + dt * self._velocity + (dt**2 / 2 - by_place) * self._acceleration
        )
        force, masses, stiffness, damping = self._forces(time, position, velocity)
        matrix = np.diag(masses) + by_speed * damping + by_place * stiffness
        inverse = np.linalg.inv(matrix)
        free, unit = inverse @ force, inverse[:, 0]
        np.concatenate(
            [position + by_place * free, velocity + by_speed * free, free], out=self._free
        )
        np.concatenate([by_place * unit, by_speed * unit, unit], out=self._by_force)
        return self._head

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Height and velocity of the head by Newmark's predictor (paper eq. 2.5), (1,) each."""
        dt, beta, gamma = self._dt, self._beta, self._gamma
        acceleration = self._acceleration[:1]
        height = self._position[:1] + dt * self._velocity[:1] + dt**2 * (0.5 - beta) * acceleration
        return height, self._velocity[:1] + dt * (1 - gamma) * acceleration

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with this contact force (1,) [N]."""
        self.restore(self._free - contact_force[0] * self._by_force)

    def state(self) -> np.ndarray:
        """Positions, velocities and accelerations, shape (6,)."""
        return np.concatenate([self._position, self._velocity, self._acceleration])

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self._position, self._velocity, self._acceleration = np.array(state, float).reshape(3, 2)

    def energy(self) -> float:
        """Kinetic energy, and elastic energy of the head's springs beyond its weight's [J]."""
        masses = np.array([self._data.head_mass, self._frame_at(self._position[1])[0][0]])
        stretch = self._position[0] - self._position[1]
        return float(
            0.5 * masses @ self._velocity**2 + 0.5 * self._data.head_stiffness * stretch**2
        )

    def static_force(self, head_height: float) -> float:
        """Force on a wire that holds the head at this height at rest, fully raised [N].

        The head's springs give way under it.
        """
        data, force = self._data, 0.0
        for _ in range(50):
            previous = force
            (_, lift, _), _ = self._frame_at(head_height + force / data.head_stiffness)
            force = float(lift) - data.head_weight
            if abs(force - previous) <= 1e-10 * abs(force):
                break
        return force

    def _frame_at(self, z: float) -> tuple[np.ndarray, np.ndarray]:
        """Mass, lift, damping and their slopes for a height z [m]."""
        return self._data.frame.at(z - self._data.head_offset - self._data.base_height)

    def _forces(
        self, time: float, position: np.ndarray, velocity: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Forces (2,) without contact, masses (2,), stiffness and damping (2, 2) there."""
        data = self._data
        (mass, lift, frame_damping), (mass_slope, lift_slope, _) = self._frame_at(position[1])
        raised = 1.0
        if time < self._raise_time:
            raised = 0.5 * (1.0 - float(np.cos(np.pi * time / self._raise_time)))
        force = -self._between @ (data.head_stiffness * position + data.head_damping * velocity)
        speed = velocity[1]
        force[1] += raised * (lift - data.head_weight)
        force[1] -= frame_damping * speed + 0.5 * mass_slope * speed**2
        stiffness = data.head_stiffness * self._between
        damping = data.head_damping * self._between
        stiffness[1, 1] -= raised * lift_slope
        damping[1, 1] += frame_damping + mass_slope * speed
        return force, np.array([data.head_mass, mass]), stiffness, damping
