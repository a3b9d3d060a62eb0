"""The small dense problem of a step: contact forces and slack droppers, solved exactly.

All forces act through the line's and the pantographs' compliance within the step:

    h_i = h0_i + sum_j B_ij f_j - sum_d P_di s_d          wire height at contact i
    z_i = z0_i - sum_j C_ij f_j                           height of a strip of the head
    T_d = T0_d + sum_j Q_dj f_j - sum_e G_de s_e          tension of dropper d if it could push
    f_i = max(0, law(delta_i, delta_i')),  delta = z - h  contact law
    s_d = (1 - r) max(0, -T_d)                            compensation of a slack dropper (2.7)

With the law linear, or replaced by its tangent, this is a linear complementarity problem. Its
matrix is a P-matrix, so that it has one solution, unless the convective part of a contact damper
outweighs the compliances (docs/theory.md). An active-set iteration (semismooth Newton) finds it,
mostly in one or two rounds; a set that cycles is handed to least-index pivoting, and a step without
solution ends the run with a sentence. A law that is not linear is linearised again at what was
found: Newton's method, which for a convex spring comes from one side and cannot overshoot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from catenary.solver import kernels
from catenary.solver.errors import RunBroken
from catenary.solver.heads import Heads
from catenary.solver.law_in_steps import LawInSteps

# Mostly one or two rounds are needed; a set that cycles shows within a few.
_MAX_ROUNDS = 30
# Newton's method on a law doubles its digits with each tangent.
_MAX_TANGENTS = 50


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
    early_height, early_rate : (n,) what the line's motion extrapolates to, or (0,) if not asked
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
    early_height: np.ndarray = field(default_factory=lambda: np.zeros(0))
    early_rate: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass
class InnerSolution:
    """Contact forces (n,) [N], compensations (m,) [N], wire heights (n,) [m], depths (n,) [m] and
    their rates (n,) [m/s] at the contacts, rounds of all iterations."""

    contact_force: np.ndarray
    compensation: np.ndarray
    wire_height: np.ndarray
    depth: np.ndarray
    rate: np.ndarray
    rounds: int


TensionBySlack = Callable[[np.ndarray], np.ndarray]


class Gap:
    """Depths and rates at n contacts as functions of contact forces and compensations."""

    def __init__(self, line: LineResponse, heads: Heads) -> None:
        self.line = line
        self.depth = heads.height - line.height
        self.rate = heads.velocity - line.rate
        self.depth_by_force = heads.height_compliance + line.height_by_force
        self.rate_by_force = heads.velocity_compliance + line.rate_by_force

    def under(self, force: np.ndarray, slack: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths [m] and rates [m/s] under forces (n,) and compensations (m,) [N]."""
        depth = self.depth - self.depth_by_force @ force
        rate = self.rate - self.rate_by_force @ force
        if slack.size:
            depth += self.line.height_by_slack.T @ slack
            rate += self.line.rate_by_slack.T @ slack
        return depth, rate

    def solution(self, force: np.ndarray, slack: np.ndarray, rounds: int) -> InnerSolution:
        """Everything that follows from forces (n,) and compensations (m,) [N]."""
        line = self.line
        height = line.height + line.height_by_force @ force
        if slack.size:
            height -= line.height_by_slack.T @ slack
        return InnerSolution(force, slack, height, *self.under(force, slack), rounds)


class InnerProblem:
    """Solves the inner problem through both compliances: the linearly implicit coupling.

    Lives on rank 0; not collective.

    Parameters
    ----------
    law : LawInSteps
    kept_ratio : share r of its stiffness that a slack dropper keeps
    """

    def __init__(self, law: LawInSteps, kept_ratio: float) -> None:
        self.law = law
        self._released = 1.0 - kept_ratio

    def solve(
        self, line: LineResponse, heads: Heads, tension_by_slack: TensionBySlack
    ) -> InnerSolution:
        """Forces of the step; ``tension_by_slack`` gives G (m, m) of some droppers (m,) [-].

        Raises
        ------
        RunBroken
            If the active set does not settle.
        """
        gap, law = Gap(line, heads), self.law
        # Without a force heads stand highest: from there Newton's method comes from one side.
        law.linearise(gap.depth, gap.rate)
        rounds = 0
        for _ in range(_MAX_TANGENTS):
            force, slack, more = self._with_tangents(gap, tension_by_slack)
            rounds += more
            if law.is_linear:
                return gap.solution(force, slack, rounds)
            law.linearise(*gap.under(force, slack))
            if law.agrees(force):
                return gap.solution(force, slack, rounds)
        raise RunBroken("the contact law of this step finds no force")

    def slack_under(
        self, line: LineResponse, force: np.ndarray, tension_by_slack: TensionBySlack
    ) -> tuple[np.ndarray, int]:
        """Compensations (m,) [N] under given contact forces (n,) [N], and the rounds needed."""
        m = line.tension.size
        if not m or not kernels.any_pushed(line.tension, line.tension_by_force, force):
            return np.zeros(m), 0
        matrix = np.eye(m) - self._released * tension_by_slack(line.droppers)
        right = -self._released * (line.tension + line.tension_by_force @ force)
        return _settle(matrix, right, np.zeros(m, dtype=bool))

    def _with_tangents(
        self, gap: Gap, tension_by_slack: TensionBySlack
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Contact forces (n,) and compensations (m,) [N] for the law's tangents, and the rounds."""
        law, line = self.law, gap.line
        n, m = gap.depth.size, line.droppers.size
        push, softness = np.empty(n), np.empty((n, n))
        kernels.press(
            gap.depth,
            gap.rate,
            gap.depth_by_force,
            gap.rate_by_force,
            law.own,
            law.offset,
            law.by_depth,
            law.by_rate,
            push,
            softness,
        )
        always = np.full(n, law.pulls)
        force, rounds = _settle(softness, push, always)
        if m == 0 or not kernels.any_pushed(line.tension, line.tension_by_force, force):
            return force, np.zeros(m), rounds
        matrix = np.empty((n + m, n + m))
        matrix[:n, :n] = softness
        matrix[:n, n:] = -(law.by_depth * line.height_by_slack + law.by_rate * line.rate_by_slack).T
        matrix[n:, :n] = self._released * line.tension_by_force
        matrix[n:, n:] = np.eye(m) - self._released * tension_by_slack(line.droppers)
        right = np.concatenate([push, -self._released * line.tension])
        solution, rounds = _settle(matrix, right, np.concatenate([always, np.zeros(m, dtype=bool)]))
        return solution[:n], solution[n:], rounds


def _settle(matrix: np.ndarray, right: np.ndarray, always: np.ndarray) -> tuple[np.ndarray, int]:
    """Solve x = max(0, x - (matrix x - right)) entry by entry, or freely where ``always``."""
    solution, rounds = kernels.settle(matrix, right, always, _MAX_ROUNDS)
    if rounds > 0:
        return solution, rounds
    return _pivot(matrix, right, always, -rounds)


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
