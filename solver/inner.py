"""The small dense problem of a step: contact forces and slack droppers, solved exactly.

All forces act through the line's and the pantographs' compliance within the step:

    h_i = h0_i + sum_j B_ij f_j - sum_d P_di s_d          wire height at contact i
    z_i = z0_i - c_i f_i                                  head height
    T_d = T0_d + sum_j Q_dj f_j - sum_e G_de s_e          tension of dropper d if it could push
    f_i = max(0, k delta_i + c delta_i'),  delta = z - h  contact law
    s_d = (1 - r) max(0, -T_d)                            compensation of a slack dropper (2.7)

This is a linear complementarity problem with a P-matrix: it has one solution, which an active-set
iteration (semismooth Newton) finds, mostly in one or two rounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.mbs.interface import HeadState
from catenary.solver.errors import RunBroken
from catenary.solver.problem import ContactLaw

_MAX_ROUNDS = 60


@dataclass
class LineResponse:
    """The line's side of the inner problem, for n contacts and m droppers that may slacken.

    Attributes
    ----------
    height, rate : (n,) free wire height [m] and its total rate [m/s] at the contacts
    height_by_force, rate_by_force : (n, n) B [m/N] and its rate [m/(N s)]
    droppers : (m,) their numbers
    tension : (m,) T0 [N]
    tension_by_force : (m, n) Q [-]
    height_by_slack, rate_by_slack : (m, n) P [m/N] and its rate [m/(N s)]
    """

    height: np.ndarray
    rate: np.ndarray
    height_by_force: np.ndarray
    rate_by_force: np.ndarray
    droppers: np.ndarray
    tension: np.ndarray
    tension_by_force: np.ndarray
    height_by_slack: np.ndarray
    rate_by_slack: np.ndarray


@dataclass
class InnerSolution:
    """Contact forces (n,) [N], compensations (m,) [N], wire heights at the contacts (n,) [m],
    rounds of the active-set iteration."""

    contact_force: np.ndarray
    compensation: np.ndarray
    wire_height: np.ndarray
    rounds: int


class InnerProblem:
    """Solves the inner problem for one contact law. Lives on rank 0; not collective.

    Parameters
    ----------
    law : ContactLaw
    may_lose_contact : whether the contact force is cut off at zero
    kept_ratio : share r of its stiffness that a slack dropper keeps
    """

    def __init__(self, law: ContactLaw, may_lose_contact: bool, kept_ratio: float) -> None:
        self._k = law.stiffness
        self._c = law.damping
        self._may_lose_contact = may_lose_contact
        self._released = 1.0 - kept_ratio

    def solve(
        self, line: LineResponse, heads: list[HeadState], tension_by_slack: np.ndarray
    ) -> InnerSolution:
        """Forces of the step; ``tension_by_slack`` is G (m, m) of ``line.droppers`` [-].

        Raises
        ------
        RunBroken
            If the active set does not settle.
        """
        k, c, n, m = self._k, self._c, line.height.size, line.droppers.size
        push = np.array([k * (h.height) + c * h.velocity for h in heads])
        push -= k * line.height + c * line.rate
        softness = k * line.height_by_force + c * line.rate_by_force
        for i, head in enumerate(heads):
            softness[i, i] += k * head.height_compliance + c * head.velocity_compliance
        if m == 0 and n == 1:
            force = push / (1.0 + softness[0, 0])
            if self._may_lose_contact and force[0] < 0.0:
                force[0] = 0.0
            height = line.height + line.height_by_force[0] * force
            return InnerSolution(force, np.zeros(0), height, 1)
        matrix = np.empty((n + m, n + m))
        matrix[:n, :n] = softness
        matrix[:n, n:] = -(k * line.height_by_slack + c * line.rate_by_slack).T
        matrix[n:, :n] = self._released * line.tension_by_force
        matrix[n:, n:] = -self._released * tension_by_slack
        matrix[np.diag_indices(n + m)] += 1.0
        right = np.concatenate([push, -self._released * line.tension])
        solution, rounds = self._settle(matrix, right, n)
        force, slack = solution[:n], solution[n:]
        height = line.height + line.height_by_force @ force - line.height_by_slack.T @ slack
        return InnerSolution(force, slack, height, rounds)

    def _settle(self, matrix: np.ndarray, right: np.ndarray, n: int) -> tuple[np.ndarray, int]:
        """Solve x = max(0, x - (matrix x - right)) entry by entry, contacts first."""
        acts = right > 0.0
        if self._may_lose_contact:
            acts[:n] = True
        always = np.zeros(right.size, dtype=bool)
        always[:n] = not self._may_lose_contact
        acts |= always
        seen = set()
        for rounds in range(1, _MAX_ROUNDS + 1):
            index = np.flatnonzero(acts)
            solution = np.zeros(right.size)
            if index.size:
                solution[index] = np.linalg.solve(matrix[np.ix_(index, index)], right[index])
            residual = matrix @ solution - right
            now = (solution - residual > 0.0) | always
            if np.array_equal(now, acts):
                return solution, rounds
            key = now.tobytes()
            if key in seen:
                return self._pivot(matrix, right, always, rounds)
            seen.add(key)
            acts = now
        return self._pivot(matrix, right, always, _MAX_ROUNDS)

    @staticmethod
    def _pivot(
        matrix: np.ndarray, right: np.ndarray, always: np.ndarray, rounds: int
    ) -> tuple[np.ndarray, int]:
        """Murty's least-index pivoting: slower, but it cannot cycle for a P-matrix."""
        acts = always.copy()
        scale = 1e-12 * (1.0 + np.abs(right).max())
        for extra in range(1, 20 * right.size + 100):
            index = np.flatnonzero(acts)
            solution = np.zeros(right.size)
            if index.size:
                solution[index] = np.linalg.solve(matrix[np.ix_(index, index)], right[index])
            residual = matrix @ solution - right
            wrong = np.where(acts, (solution < -scale) & ~always, residual < -scale)
            if not wrong.any():
                return solution, rounds + extra
            first = int(np.argmax(wrong))
            acts[first] = not acts[first]
        raise RunBroken("contacts and slack droppers of this step have no common solution")
