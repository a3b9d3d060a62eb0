"""The line's equations of motion advanced by Newmark's method (paper eqs. 2.4-2.6).

The step operator A = M + gamma dt C + beta dt^2 K is factored once. With proportional damping
the step's right-hand side needs a single product with K: M v is eliminated by A itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from catenary.solver import inner_kernels, kernels, repeated_rows
from catenary.solver.compliance import Windows
from catenary.solver.distribution import Ownership
from catenary.solver.line_operators import LineOperators, Loads
from catenary.solver.locality import reach
from catenary.solver.model import Model
from catenary.solver.problem import Numerics


class NewmarkLine:
    """State and step operator of the distributed line, relative to its equilibrium.

    Collective to make; ``destroy`` is collective too. The arrays are this rank's part, shape
    (n_local,), and stay the same objects for the whole run, so that views of them stay valid.

    Attributes
    ----------
    displacement, velocity, acceleration : [m], [m/s], [m/s2] (rad for rotations)
    position_factor, velocity_factor : beta dt^2 and gamma dt
    operators : LineOperators
    solution : the displacement as a PETSc vector
    """

    def __init__(self, comm: Any, model: Model, ownership: Ownership, numerics: Numerics) -> None:
        kernels.warm_up()
        inner_kernels.warm_up()
        repeated_rows.warm_up()
        dt, beta, gamma = numerics.dt, numerics.beta, numerics.gamma
        self._comm = comm
        self.ownership = ownership
        self.position_factor = beta * dt**2
        self.velocity_factor = gamma * dt
        self._dt = dt
        self._predict_position = 0.5 * dt**2 * (1.0 - 2.0 * beta)
        self._predict_velocity = dt * (1.0 - gamma)
        coefficients = (1.0, self.position_factor, self.velocity_factor)
        self.windows = Windows(_row_positions(model), model.block_size, reach(model, coefficients))
        self.operators = LineOperators(comm, model, ownership, coefficients, self.windows)
        self._proportional = model.damping_is_proportional
        # What is folded into the product with K, and what is left to do after the solve.
        self._alpha_share = self._beta_share = 0.0
        if self._proportional:
            alpha, beta_damping = (
                model.damping_of(model.blocks[0].component) if model.blocks else (0.0, 0.0)
            )
            stiffness_share = self.position_factor + self.velocity_factor * alpha
            self._beta_share = beta_damping / (1.0 + self.velocity_factor * beta_damping)
            self._alpha_share = alpha - self._beta_share * stiffness_share
        n = ownership.n_local
        self.displacement, self.velocity = np.zeros(n), np.zeros(n)
        self.acceleration = self.operators.answer
        # PETSc's time loop wants the solution as a vector; it wraps our array.
        self.solution = PETSc.Vec().createWithArray(self.displacement, size=(n, None), comm=comm)

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

    def free_acceleration(self, loads: Loads | None = None) -> None:
        """Fill the acceleration from the predictions and local loads (eq. 2.4). Collective.

        ``loads`` are pairs of local unknowns and forces [N], None on all ranks if there are none
        anywhere; contact and slack droppers are left out, so that ``correct`` must follow.
        """
        self.internal_forces()
        self.solve(loads)

    def internal_forces(self) -> None:
        """Right-hand side -C v - K d of eq. (2.4); only right after ``predict``. Collective."""
        operators = self.operators
        operators.exchange()
        operators.multiply_stiffness()
        if not self._proportional:
            np.negative(self.velocity, out=operators.factor)
            operators.exchange()
            operators.add_damping()

    def solve(self, loads: Loads | None = None) -> None:
        """Acceleration for the internal forces plus ``loads``, but for its part by damping on mass,
        which ``correct`` takes off. May be called again for other loads. Collective."""
        self.operators.solve(loads)

    def correct(self) -> None:
        """Turn predictions into the new displacement and velocity (eq. 2.6)."""
        kernels.correct(
            self.displacement,
            self.velocity,
            self.acceleration,
            self.position_factor,
            self.velocity_factor,
            self._beta_share,
        )

    def energies(self) -> tuple[float, float]:
        """Kinetic and elastic energy relative to equilibrium, all droppers taut [J]. Collective."""
        operators = self.operators
        np.copyto(operators.factor, self.velocity)
        kinetic = 0.5 * operators.square("mass")
        np.copyto(operators.factor, self.displacement)
        return kinetic, 0.5 * operators.square("stiffness")

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        self.operators.destroy()
        self.solution.destroy()


def _row_positions(model: Model) -> np.ndarray:
    positions = np.empty(model.mesh.n_nodes)
    positions[model.row_of_node] = model.mesh.points[:, 0]
    return positions
