"""How constraints are kept while equations of motion are integrated: three methods to select from.

(3.6) uses the constraints' second derivatives only, so that positions and velocities drift off the
constraints. Each method gives the rates that an integrator integrates, and can correct a state.

Sources: J. Baumgarte, Comp. Meth. Appl. Mech. Eng. 1, 1972; E. Bayo et al., the same, 71, 1988;
P. E. Nikravesh, 1988, chapter 13.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from body_mechanics import place_rates
from scipy import linalg

from catenary import RunBroken
from catenary.mbs.rigid.bodies import Motion, Quantity
from catenary.mbs.rigid.system import System, independent_rows


class ConstraintHandling(Protocol):
    """A method of keeping constraints."""

    def begin(self, system: System, motion: Motion, time: float) -> None:
        """Prepare for integrating from a motion that satisfies the joints."""

    def rates(self, system: System, motion: Motion, time: float) -> np.ndarray:
        """Rates of ``Motion.to_vector``, shape (13 n,)."""


def project(system: System, motion: Motion, time: float) -> Motion:
    """Positions and velocities nearest to a motion that satisfy the joints."""
    return system.project_velocities(system.assemble(motion, time), time)


def accelerations(system: System, motion: Motion, time: float, rows: Quantity) -> np.ndarray:
    """Solution (6 n,) of (3.6) under given rows, gamma being minus their drift."""
    n, kept = system.mass.size, independent_rows(rows.jacobian)
    joined = np.zeros((n + len(kept),) * 2)
    joined[:n, :n] = np.diag(system.mass)
    joined[n:, :n], joined[:n, n:] = rows.jacobian[kept], rows.jacobian[kept].T
    right = np.concatenate([system.generalised_forces(motion, time), -rows.drift[kept]])
    return np.asarray(linalg.solve(joined, right)[:n])


@dataclass
class Baumgarte:
    """Adds feedback to (3.6): gamma - 2 damping dPhi/dt - frequency^2 Phi.

    ``frequency`` and ``damping`` [1/s]; equal ones are critical damping: a violation dies out
    like exp(-frequency t).
    """

    frequency: float = 10.0
    damping: float = 10.0

    def begin(self, system: System, motion: Motion, time: float) -> None:
        """Needs no preparation."""

    def rates(self, system: System, motion: Motion, time: float) -> np.ndarray:
        """Rates of the state (13 n,)."""
        rows = system.constraints(motion, time)
        feedback = 2.0 * self.damping * rows.rate + self.frequency**2 * rows.value
        rows = rows._replace(drift=rows.drift + feedback)
        acceleration = accelerations(system, motion, time, rows)
        return np.concatenate([place_rates(motion), acceleration])


@dataclass
class AugmentedLagrangian:
    """Penalises violations, and iterates multipliers until the penalty has nothing left to do.

    (M + a Phi_q^T Phi_q) dv/dt = M dv/dt_before
        - a Phi_q^T (-gamma + 2 mu omega dPhi/dt + omega^2 Phi)

    It needs no independent rows, and stays regular where joints become dependent.

    Parameters
    ----------
    penalty : a, relative to the masses that rows feel
    frequency, damping_ratio : omega [1/s] and mu of the violations
    tolerance : of the last change of the accelerations, relative
    max_iterations : after which RunBroken is raised
    """

    penalty: float = 1e6
    frequency: float = 10.0
    damping_ratio: float = 1.0
    tolerance: float = 1e-11
    max_iterations: int = 30

    def begin(self, system: System, motion: Motion, time: float) -> None:
        """Needs no preparation."""

    def rates(self, system: System, motion: Motion, time: float) -> np.ndarray:
        """Rates of the state (13 n,)."""
        rows = system.constraints(motion, time)
        omega, force = self.frequency, system.generalised_forces(motion, time)
        wanted = -(rows.drift + 2 * self.damping_ratio * omega * rows.rate + omega**2 * rows.value)
        # The step from one iterate to the next, dv = (M + a J^T J)^-1 a J^T (wanted - J dv/dt), is
        # M^-1 J^T (1 / a + J M^-1 J^T)^-1 (...): the same without adding a to M, which would lose
        # as many digits of the motion as a is large.
        softness, jacobian = system.inverse_mass, rows.jacobian
        schur = (jacobian * softness) @ jacobian.T
        felt = np.diag(schur)
        factor = linalg.cho_factor(schur + np.diag(felt) / self.penalty)
        acceleration = softness * force
        for _ in range(self.max_iterations):
            pushed = linalg.cho_solve(factor, wanted - jacobian @ acceleration)
            step = softness * (jacobian.T @ pushed)
            acceleration += step
            change = float(np.abs(step).max())
            if change <= self.tolerance * max(1.0, float(np.abs(acceleration).max())):
                return np.concatenate([place_rates(motion), acceleration])
        raise RunBroken(
            f"The augmented Lagrangian does not converge at {time:g} s "
            f"(last change {change:.2g}): choose another penalty than {self.penalty:g}."
        )


@dataclass
class CoordinatePartitioning:
    """Integrates independent coordinates; the dependent ones follow from the joints.

    Which coordinates (translations in space, rotations in body axes) are independent is chosen by
    a pivoted factorisation of Phi_q at every ``begin``.

    ``tolerance``: largest error of a row of the joints [m, cosine].
    """

    tolerance: float = 1e-12
    max_iterations: int = 20
    _dependent: np.ndarray = field(init=False, repr=False, default_factory=lambda: np.zeros(0, int))
    _kept: np.ndarray = field(init=False, repr=False, default_factory=lambda: np.zeros(0, int))

    def begin(self, system: System, motion: Motion, time: float) -> None:
        """Choose dependent coordinates: as many as independent rows, best conditioned."""
        jacobian = system.constraints(motion, time).jacobian
        self._kept = independent_rows(jacobian)
        pivots = linalg.qr(jacobian[self._kept], mode="r", pivoting=True)[1]
        self._dependent = np.sort(pivots[: len(self._kept)])

    def correct(self, system: System, motion: Motion, time: float) -> tuple[Motion, Quantity]:
        """The motion with dependent places and velocities changed to satisfy the joints."""
        limit = self.tolerance * max(1.0, float(np.abs(motion.position).max()))
        kept, dependent = self._kept, self._dependent
        step = np.zeros(6 * motion.n_bodies)
        for _ in range(self.max_iterations):
            rows = system.constraints(motion, time)
            square = rows.jacobian[np.ix_(kept, dependent)]
            if len(kept) == 0 or np.abs(rows.value[kept]).max() <= limit:
                break
            step[dependent] = linalg.solve(square, -rows.value[kept])
            motion = motion.moved(step)
        else:
            raise RunBroken(
                f"The dependent coordinates cannot be found at {time:g} s: "
                "ask for results at shorter intervals, where they are chosen anew."
            )
        velocities = motion.velocities
        velocities[dependent] -= linalg.solve(square, rows.rate[kept])
        motion = motion.with_velocities(velocities)
        return motion, system.constraints(motion, time)

    def rates(self, system: System, motion: Motion, time: float) -> np.ndarray:
        """Rates of the state (13 n,)."""
        motion, rows = self.correct(system, motion, time)
        acceleration = accelerations(system, motion, time, rows)
        return np.concatenate([place_rates(motion), acceleration])
