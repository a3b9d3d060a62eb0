"""The line's equations of motion advanced by Newmark's method (paper eqs. 2.4-2.6)."""

from __future__ import annotations

from typing import Any

from catenary.solver import kernels
from catenary.solver.distribution import Ownership
from catenary.solver.events import event
from catenary.solver.line_motion import LineMotion
from catenary.solver.line_operators import Loads
from catenary.solver.model import Model
from catenary.solver.problem import Numerics
from catenary.solver.station_passes import StationPasses, Steps


class NewmarkLine(LineMotion):
    """The line by Newmark's method: sigma = beta dt^2, tau = gamma dt. Collective to make."""

    def __init__(self, comm: Any, model: Model, ownership: Ownership, numerics: Numerics) -> None:
        dt, beta, gamma = numerics.dt, numerics.beta, numerics.gamma
        super().__init__(comm, model, ownership, beta * dt**2, gamma * dt)
        self._dt = dt
        self._predict_position = 0.5 * dt**2 * (1.0 - 2.0 * beta)
        self._predict_velocity = dt * (1.0 - gamma)
        self._passes: StationPasses | None = None
        if self._proportional:
            self._passes = self.operators.passes(self.displacement, self.velocity, self._steps())
        self._forth, self._back = event("LineForth"), event("LineBack")

    def predict(self) -> None:
        """Turn displacement and velocity into their predictions of eq. (2.5)."""
        kernels.predict(
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
        """Take the step without contacts and slack droppers: in two passes over the state, where
        its operators allow it and no ``loads`` act. Collective."""
        passes = self._passes
        if passes is None or loads is not None:
            super().free_step(loads)
            return
        self._forth.begin()
        passes.tell()
        if self._comm.size > 1:
            self.operators.exchange()
        passes.forth()
        self._forth.end()
        self._back.begin()
        passes.back(self._droppers)
        self._back.end()

    def _steps(self) -> Steps:
        return Steps(
            self._dt,
            self._predict_position,
            self._predict_velocity,
            self._alpha_share,
            self.position_factor,
            self.velocity_factor,
            self._beta_share,
        )
