"""The small dense problem of a step: contact forces and slack droppers, solved exactly.

All forces act through the line's and the pantographs' compliance within the step:

    h_i = h0_i + sum_j B_ij f_j - sum_d P_di s_d          wire height at contact i
    z_i = z0_i - c_i f_i                                  head height
    T_d = T0_d + sum_j Q_dj f_j - sum_e G_de s_e          tension of dropper d if it could push
    f_i = max(0, k delta_i + c delta_i'),  delta = z - h  contact law
    s_d = (1 - r) max(0, -T_d)                            compensation of a slack dropper (2.7)

This is a linear complementarity problem. Its matrix is a P-matrix, so that it has one solution,
unless the convective part of a contact damper outweighs the compliances (docs/theory.md). An
active-set iteration (semismooth Newton) finds it, mostly in one or two rounds; a set that cycles is
handed to least-index pivoting, and a step without solution ends the run with a sentence.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from catenary.mbs.interface import HeadState
from catenary.solver import kernels
from catenary.solver.errors import RunBroken
from catenary.solver.problem import ContactLaw

# Mostly one or two rounds are needed; a set that cycles shows within a few.
_MAX_ROUNDS = 30


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
        self._may_pull = not may_lose_contact
        self._released = 1.0 - kept_ratio

    def solve(
        self,
        line: LineResponse,
        heads: list[HeadState],
        tension_by_slack: Callable[[np.ndarray], np.ndarray],
    ) -> InnerSolution:
        """Forces of the step; ``tension_by_slack`` gives G (m, m) of some droppers (m,) [-].

        Raises
        ------
        RunBroken
            If the active set does not settle.
        """
        n, m = line.height.size, line.droppers.size
        push, softness = np.empty(n), np.empty((n, n))
        kernels.press(
            np.array(heads).reshape(n, 4),
            line.height,
            line.rate,
            line.height_by_force,
            line.rate_by_force,
            self._k,
            self._c,
            push,
            softness,
        )
        always = np.full(n, self._may_pull)
        force, rounds = self._settle(softness, push, always)
        slack = np.zeros(m)
        if m and kernels.any_pushed(line.tension, line.tension_by_force, force):
            force, slack, rounds = self._with_slack(line, push, softness, tension_by_slack, always)
        height = line.height + line.height_by_force @ force
        if m:
            height -= line.height_by_slack.T @ slack
        return InnerSolution(force, slack, height, rounds)

    def _with_slack(
        self,
        line: LineResponse,
        push: np.ndarray,
        softness: np.ndarray,
        tension_by_slack: Callable[[np.ndarray], np.ndarray],
        always: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Contact forces (n,) and compensations (m,) together [N], and the rounds needed."""
        n, m = push.size, line.tension.size
        matrix = np.empty((n + m, n + m))
        matrix[:n, :n] = softness
        matrix[:n, n:] = -(self._k * line.height_by_slack + self._c * line.rate_by_slack).T
        matrix[n:, :n] = self._released * line.tension_by_force
        matrix[n:, n:] = np.eye(m) - self._released * tension_by_slack(line.droppers)
        right = np.concatenate([push, -self._released * line.tension])
        solution, rounds = self._settle(
            matrix, right, np.concatenate([always, np.zeros(m, dtype=bool)])
        )
        return solution[:n], solution[n:], rounds

    def _settle(
        self, matrix: np.ndarray, right: np.ndarray, always: np.ndarray
    ) -> tuple[np.ndarray, int]:
        """Solve x = max(0, x - (matrix x - right)) entry by entry, or freely where ``always``."""
        solution, rounds = kernels.settle(matrix, right, always, _MAX_ROUNDS)
        if rounds > 0:
            return solution, rounds
        return self._pivot(matrix, right, always, -rounds)

    @staticmethod
    def _pivot(
        matrix: np.ndarray, right: np.ndarray, always: np.ndarray, rounds: int
    ) -> tuple[np.ndarray, int]:
        """Murty's least-index pivoting: slower, but it cannot cycle for a P-matrix."""
        acts = always.copy()
        solution = np.zeros(right.size)
        scale = 1e-12 * (1.0 + np.abs(right).max())
        for extra in range(1, 20 * right.size + 100):
            kernels.solve_on(matrix, right, acts, solution)
            residual = matrix @ solution - right
            wrong = np.where(acts, (solution < -scale) & ~always, residual < -scale)
            if not wrong.any():
                return solution, rounds + extra
            first = int(np.argmax(wrong))
            acts[first] = not acts[first]
        raise RunBroken("contacts and slack droppers of this step have no common solution")
