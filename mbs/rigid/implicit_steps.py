"""Motion of a multibody system with fixed steps: Newmark's method with multipliers, implicit.

A step of length h from places q, velocities v and accelerations a predicts

    q* = q + h v + h^2 / 2 a,    v* = v + h a

(turns by vectors in body axes) and solves (3.6) for the change d of the accelerations, with forces
linear around the prediction and the rows of joints taken there:

    (M + gamma h C + beta h^2 K) d + J^T lambda = g(q*, v*, t + h) - M a + W f,
    J d = -(J a + drift(q*, v*)),

C and K those of springs and dampers along their lines, W the directions of the forces f of the
coming step. Then q = q* + beta h^2 d, v = v* + gamma h d, a = a + d, and errors of joints, of order
h^3 from the prediction, are removed from places and velocities. With beta = 1/4 and gamma = 1/2,
the trapezoidal rule, it is of second order; what C and K leave out is of order h^3 in a step.

A step may be cut into substeps, over which the forces change evenly from those of the step before
to f: what comes out at the end is affine in f all the same, and of second order.

With A = M + gamma h C + beta h^2 K a step solves for any number of right sides

    [A  J^T] [d     ]   [right  ]
    [J    0] [lambda] = [closing],

and afterwards removes what is left of errors of joints, J x = -error. Three methods differ in how
they solve the first and whether they do the second:

- *coordinate partitioning*: the dependent coordinates follow from the joints, the independent ones
  from a small dense system; errors are removed by moving dependent coordinates only;
- *augmented Lagrangian*: errors are penalised and multipliers iterated, in the step and in mass
  orthogonal projections of places and velocities after it; no row need be independent;
- *Baumgarte*: multipliers of independent rows, with feedback of errors, implicit like the step
  itself; nothing is projected, so that errors stay as small as feedback makes them.

Sources: N. M. Newmark, J. Eng. Mech. Div. ASCE 85, 1959; Ambrosio et al., 2012, equation (3.6);
P. E. Nikravesh, 1988, chapter 13; E. Bayo, R. Ledesma, Nonlinear Dynamics 9, 1996; J. Baumgarte,
Comp. Meth. Appl. Mech. Eng. 1, 1972.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from scipy import linalg

from catenary.base.errors import NotConverged, RunBroken
from catenary.mbs.rigid.bodies import Motion, Quantity
from catenary.mbs.rigid.system import CLOSED, System, closed_within, independent_rows

# Generalised forces (6 n, s) of unit forces at a motion.
Ways = Callable[[Motion], np.ndarray]

# Removals of the errors of joints after a step, at most.
MAX_REMOVALS = 8
# A pivot of dependent coordinates below this part of the largest one: others are chosen.
WORN = 1e-4
# Change of a right side's solution that ends the augmented Lagrangian, over its size.
_SETTLED = 1e-12


class Prediction(NamedTuple):
    """The end of the coming step, affine in the forces f (s,) in it.

    ``motion``: prediction of the last substep; ``displacement``, ``velocity``, ``acceleration``
    (6 n,): what is to be added to its place, its velocities and the accelerations before that
    substep when f are the ``forces`` (s,) last taken; ``by_force``: the same per unit of force,
    shapes (6 n, s).
    """

    motion: Motion
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    by_force: tuple[np.ndarray, np.ndarray, np.ndarray]
    forces: np.ndarray

    def changes(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacement, change of velocity and of acceleration (6 n,) with these forces (s,)."""
        more = forces - self.forces
        return (
            self.displacement + self.by_force[0] @ more,
            self.velocity + self.by_force[1] @ more,
            self.acceleration + self.by_force[2] @ more,
        )


class Stepper:
    """A system of bodies, one step of fixed length at a time.

    Parameters
    ----------
    system : System
    dt : length of a step [s]
    solver : way of keeping constraints, or its name in ``METHODS``
    ways : generalised forces of unit forces that are given step by step; none if left out
    substeps : into how many a step is cut
    beta, gamma : Newmark's parameters
    """

    def __init__(
        self,
        system: System,
        dt: float,
        solver: StepSolver | str = "coordinate_partitioning",
        ways: Ways | None = None,
        substeps: int = 1,
        beta: float = 0.25,
        gamma: float = 0.5,
    ) -> None:
        self.system = system
        self._solver = METHODS[solver]() if isinstance(solver, str) else solver
        self._ways = ways or (lambda motion: np.zeros((6 * motion.n_bodies, 0)))
        self._dt, self._substeps = dt, substeps
        self._beta, self._gamma = beta, gamma
        self._predicted: Prediction | None = None

    def begin(self, motion: Motion, time: float, forces: np.ndarray | None = None) -> None:
        """Start from a motion, joints closed by projection, under ``forces`` (s,) [N]."""
        system = self.system
        motion = system.assemble(motion, time)
        self.motion, self.time = system.project_velocities(motion, time), time
        ways = self._ways(self.motion)
        self.forces = np.zeros(ways.shape[1]) if forces is None else np.array(forces, dtype=float)
        self.acceleration = system.accelerations(self.motion, time, ways @ self.forces).acceleration
        self._predicted = None

    def predict(self, time: float) -> Prediction:
        """The end of the coming step, at ``time`` [s], as a function of the forces in it."""
        h = (time - self.time) / self._substeps
        none = np.zeros((self.acceleration.size, self.forces.size))
        motion, acceleration, by_force = self.motion, self.acceleration, (none, none, none)
        for number in range(1, self._substeps + 1):
            end = self.time + number * h
            found = self._solve(motion, acceleration, by_force, number / self._substeps, end, h)
            acceleration, by_force = found.acceleration, found.by_force
            if number < self._substeps:
                motion = self._finished(found.motion, found.displacement, found.velocity, end)
        self._end, self._predicted = end, found
        return found

    def advance(self, forces: np.ndarray | None = None) -> None:
        """Take the step predicted last with forces (s,) [N].

        Raises
        ------
        RunBroken
            Nothing was predicted, joints cannot be kept closed, or numbers are not finite.
        """
        if self._predicted is None:
            raise RunBroken("A step of a multibody system is taken before it was predicted.")
        taken = np.zeros(0) if forces is None else np.array(forces, dtype=float)
        displacement, velocity, acceleration = self._predicted.changes(taken)
        self.motion = self._finished(self._predicted.motion, displacement, velocity, self._end)
        self.acceleration, self.time, self.forces = acceleration, self._end, taken
        self._predicted = None

    def step(self) -> None:
        """A step of the whole length without further forces."""
        self.predict(self.time + self._dt)
        self.advance()

    def violation(self) -> float:
        """Largest error of a row of the joints now [m, cosine]."""
        rows = self.system.constraints(self.motion, self.time)
        return float(np.abs(rows.value).max(initial=0.0))

    def _solve(
        self,
        motion: Motion,
        acceleration: np.ndarray,
        by_force: tuple[np.ndarray, np.ndarray, np.ndarray],
        share: float,
        end: float,
        h: float,
    ) -> Prediction:
        """The end of a substep; ``share`` of a change of forces has happened there."""
        system, beta, gamma = self.system, self._beta, self._gamma
        velocities = motion.velocities
        there = motion.moved(h * velocities + 0.5 * h**2 * acceleration).with_velocities(
            velocities + h * acceleration
        )
        moved, sped, pushed = by_force
        moved = moved + h * sped + 0.5 * h**2 * pushed
        sped = sped + h * pushed
        rows, ways = system.constraints(there, end), self._ways(there)
        length, _, gradient = system.lines.geometry(there)
        # Negative slopes are left to the prediction, so that A stays positive.
        stiffness = np.maximum(system.lines.stiffness(length), 0.0)
        damping = np.maximum(system.lines.damping, 0.0)
        mass = system.mass
        operator = (gradient.T * (gamma * h * damping + beta * h**2 * stiffness)) @ gradient
        operator[np.diag_indices(len(mass))] += mass
        self._solver.factor(operator, rows.jacobian)
        force = system.generalised_forces(there, end) + ways @ self.forces - mass * acceleration
        resisted = stiffness[:, None] * (gradient @ moved) + damping[:, None] * (gradient @ sped)
        more = share * ways - mass[:, None] * pushed - gradient.T @ resisted
        closing, part = self._closing(rows, acceleration, h)
        solution = self._solver.solve(
            np.column_stack([force, more]),
            np.column_stack([closing, -part * (rows.jacobian @ pushed)]),
        )
        change, by = solution[:, 0], solution[:, 1:]
        return Prediction(
            there,
            beta * h**2 * change,
            gamma * h * change,
            acceleration + change,
            (moved + beta * h**2 * by, sped + gamma * h * by, pushed + by),
            self.forces,
        )

    def _closing(
        self, rows: Quantity, acceleration: np.ndarray, h: float
    ) -> tuple[np.ndarray, float]:
        """J d (m,) that closes the joints, and the share of it that is left with feedback."""
        open_by, share = rows.jacobian @ acceleration + rows.drift, 1.0
        if self._solver.feedback is not None:
            # d also changes the errors at the step's end: w^2 beta h^2 J d, 2 w gamma h J d.
            per_step = self._solver.feedback
            frequency = per_step / h
            open_by += 2.0 * frequency * rows.rate + frequency**2 * rows.value
            share = 1.0 / (1.0 + 2.0 * per_step * self._gamma + per_step**2 * self._beta)
        return -share * open_by, share

    def _finished(
        self, there: Motion, displacement: np.ndarray, velocity: np.ndarray, time: float
    ) -> Motion:
        """The motion at the end of a substep, errors of joints removed."""
        motion = there.moved(displacement)
        velocities = there.velocities + velocity
        if not np.isfinite(velocities).all() or not np.isfinite(displacement).all():
            raise RunBroken(f"The multibody system's motion is not finite at {time:g} s.")
        if self._solver.feedback is None and self.system.joints:
            motion = self._closed(motion, time)
            rows = self.system.constraints(motion.with_velocities(velocities), time)
            error = rows.rate
            for _ in range(MAX_REMOVALS):
                if np.abs(error).max() <= CLOSED * (1.0 + np.abs(velocities).max()):
                    break
                step = self._solver.removal(error)
                velocities = velocities + step
                error = error + rows.jacobian @ step
            else:
                raise NotConverged(
                    f"The velocities of the multibody system cannot be kept to its joints at "
                    f"{time:g} s: they miss by {float(np.abs(error).max()):.2g} m/s or 1/s; take "
                    "shorter steps."
                )
        return motion.with_velocities(velocities)

    def _closed(self, motion: Motion, time: float) -> Motion:
        """Errors of places removed with the rows of the prediction, which are nearly the same."""
        limit = closed_within(motion)
        for _ in range(MAX_REMOVALS):
            errors = self.system.constraints(motion, time).value
            if np.abs(errors).max() <= limit:
                return motion
            motion = motion.moved(self._solver.removal(errors))
        raise NotConverged(
            f"The joints of the multibody system cannot be kept closed at {time:g} s: they are "
            f"open by {float(np.abs(errors).max()):.2g} m; take shorter steps."
        )


class StepSolver(Protocol):
    """A method of keeping constraints in a step."""

    # Feedback of errors of joints, 1 / step; None where errors are removed after a step.
    feedback: float | None

    def factor(self, operator: np.ndarray, jacobian: np.ndarray) -> None:
        """Prepare for A (6 n, 6 n), symmetric and positive definite, and J (m, 6 n)."""

    def solve(self, right: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Changes d (6 n, k) for right sides (6 n, k) and (m, k)."""

    def removal(self, errors: np.ndarray) -> np.ndarray:
        """Displacement (6 n,) that removes errors (m,) of rows with the J prepared for."""


class Partitioned:
    """Coordinate partitioning."""

    feedback: float | None = None

    def __init__(self) -> None:
        self._kept = np.zeros(0, dtype=int)
        self._dependent = np.zeros(0, dtype=int)
        self._independent = np.zeros(0, dtype=int)
        self._n_rows = -1

    def factor(self, operator: np.ndarray, jacobian: np.ndarray) -> None:
        """Dependent coordinates are kept from step to step for as long as they serve."""
        if len(jacobian) != self._n_rows or not self._factor_dependent(jacobian):
            self._choose(jacobian)
            self._factor_dependent(jacobian)
        n, free = len(operator), self._independent
        self._basis = np.zeros((n, len(free)))
        self._basis[free, np.arange(len(free))] = 1.0
        self._basis[self._dependent] = -self._from_rows(jacobian[self._kept][:, free])
        self._operator = operator
        if len(free):
            small = self._basis.T @ (operator @ self._basis)
            self._small = linalg.cho_factor(small, check_finite=False)

    def solve(self, right: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Dependent changes that close, and the independent ones that balance what is left."""
        result = np.zeros_like(right)
        result[self._dependent] = self._from_rows(closing[self._kept])
        if not len(self._independent):
            return result
        left = self._basis.T @ (right - self._operator @ result)
        return result + self._basis @ linalg.cho_solve(self._small, left, check_finite=False)

    def removal(self, errors: np.ndarray) -> np.ndarray:
        """Changes of dependent coordinates that remove errors of the rows."""
        result = np.zeros(len(self._operator))
        result[self._dependent] = self._from_rows(-errors[self._kept])
        return result

    def _choose(self, jacobian: np.ndarray) -> None:
        self._n_rows = len(jacobian)
        self._kept = independent_rows(jacobian)
        pivots = np.arange(jacobian.shape[1])
        if len(self._kept):
            pivots = linalg.qr(jacobian[self._kept], mode="r", pivoting=True)[1]
        self._dependent = np.sort(pivots[: len(self._kept)])
        self._independent = np.sort(pivots[len(self._kept) :])

    def _factor_dependent(self, jacobian: np.ndarray) -> bool:
        """Whether the dependent coordinates are still determined by the joints."""
        if len(self._kept) == 0:
            return True
        square = jacobian[self._kept][:, self._dependent]
        self._triangles, self._order, failed = linalg.lapack.dgetrf(square)
        pivots = np.abs(np.diag(self._triangles))
        return bool(failed == 0 and pivots.min() > WORN * pivots.max())

    def _from_rows(self, values: np.ndarray) -> np.ndarray:
        if len(self._kept) == 0:
            return values
        return linalg.lapack.dgetrs(self._triangles, self._order, values)[0].reshape(values.shape)


class _Multipliers:
    """Changes by A alone, and multipliers of rows by their Schur complement."""

    def _factor_rows(self, operator: np.ndarray, rows: np.ndarray, softness: float = 0.0) -> None:
        """Prepare for A and rows (m, 6 n) of J, whose Schur complement has a diagonal larger by the
        part ``softness``."""
        self._rows = rows
        self._operator = linalg.cho_factor(operator, check_finite=False)
        self._soft = linalg.cho_solve(self._operator, rows.T, check_finite=False)
        schur = rows @ self._soft
        if len(schur):
            schur[np.diag_indices(len(schur))] *= 1.0 + softness
            self._schur = linalg.cho_factor(schur, check_finite=False)

    def _alone(self, right: np.ndarray) -> np.ndarray:
        return np.asarray(linalg.cho_solve(self._operator, right, check_finite=False))

    def _closing(self, change: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Further change by which the rows of a ``change`` (6 n, k) come to ``closing`` (m, k)."""
        left = closing - self._rows @ change
        return np.asarray(self._soft @ linalg.cho_solve(self._schur, left, check_finite=False))


class Augmented(_Multipliers):
    """The augmented Lagrangian: ``penalty`` relative to what rows feel of A."""

    feedback: float | None = None

    def __init__(self, penalty: float = 1e8, max_iterations: int = 30) -> None:
        self.penalty, self.max_iterations = penalty, max_iterations

    def factor(self, operator: np.ndarray, jacobian: np.ndarray) -> None:
        """(A + a J^T J)^-1 a J^T as A^-1 J^T (1 / a + J A^-1 J^T)^-1, which loses no digits."""
        self._factor_rows(operator, jacobian, 1.0 / self.penalty)

    def solve(self, right: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Unconstrained changes, then multipliers until they close.

        Raises
        ------
        NotConverged
            They do not close.
        """
        return self._closed(self._alone(right), closing)

    def removal(self, errors: np.ndarray) -> np.ndarray:
        """The displacement that is smallest as A measures it."""
        return self._closed(np.zeros((self._rows.shape[1], 1)), -errors[:, None])[:, 0]

    def _closed(self, change: np.ndarray, closing: np.ndarray) -> np.ndarray:
        if not len(closing):
            return change
        for _ in range(self.max_iterations):
            step = self._closing(change, closing)
            change = change + step
            # Each right side by its own size: unit forces move far less than accelerations.
            size = np.abs(change).max(axis=0)
            if (np.abs(step).max(axis=0) <= _SETTLED * size).all():
                return change
        raise NotConverged(
            "The augmented Lagrangian does not converge within a step: choose another penalty "
            f"than {self.penalty:g}."
        )


class WithFeedback(_Multipliers):
    """Baumgarte's method.

    ``feedback``: frequency and damping of errors times the step; 1 lets an error die out within a
    few steps, and is stable for any step since the feedback is implicit.
    """

    feedback: float | None

    def __init__(self, feedback: float = 1.0) -> None:
        self.feedback = feedback
        self._kept = np.zeros(0, dtype=int)
        self._n_rows = -1

    def factor(self, operator: np.ndarray, jacobian: np.ndarray) -> None:
        """The Schur complement of independent rows."""
        if len(jacobian) != self._n_rows:
            self._n_rows, self._kept = len(jacobian), independent_rows(jacobian)
        self._factor_rows(operator, jacobian[self._kept])

    def solve(self, right: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Unconstrained changes, then the multipliers' part."""
        change = self._alone(right)
        return change + self._closing(change, closing[self._kept]) if len(self._kept) else change

    def removal(self, errors: np.ndarray) -> np.ndarray:
        """None: errors are left to the feedback."""
        return np.zeros(self._rows.shape[1])


METHODS: dict[str, Callable[[], StepSolver]] = {
    "coordinate_partitioning": Partitioned,
    "augmented_lagrangian": Augmented,
    "baumgarte": WithFeedback,
}
