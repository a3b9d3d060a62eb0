"""Pantographs as a chain of lumped masses from the head down to the base, any number of them.

Source: EN 50318, annex (two masses); the benchmark of ten codes of 2015 (three masses).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from catenary.mbs.air import ON_FRAME, ON_HEAD, AirForces
from catenary.mbs.head.head_arrays import named
from catenary.mbs.head.laws import LawsInPlace, in_place
from catenary.mbs.head.newmark_head import Raising, SteppedHead, parts_of
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped_data import LumpedData, chain_matrix
from catenary.mbs.vehicle.base_motion import lifted
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
        super().__init__(head, n, stepping)
        self._lift_full = static_force
        self._air = air
        # The lift acts on the last mass, which is the head itself if there is no other.
        self._carrier = n - 1 if data.n_masses > 1 else int(np.flatnonzero(head.level)[-1])
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
        if data.laws:
            self._put_laws(self._in_place(data, pressing, nominal_height))
            self._step_by(self._sprung(self._arrays))
        else:
            self._step_by(native.LinearChain(self._arrays, self.linear_step()))

    @property
    def is_linear(self) -> bool:
        """Whether a step is linear in its state and in what drives it."""
        return not (self.is_regulated or self._laws.laws)

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

    def lift(self, time: float) -> float:
        """Net lift on the last mass at ``time`` [N]: a half cosine up to the static force."""
        return self._lift_full * self._part(time)

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the pantograph without contact to where its head is at this height [m]; see
        `SteppedHead`. A base that rises starts there."""
        self._started_at = head_height
        super().place(head_height, velocity)

    def _sprung(self, arrays: native.HeadArrays) -> native.Head:
        sprung = native.SprungMasses(self._masses, self._stiffness, self._damping, self._push)
        return native.LawfulChain(arrays, sprung, self._law_arrays, self._carrier)

    def _put_drive(self, time: float) -> None:
        force, now = self._drive(time), self._now
        if self._air is not None:
            on_head, on_frame, _ = self._air.now(time)
            force += on_frame
            now["head_air"] = on_head
        now["force"] = force
        if self.stepped.added_force:
            now["part"] = self._part(time)
        if self._laws.laws:
            now["base"], now["base_velocity"] = self._base_motion(time)
            now["roof"], now["roof_velocity"] = lifted(self._base, time)

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """Fill in the forces, and where the wire crosses; see `SteppedHead`."""
        rows = named(drives)
        if self._base is None:
            constant = self._base_stiffness * self._base_height
            rows["force"] = self._lift_full * parts_of(self._part, times) + constant
        else:
            rows["force"] = [self._drive(time) for time in times.tolist()]
        if self._tied and self._base is None:
            place, velocity = self._rise(times)
            rows["force"] += self._base_stiffness * place + self._base_damping * velocity
            if self._laws.laws:
                rows["base"], rows["base_velocity"] = place, velocity
        if self._air is not None:
            forces = self._air.at(times)
            rows["force"] += forces[:, ON_FRAME]
            rows["head_air"] = forces[:, ON_HEAD]
        if self._laws.laws and self._base is not None:
            motions = np.array([self._base_motion(time) for time in times.tolist()])
            rows["base"], rows["base_velocity"] = motions.T
            roofs = np.array([lifted(self._base, time) for time in times.tolist()])
            rows["roof"], rows["roof_velocity"] = roofs.T
        if self._control is not None:
            rows["part"] = parts_of(self._part, times)
        self._fill_lateral(times, drives)

    def base(self, time: float) -> float:
        """Lift of the base by the vehicle [m]."""
        return lifted(self._base, time)[0]

    def _in_place(self, data: LumpedData, static_force: float, nominal: float) -> LawsInPlace:
        """The laws of a chain whose head is at its nominal height under the static force."""
        head = int(np.flatnonzero(self._level[: self._n - data.n_masses + 1])[-1])
        numbers = [head, *range(self._n - data.n_masses + 1, self._n)]
        rest = [nominal + data.strips.compression(static_force)]
        for way in data.given_way(static_force):
            rest.append(rest[-1] + way)
        return in_place(data.laws, numbers, self._n, rest)

    def _rise(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height and velocity of a base that rises with the lift, above where it stands under all
        of it, at times (t,) [m], [m/s]."""
        way = self._started_at - self._base_height
        parts = parts_of(self._part, np.maximum(times, 0.0))
        if isinstance(self._part, Raising):
            return way * (1.0 - parts), -way * self._part.rates(times)
        before, after = (
            parts_of(self._part, np.maximum(times + shift, 0.0)) for shift in (-_MOMENT, _MOMENT)
        )
        return way * (1.0 - parts), way * (before - after) / (2.0 * _MOMENT)

    def _base_motion(self, time: float) -> tuple[float, float]:
        """Lift of the base by vehicle and raising, and its speed [m], [m/s]."""
        place, velocity = lifted(self._base, time)
        if self._tied:
            (rise,), (rate,) = self._rise(np.array([time]))
            place, velocity = place + float(rise), velocity + float(rate)
        return place, velocity

    def _drive(self, time: float) -> float:
        """Force on the last mass that its own motion has no part in, but the air's [N]."""
        force = self.lift(time) + self._base_stiffness * self._base_height
        if self._tied or self._base is not None:
            place, velocity = self._base_motion(time)
            force += self._base_stiffness * place + self._base_damping * velocity
        return force
