"""The line's equations of motion advanced by Newmark's method (paper eqs. 2.4-2.6)."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.integrators import state_kernels
from catenary.solver.integrators.line_integrator import LineMotion
from catenary.solver.integrators.line_state import MotionAhead, Steps
from catenary.solver.integrators.two_pass_step import StationPasses
from catenary.solver.linear.step_operators import Loads
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.problem import Numerics


class NewmarkLine(LineMotion):
    """The line by Newmark's method: sigma = beta dt^2, tau = gamma dt. Collective to make."""

    _passes: StationPasses | None = None

    def __init__(self, comm: Any, model: Model, ownership: Ownership, numerics: Numerics) -> None:
        dt, beta, gamma = numerics.dt, numerics.beta, numerics.gamma
        super().__init__(comm, model, ownership, beta * dt**2, gamma * dt)
        self._dt = dt
        self._predict_position = 0.5 * dt**2 * (1.0 - 2.0 * beta)
        self._predict_velocity = dt * (1.0 - gamma)

    def keep_ahead(self) -> None:
        """Keep the state one prediction ahead from now on, if the operators allow it.

        Of steps there are then only free ones without loads, in two passes over the state. Not
        collective.
        """
        if not self._proportional:
            return
        steps = Steps(
            self._dt,
            self._predict_position,
            self._predict_velocity,
            self._alpha_share,
            self.position_factor,
            self.velocity_factor,
            self._beta_share,
        )
        operators, (shown, velocity, acceleration, _) = self.operators, self.motion.read
        motion = MotionAhead(operators.factor, velocity, acceleration, shown, steps)
        if (parts := operators.by_stations()) is not None:
            product, factors, read, answer = parts
            self._passes = StationPasses(
                product, factors, read, read, np.zeros(0), answer, motion, steps
            )
            self._passes.look_at(*self._droppers)
            motion.put(self.displacement, self.velocity, self.acceleration)
            self.motion = motion

    @property
    def passes(self) -> StationPasses | None:
        """What takes free steps without loads, if they are taken in two passes."""
        return self._passes

    def predict(self) -> None:
        """Turn displacement and velocity into their predictions of eq. (2.5)."""
        state_kernels.predict(
            self.displacement,
            self.velocity,
            self.acceleration,
            self.operators.factor,
            self._dt,
            self._predict_position,
            self._predict_velocity,
            self._alpha_share,
        )

    def free_step(self, loads: Loads | None = None) -> None:
        """Take the step without contacts and slack droppers. Collective."""
        passes = self._passes
        if passes is None:
            super().free_step(loads)
            return
        assert loads is None
        if self._comm.size > 1:
            self.operators.exchange()
        passes.step()

    def look_at(self, ends: np.ndarray, laws: np.ndarray, tension: np.ndarray) -> None:
        """Fill ``tension`` at the end of each ``free_step``; see ``LineMotion``."""
        super().look_at(ends, laws, tension)
        if self._passes is not None:
            self._passes.look_at(ends, laws, tension)

    def energies(self) -> tuple[float, float]:
        """Kinetic and elastic energy relative to equilibrium, all droppers taut [J]. Collective."""
        factor = self.operators.factor
        ahead = factor.copy()
        found = super().energies()
        np.copyto(factor, ahead)
        return found
