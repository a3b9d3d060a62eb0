"""The line's equations of motion advanced by Newmark's method (paper eqs. 2.4-2.6).

The step operator A = M + gamma dt C + beta dt^2 K is factored once. With proportional damping
the step's right-hand side needs a single product with K: M v is eliminated by A itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from catenary.solver import inner_kernels, kernels
from catenary.solver.compliance import Windows
from catenary.solver.distribution import Ownership
from catenary.solver.errors import RunBroken
from catenary.solver.linear import StepSolver
from catenary.solver.locality import reach
from catenary.solver.model import Model
from catenary.solver.operators import assemble, station_block
from catenary.solver.problem import Numerics


class NewmarkLine:
    """State and step operator of the distributed line, relative to its equilibrium.

    Collective to make; ``destroy`` is collective too. The arrays are this rank's part, shape
    (n_local,), and stay the same objects for the whole run, so that views of them stay valid.

    Attributes
    ----------
    displacement, velocity, acceleration : [m], [m/s], [m/s2] (rad for rotations)
    position_factor, velocity_factor : beta dt^2 and gamma dt
    """

    def __init__(self, comm: Any, model: Model, ownership: Ownership, numerics: Numerics) -> None:
        kernels.warm_up()
        inner_kernels.warm_up()
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
        operators = {
            "step": assemble(
                comm,
                model,
                ownership,
                mass=1.0,
                stiffness=self.position_factor,
                damping=self.velocity_factor,
                held_diagonal=1.0,
                block_size=station_block(model, ownership),
            ),
            "stiffness": assemble(comm, model, ownership, stiffness=1.0),
        }
        self._proportional = model.damping_is_proportional
        # What is folded into the product with K, and what is left to do after the solve.
        self._alpha_share = self._beta_share = 0.0
        if self._proportional:
            alpha, beta_damping = (
                model.damping_of(model.blocks[0].component) if model.blocks else (0.0, 0.0)
            )
            mass_share = 1.0 + self.velocity_factor * beta_damping
            stiffness_share = self.position_factor + self.velocity_factor * alpha
            self._beta_share = beta_damping / mass_share
            self._alpha_share = alpha - self._beta_share * stiffness_share
            self._mass_from_step = (1.0 / mass_share, -stiffness_share / mass_share)
        else:
            operators["damping"] = assemble(comm, model, ownership, damping=1.0)
            operators["mass"] = assemble(comm, model, ownership, mass=1.0)
        self._operators = operators
        overlap = (0, 0)
        if ownership.n_local:
            ends = _row_positions(model)[
                [ownership.first // model.block_size, ownership.last // model.block_size - 1]
            ]
            overlap = self.windows.around(float(ends[0]), float(ends[1]))
        self.solver = StepSolver(comm, operators["step"], ownership, overlap, model.block_size)
        n = ownership.n_local
        names = ("displacement", "velocity", "acceleration", "work", "right")
        # The vectors wrap our arrays, so that nothing in the loop makes or copies arrays. An array
        # asked from a vector would keep it, and the communicator, alive beyond ``destroy``.
        arrays = {name: np.zeros(n) for name in names}
        self._vectors = {
            name: PETSc.Vec().createWithArray(array, size=(n, None), comm=comm)
            for name, array in arrays.items()
        }
        self.displacement = arrays["displacement"]
        self.velocity = arrays["velocity"]
        self.acceleration = arrays["acceleration"]
        self._work = arrays["work"]
        self._right = arrays["right"]

    def predict(self) -> None:
        """Turn displacement and velocity into their predictions of eq. (2.5)."""
        kernels.predict(
            self.displacement,
            self.velocity,
            self.acceleration,
            self._work,
            self._dt,
            self._predict_position,
            self._predict_velocity,
            self._alpha_share,
        )

    def free_acceleration(self, loads: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Fill the acceleration from the predictions and local loads (eq. 2.4). Collective.

        ``loads`` are pairs of local unknowns and forces [N]; contact and slack droppers are
        left out, so that ``correct`` must follow.
        """
        self.internal_forces()
        self.solve(loads)

    def internal_forces(self) -> None:
        """Right-hand side -C v - K d of eq. (2.4); only right after ``predict``. Collective."""
        operators, vectors = self._operators, self._vectors
        operators["stiffness"].mult(vectors["work"], vectors["right"])
        if not self._proportional:
            np.negative(self.velocity, out=self._work)
            operators["damping"].multAdd(vectors["work"], vectors["right"], vectors["right"])

    def solve(self, loads: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Acceleration for the internal forces plus ``loads``, but for its part by damping on mass,
        which ``correct`` takes off. May be called again for other loads. Collective."""
        name = "right"
        if loads:
            name = "work"
            np.copyto(self._work, self._right)
            for dofs, values in loads:
                np.add.at(self._work, dofs, values)
        self.solver.solve(self._vectors[name], self._vectors["acceleration"])

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
        work = self._vectors["work"]
        displacement, velocity = self._vectors["displacement"], self._vectors["velocity"]
        self._operators["stiffness"].mult(displacement, work)
        elastic = 0.5 * displacement.dot(work)
        if "mass" in self._operators:
            self._operators["mass"].mult(velocity, work)
            return 0.5 * velocity.dot(work), elastic
        step_share, stiffness_share = self._mass_from_step
        self._operators["step"].mult(velocity, work)
        kinetic = step_share * velocity.dot(work)
        self._operators["stiffness"].mult(velocity, work)
        return 0.5 * (kinetic + stiffness_share * velocity.dot(work)), elastic

    @property
    def solution(self) -> PETSc.Vec:
        """The displacement as a PETSc vector."""
        return self._vectors["displacement"]

    def require_finite(self, time: float) -> None:
        """Raise RunBroken if the state holds anything that is no number. Collective."""
        if not np.isfinite(self._vectors["acceleration"].norm()):
            raise RunBroken(f"the line's motion is not finite at t = {time:.4f} s")

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        self.solver.destroy()
        for held in (*self._operators.values(), *self._vectors.values()):
            held.destroy()


def _row_positions(model: Model) -> np.ndarray:
    positions = np.empty(model.mesh.n_nodes)
    positions[model.row_of_node] = model.mesh.points[:, 0]
    return positions
