"""Pantographs as a chain of lumped masses from the head down to the base, any number of them.

Source: EN 50318, annex (two masses); the benchmark of ten codes of 2015 (three masses).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from catenary.mbs.air import AirForces
from catenary.mbs.head.pantograph import SteppedHead, head_of
from catenary.mbs.head.stepping import Raising, Stepping
from catenary.mbs.lumped_data import LumpedData, chain_matrix
from catenary.solver.kernels import native

# Half of the time over which the speed of a base that is lowered, too, is found [s]: a half cosine
# of 0.1 s is off by (pi 1e-5 / 0.1)^2 / 6, round-off by 1e-11, and its ends by more.
_MOMENT = 1e-5


class LumpedPantograph(SteppedHead):
    """A lumped-mass pantograph advanced by Newmark's method, implicit in its contact force.

    Coordinates are the masses' heights with the springs relaxed when all are equal, and angles of
    a head that turns; see `strips`. Weights are balanced by the lifting mechanism, whose net lift
    on the last mass is ``static_force`` at the nominal head height, raised smoothly from zero. Of
    a chain that its base spring holds at a height the base rises in the same way, from where the
    chain stands with its springs relaxed: pressed against a base that stands already, its masses
    would start with the force of that spring, and few chains damp what follows.

    Parameters
    ----------
    data : LumpedData
    static_force : force on the wire at rest [N]
    nominal_height : head height at which the contact force at rest is ``static_force`` [m]
    stepping : Stepping
    air : forces of the air on head and last mass; without it there are none
    steady_air : force of the air on the last mass where the nominal height holds [N]
    """

    def __init__(
        self,
        data: LumpedData,
        static_force: float,
        nominal_height: float,
        stepping: Stepping,
        air: AirForces | None = None,
        steady_air: float = 0.0,
    ) -> None:
        head = data.head(rolls=stepping.lateral is not None)
        n = head.n + data.n_masses - 1
        super().__init__(head, n, stepping, air is None or air.is_steady)
        self._air = air
        self._lift_full = static_force
        # The lift acts on the last mass, which is the head itself if there is no other.
        own = int(np.flatnonzero(head.level)[-1])
        self._carrier = n - 1 if data.n_masses > 1 else own
        self._masses = np.concatenate([head.masses, data.masses[1:]])
        springs = chain_matrix(head.stiffness, data.stiffnesses[1:])
        dampers = chain_matrix(head.damping, data.dampings[1:])
        self._stiffness = np.ascontiguousarray(springs[:n, :n])
        self._damping = np.ascontiguousarray(dampers[:n, :n])
        self._base_stiffness, self._base_damping = data.stiffnesses[-1], data.dampings[-1]
        # The base spring carries nothing when the head is at its nominal height under the static
        # force, which compresses springs and laws between head and last mass. So does what the air
        # lifts the last mass with.
        pressing = static_force + steady_air
        compression = sum(data.given_way(pressing))
        compression += data.strips.compression(pressing)
        self._base_height = nominal_height + compression
        # A base that rises with the lift starts from where the chain was placed.
        self._tied, self._started_at = data.tied, self._base_height
        if self._tied:
            self._settled += 2.0 * _MOMENT
        if data.laws:
            first = nominal_height + data.strips.compression(pressing)
            rest = np.cumsum([first, *data.given_way(pressing)])
            self._put_laws(data.laws, [own, *range(head.n, n)], rest)
            self._step_by(self._on_springs(self._arrays))
        else:
            self._step_by(head_of(self._arrays, linear=self.linear_step()))

    @property
    def is_linear(self) -> bool:
        """Whether a step is linear in its state and in what drives it."""
        return not (self.is_regulated or self._has_laws)

    def linear_step(self) -> native.LinearStep:
        """A step without laws: new state = step @ state + drive * by_drive - by_force @ force, with
        the state (positions, velocities, accelerations)."""
        n = self._n
        one, none = np.eye(n), np.zeros((n, n))
        newmark = self._newmark
        predict_position = np.hstack([one, newmark.dt * one, newmark.predict_position * one])
        predict_velocity = np.hstack([none, one, newmark.predict_velocity * one])
        inverse = np.ascontiguousarray(
            linalg.inv(
                np.diag(self._masses)
                + newmark.velocity * self._damping
                + newmark.position * self._stiffness
            )
        )
        free = -inverse @ (self._stiffness @ predict_position + self._damping @ predict_velocity)
        step = np.vstack(
            [
                predict_position + newmark.position * free,
                predict_velocity + newmark.velocity * free,
                free,
            ]
        )
        unit = np.vstack([newmark.position * inverse, newmark.velocity * inverse, inverse])
        by_drive = np.ascontiguousarray(unit[:, self._carrier])
        return native.LinearStep(step, by_drive, unit @ self._push, inverse)

    @property
    def tie(self) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] between the last mass and the base."""
        return self._base_stiffness, self._base_damping

    def _place(self, head_height: float, velocity: float) -> None:
        """A base that rises starts there."""
        self._started_at = head_height
        super()._place(head_height, velocity)

    def _put_inputs(self, times: np.ndarray, rows: np.ndarray, lifts: np.ndarray | None) -> None:
        part = self._part(times)
        rows["force"] = self._lift_full * part + self._base_stiffness * self._base_height
        if self._tied or lifts is not None:
            base = np.zeros((2, times.size)) if lifts is None else lifts[:2]
            base = base + self._rise(times) if self._tied else base
            rows["force"] += self._base_stiffness * base[0] + self._base_damping * base[1]
            if self._has_laws:
                rows["base"], rows["base_velocity"] = base
        if self._air is not None:
            on_head, on_frame, _ = self._air.at(times).T
            rows["force"] += on_frame
            rows["head_air"] = on_head
        if self.is_regulated:
            rows["part"] = part

    def _rise(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height and velocity of a base that rises with the lift, above where it stands under all
        of it, at times (t,) [m], [m/s]."""
        way = self._started_at - self._base_height
        parts = self._part(np.maximum(times, 0.0))
        if isinstance(self._part, Raising):
            return way * (1.0 - parts), -way * self._part.rates(times)
        before, after = (
            self._part(np.maximum(times + shift, 0.0)) for shift in (-_MOMENT, _MOMENT)
        )
        return way * (1.0 - parts), way * (before - after) / (2.0 * _MOMENT)
