"""A line that has lost its balance, stepped with the constant load of that."""

from __future__ import annotations

import numpy as np

from catenary.solver.integrators.generalized_alpha import GeneralizedAlphaLine
from catenary.solver.integrators.line_integrator import LineMotion
from catenary.solver.integrators.newmark import NewmarkLine
from catenary.solver.linear.step_operators import Loads


class _Unbalanced(LineMotion):
    """A line under g of `changed_line`, as part of its internal forces.

    All ranks know g where they solve, so that it needs no message.
    """

    def lose(self, load: np.ndarray) -> None:
        """Step under ``load`` (n_dofs,) [N], [N m], which all ranks pass, from now on."""
        domain = self.operators.domain
        self._lost = load[domain.low : domain.high].copy()

    def free_step(self, loads: Loads | None = None) -> None:
        """Take the step without contacts and slack droppers, part by part. Collective."""
        LineMotion.free_step(self, loads)

    def internal_forces(self) -> None:
        """Right-hand side g - C v - K d of the step; only right after ``predict``. Collective."""
        super().internal_forces()
        self.operators.add_force(self._lost)


class UnbalancedNewmarkLine(_Unbalanced, NewmarkLine):
    """By Newmark's method; ``lose`` before the first step. Collective to make."""


class UnbalancedAlphaLine(_Unbalanced, GeneralizedAlphaLine):
    """By the generalized-alpha method; ``lose`` before the first step. Collective to make."""
