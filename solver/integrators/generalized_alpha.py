"""The line advanced by the generalized-alpha method, of which HHT is a member.

The method balances forces between two states,
M a(1 - a_m) + C v(1 - a_f) + K d(1 - a_f) = f(1 - a_f). Let b be the acceleration that balances
the forces at the end of each step itself, M b = f - C v - K d. As the equations are linear in
M, C, K and f, the method is the same as

    (1 - a_m) a_new + a_m a_old = (1 - a_f) b_new + a_f b_old                            (*)

with Newmark's formulas in a. So a step has the form of Newmark's with b in place of a: no force of
an earlier step is needed, contacts and droppers meet the state at the end of the step, and one
product with K is enough. Source of (*): M. Arnold, O. Brüls, Multibody Syst. Dyn. 18 (2007)
185-202.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import AlphaAhead
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.pieces import WantedPieces
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.integrator_parameters import Integration

# Share of dt^2 below which the acceleration cannot be found from what a prediction takes from it.
_LEAST_SHARE = 1e-3


class GeneralizedAlphaLine(LineIntegrator):
    """The line by the generalized-alpha method. Collective to make.

    With r = (1 - a_f) / (1 - a_m) the algorithm's acceleration is a = p + r b, p being known when a
    step begins: sigma = r beta dt^2, tau = r gamma dt. The attribute ``acceleration`` is b.
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        ownership: Ownership,
        dt: float,
        integration: Integration,
        wanted: WantedPieces | None = None,
    ) -> None:
        beta, gamma, mass_weight, force_weight = integration
        ratio = (1.0 - force_weight) / (1.0 - mass_weight)
        factors = ratio * beta * dt**2, ratio * gamma * dt
        super().__init__(comm, model, ownership, *factors, wanted)
        self._known = aligned_arrays.zeros(ownership.n_local, 4)
        self._by = native.Alpha(
            dt=dt,
            ratio=ratio,
            known_of_balanced=force_weight / (1.0 - mass_weight),
            known_of_own=-mass_weight / (1.0 - mass_weight),
            position_of_own=dt**2 * (0.5 - beta),
            position_of_known=dt**2 * beta,
            velocity_of_own=dt * (1.0 - gamma),
            velocity_of_known=dt * gamma,
            damping_on_stiffness=self._alpha_share,
        )

    def _ahead(self) -> AlphaAhead | None:
        operators, (shown, rate, _) = self.operators, self.motion.read[:3]
        total = aligned_arrays.zeros(shown.size, 5)
        # Input of products with C, if there are any.
        predicted = rate[:0] if self._proportional else operators.rate
        arrays = operators.factor, rate, total, self._known, shown, predicted
        factors = self.position_factor, self.velocity_factor
        motion = AlphaAhead(*arrays, self._by, factors, self._beta_share)
        return None if abs(motion.balance[0]) < _LEAST_SHARE * self._by.dt**2 else motion

    def predict(self) -> None:
        """Turn displacement and velocity into what they are at the end of the step if b is zero."""
        self._predict()

    @cached_property
    def _predict(self) -> Callable[[], None]:
        return native.predict_alpha.bound(
            self.displacement,
            self.velocity,
            self.acceleration,
            self._known,
            self.operators.factor,
            self._by,
        )

    def start(
        self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
    ) -> None:
        """Start from displacement [m], [rad] and velocity [m/s], [rad/s], (n_local,) each.

        ``acceleration`` (n_local,) balances the forces of this state; the algorithm's own
        acceleration starts with the same values.
        """
        self._known[:] = (1.0 - self._by.ratio) * acceleration
        super().start(displacement, velocity, acceleration)

    def _parts_of_state(self) -> Mapping[str, Callable[[], np.ndarray]]:
        return {**super()._parts_of_state(), "known_acceleration": partial(np.asarray, self._known)}

    def kept(self) -> tuple[np.ndarray, ...]:
        return *super().kept(), self._known

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        self._known[:] = state["known_acceleration"]
        super().restore(state)
