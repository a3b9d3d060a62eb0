"""Newmark's method for the line (paper eqs. 2.4-2.6), and the choice between all methods."""

from __future__ import annotations

from typing import Any

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import Newmark, PredictedLineState
from catenary.solver.integrators.slow_path import (
    CALLED,
    PARTS,
    SlowPath,
    slow_load,
    slow_method,
    warn_of_slow_path,
)
from catenary.solver.kernels import native
from catenary.solver.linear.pieces import WantedPieces
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Numerics


class NewmarkLine(LineIntegrator):
    """The line by Newmark's method: sigma = beta dt^2, tau = gamma dt. Collective to make."""

    def __init__(
        self,
        comm: Any,
        model: Model,
        ownership: Ownership,
        numerics: Numerics,
        wanted: WantedPieces | None = None,
    ) -> None:
        dt, beta, gamma = numerics.dt, numerics.beta, numerics.gamma
        super().__init__(comm, model, ownership, beta * dt**2, gamma * dt, wanted)
        self._steps = Newmark(
            dt,
            0.5 * dt**2 * (1.0 - 2.0 * beta),
            dt * (1.0 - gamma),
            self._alpha_share,
            self.position_factor,
            self.velocity_factor,
            self._beta_share,
        )

    def _ahead(self) -> PredictedLineState:
        operators, (shown, velocity, acceleration) = self.operators, self.motion.read[:3]
        if not self._proportional:
            velocity = operators.rate  # which products with C read
        ahead = operators.factor, velocity, acceleration, shown
        return PredictedLineState(*ahead, self._steps)

    def predict(self) -> None:
        """Turn displacement and velocity into their predictions of eq. (2.5)."""
        arrays = self.displacement, self.velocity, self.acceleration, self.operators.factor
        native.predict(*arrays, self._steps)


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    only_free: bool = True,
    wanted: WantedPieces | None = None,
) -> LineIntegrator:
    """The line with the method that the numerics ask for. Collective.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of the ranks.
    model : Model
        Discrete line.
    ownership : Ownership
        Which unknowns this rank owns.
    numerics : Numerics
        Time step and integrator of the run.
    only_free : bool, optional
        Whether all steps are free ones, not taken in parts.
    wanted : WantedPieces, optional
        Part of the line that steps need at a time, None if all of it.
    """
    if numerics.integrator == NEWMARK:
        line: LineIntegrator = NewmarkLine(comm, model, ownership, numerics, wanted)
    else:
        from catenary.solver.integrators.generalized_alpha import GeneralizedAlphaLine

        chosen = integration_of(numerics.integrator, numerics.spectral_radius)
        line = GeneralizedAlphaLine(comm, model, ownership, numerics.dt, chosen, wanted)
    if only_free:
        line.keep_ahead()
    reason = slow_method(numerics)
    if reason and numerics.scheme == "one_solve":
        line.slow_path = SlowPath(reason, PARTS)
    reason = slow_load(model)
    if reason and line.slow_path is None:
        line.slow_path = SlowPath(reason, CALLED)
    if line.slow_path is not None and comm.rank == 0:
        warn_of_slow_path(line.slow_path)
    return line
