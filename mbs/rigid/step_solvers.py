"""Three ways to keep constraints within an implicit step of fixed length.

A step solves, for the change d of the accelerations and any number of right sides,

    [A  J^T] [d     ]   [right  ]
    [J    0] [lambda] = [closing],   A = M + gamma h C + beta h^2 K,

and afterwards removes what is left of errors of joints, J x = -error. The methods differ in how
they solve the first and whether they do the second:

- *coordinate partitioning*: the dependent coordinates follow from the joints, the independent ones
  from a small dense system; errors are removed by moving dependent coordinates only;
- *augmented Lagrangian*: errors are penalised and multipliers iterated, in the step and in mass
  orthogonal projections of places and velocities after it; no row need be independent;
- *Baumgarte*: multipliers of independent rows, with feedback of errors, implicit like the step
  itself; nothing is projected, so that errors stay as small as feedback makes them.

Sources: P. E. Nikravesh, 1988, chapter 13; E. Bayo, R. Ledesma, Nonlinear Dynamics 9, 1996;
J. Baumgarte, Comp. Meth. Appl. Mech. Eng. 1, 1972.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy import linalg

from catenary.base.errors import NotConverged
from catenary.mbs.rigid.system import independent_rows

# A pivot of dependent coordinates below this part of the largest one: others are chosen.
WORN = 1e-4


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

    def __init__(
        self, penalty: float = 1e8, tolerance: float = 1e-12, max_iterations: int = 30
    ) -> None:
        self.penalty, self.tolerance, self.max_iterations = penalty, tolerance, max_iterations

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
            if (np.abs(step).max(axis=0) <= self.tolerance * size).all():
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
