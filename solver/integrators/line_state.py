"""State of the line: displacement, velocity, acceleration, or the next step's prediction.

What kernels read at single unknowns are displacement and velocity at the end of the latest step,

    d = s0 x + s1 y + s2 z,    v = s3 y + s4 z,

with arrays x, y and z that a step carries on, and five shares.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from catenary.solver.kernels import native
from catenary.solver.kernels.native import Motion, StepFactors


class LineState:
    """State of a rank's part of a line, as it is. Not collective.

    Attributes
    ----------
    read : ``native.Motion``
    gains : (3,) what x, y and z gain from a unit of acceleration that is found later in the step

    Parameters
    ----------
    displacement, velocity, acceleration : arrays (n_local,) for x, y and z
    gains : [s2], [s], [-]
    shares, spacing : of ``native.Motion``
    """

    def __init__(
        self,
        displacement: np.ndarray,
        velocity: np.ndarray,
        acceleration: np.ndarray,
        gains: ArrayLike,
        shares: ArrayLike = (1.0, 0.0, 0.0, 1.0, 0.0),
        spacing: int = 1,
    ) -> None:
        self.read = Motion(displacement, velocity, acceleration, np.array(shares), spacing)
        self.gains = np.array(gains)

    @property
    def displacement(self) -> np.ndarray:
        """At the end of the latest step (n_local,) [m]; the array itself."""
        return self.read[0]

    @property
    def velocity(self) -> np.ndarray:
        """At the end of the latest step (n_local,) [m/s]; the array itself."""
        return self.read[1]

    @property
    def acceleration(self) -> np.ndarray:
        """At the end of the latest step (n_local,) [m/s2]; the array itself."""
        return self.read[2]

    def put(self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> None:
        """Take displacement [m], velocity [m/s] and acceleration [m/s2], (n_local,) each."""
        x, y, z = self.read[:3]
        x[:], y[:], z[:] = displacement, velocity, acceleration

    def carried(self) -> Mapping[str, np.ndarray]:
        """Arrays of a state that are kept in another form, by name; no copies."""
        return {}

    def take(self, state: Mapping[str, np.ndarray]) -> None:
        """Go on from displacement, velocity, acceleration and what else was carried, by name."""
        self.put(state["displacement"], state["velocity"], state["acceleration"])


class PredictedLineState(LineState):
    """State of the line kept one prediction ahead, for Newmark's method.

    Kept are what the coming step's product with K reads, x = -(d* + c v*) with the predictions d*
    and v* of eq. (2.5), then y = v*, and the acceleration z. A step that starts from d and v reads
    all three to predict and writes two of them; from here it starts by reading one.

    Attributes
    ----------
    known, predicted : further arrays that a step reads and writes, see `AlphaAhead`

    Parameters
    ----------
    ahead, velocity, acceleration : arrays (n_local,) for x, y and z
    shown : array (n_local,) that reading ``displacement`` fills
    steps : factors of the coming steps, all alike
    """

    known = predicted = np.zeros(0)

    def __init__(
        self,
        ahead: np.ndarray,
        velocity: np.ndarray,
        acceleration: np.ndarray,
        shown: np.ndarray,
        steps: StepFactors,
    ) -> None:
        of_position, of_velocity = steps.position_of_own, steps.velocity_of_own
        by_velocity = steps.velocity_factor + of_velocity
        by_position = steps.position_factor + steps.dt * steps.velocity_factor + of_position
        by_position += steps.work_velocity * by_velocity
        way = steps.dt + steps.work_velocity
        shares = -1.0, -way, steps.dt * of_velocity - of_position, 1.0, -of_velocity
        super().__init__(ahead, velocity, acceleration, (-by_position, by_velocity, 1.0), shares)
        self._steps, self._shown = steps, shown

    def changes(self, by_mass: float) -> native.Changes:
        """Coefficients from one prediction to the next; ``by_mass`` as there."""
        by_position, by_velocity, _ = map(float, self.gains)
        nothing = 0.0, 0.0
        newmark = self._steps.dt, by_position, by_velocity, self._steps.damping_share
        return native.Changes(*newmark, nothing, nothing, nothing, by_mass)

    @property
    def displacement(self) -> np.ndarray:
        """At the end of the latest step (n_local,) [m]; overwritten when asked for again."""
        native.displacements(self.read, 0, self._shown)
        return self._shown

    @property
    def velocity(self) -> np.ndarray:
        """At the end of the latest step (n_local,) [m/s]; a new array."""
        velocity = np.empty_like(self._shown)
        native.velocities(self.read, 0, velocity)
        return velocity

    def put(self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> None:
        x, y, z = self.read[:3]
        x[:], y[:], z[:] = self.ahead(displacement, velocity, acceleration)

    def ahead(
        self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x, y and z of displacement, velocity and acceleration, (n_local,) each."""
        steps = self._steps
        predicted = displacement + steps.dt * velocity + steps.position_of_own * acceleration
        y = velocity + steps.velocity_of_own * acceleration
        return -(predicted + steps.work_velocity * y), y, acceleration

    def carried(self) -> Mapping[str, np.ndarray]:
        return {"ahead": self.read[0], "velocity_ahead": self.read[1]}

    def take(self, state: Mapping[str, np.ndarray]) -> None:
        """Go on from displacement, velocity, acceleration, and exactly so if predictions for steps
        like these were carried, too."""
        super().take(state)
        for name, array in self.carried().items():
            array[:] = state.get(name, array)


class AlphaAhead(PredictedLineState):
    """State for the generalized-alpha method, whose steps need an acceleration p known before.

    Kept are x = -(d* + c v*) of the coming step, y = v, and z = k b + l p, the part of d* + c v* by
    accelerations: d = -(x + (dt + c) y + z).

    Parameters
    ----------
    ahead, velocity, balance : arrays (n_local,) for x, y and z
    known : array (n_local,) of p in the latest step
    shown : array (n_local,) that reading ``displacement`` fills
    predicted : array (n_local,) for v* of the coming step, which a product with C reads; empty
        without such a product. The step fills it at its beginning, from y, z and p
    steps : factors of the coming steps, all alike

    Attributes
    ----------
    balance : factors k and l [s2]; k must not be zero
    """

    def __init__(
        self,
        ahead: np.ndarray,
        velocity: np.ndarray,
        balance: np.ndarray,
        known: np.ndarray,
        shown: np.ndarray,
        predicted: np.ndarray,
        steps: StepFactors,
    ) -> None:
        # Effect of b and p before a step on p in it, and on displacement and velocity at its end.
        own = steps.known_of_own
        self._by_known = steps.known_of_balanced + own * steps.ratio, own
        shares = tuple(zip((steps.ratio, 1.0), self._by_known, strict=True))
        position = [steps.position_of_own * a + steps.position_of_known * p for a, p in shares]
        speed = [steps.velocity_of_own * a + steps.velocity_of_known * p for a, p in shares]
        work = steps.work_velocity
        self.balance = position[0] + work * speed[0], position[1] + work * speed[1]
        self._by_velocity, self._way = speed, steps.dt + work
        by_position = steps.position_factor + self._way * steps.velocity_factor + self.balance[0]
        gains = -by_position, steps.velocity_factor, self.balance[0]
        arrays = ahead, velocity, balance
        LineState.__init__(self, *arrays, gains, (-1.0, -self._way, -1.0, 1.0, 0.0))
        self._steps, self._shown, self.known, self.predicted = steps, shown, known, predicted

    def changes(self, by_mass: float) -> native.Changes:
        of_balanced, of_known = self.balance
        by_position, by_velocity, _ = map(float, self.gains)

        def from_kept(of_b: float, of_p: float) -> tuple[float, float]:
            """Shares of b and p as those of z and p."""
            return of_b / of_balanced, of_p - of_b * of_known / of_balanced

        return native.Changes(
            self._steps.dt,
            # z of the end of the step stands for its part of the coming prediction.
            by_position + of_balanced,
            by_velocity,
            self._steps.damping_share,
            known=from_kept(*self._by_known),
            velocity=from_kept(*self._by_velocity),
            balance=self.balance,
            by_mass=by_mass,
        )

    @property
    def acceleration(self) -> np.ndarray:
        """The one that balances the forces at the end of the latest step (n_local,) [m/s2]; a new
        array."""
        of_balanced, of_known = self.balance
        return np.asarray((self.read[2] - of_known * self.known) / of_balanced)

    def put(self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> None:
        """Take displacement, velocity and balanced acceleration, (n_local,) each.

        ``known`` must be set before.
        """
        x, y, z = self.read[:3]
        of_balanced, of_known = self.balance
        total = of_balanced * acceleration + of_known * self.known
        x[:] = -(displacement + self._way * velocity + total)
        y[:], z[:] = velocity, total

    def carried(self) -> Mapping[str, np.ndarray]:
        """Predictions and what accelerations do to them, by name: the arrays themselves."""
        return {"ahead": self.read[0], "balance_ahead": self.read[2]}
