"""The small dense problem of a step: contact forces and slack droppers, solved exactly.

All forces act through the line's and the pantographs' compliance within the step:

    h_i = h0_i + sum_j B_ij f_j - sum_d P_di s_d          wire height at contact i
    z_i = z0_i - sum_j C_ij f_j                           height of a strip of the head
    T_d = T0_d + sum_j Q_dj f_j - sum_e G_de s_e          what dropper d would carry if it pushed
    f_i = max(0, law(delta_i, delta_i')),  delta = z - h  contact law
    s_d = (1 - r) max(0, -T_d)                            compensation of a slack dropper (2.7)

T_d is the tension, or that of the spring alone where dampers of slack droppers are kept in action.

With the law linear, or replaced by its tangent, this is a linear complementarity problem. Its
matrix is a P-matrix, so that it has one solution, unless the convective part of a contact damper
outweighs the compliances (docs/theory.md). An active-set iteration (semismooth Newton) finds it,
mostly in one or two rounds; a set that cycles is handed to least-index pivoting, and a step without
solution ends the run with a sentence. A law that is not linear is linearised again at what was
found: Newton's method, which for a convex spring comes from one side and cannot overshoot.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from catenary.solver.base.bound import bound
from catenary.solver.base.errors import NotConverged, RunBroken
from catenary.solver.contact.head_states import Heads
from catenary.solver.contact.line_response import LineResponse
from catenary.solver.contact_problem import complementarity_kernels
from catenary.solver.contact_problem.law_tangents import LawInSteps

# Mostly one or two rounds are needed; a set that cycles shows within a few.
_MAX_ROUNDS = 30
# Newton's method on a law doubles its digits with each tangent.
_MAX_TANGENTS = 50
# Where so many do not do, round-off is looked at: large terms may cancel in depths and rates.
_USUAL_TANGENTS = 12
# A term of a sum is known to some roundings of itself.
_ROUNDING = 8.0 * np.finfo(float).eps
# What there is to say of a step that holds something that is no number.
NOT_FINITE = "it has no finite solution; try a smaller numerics.dt_s"
# Answers that no loop works on yet.
_NOTHING: tuple[np.ndarray, np.ndarray] = (np.zeros(0), np.zeros(0))
# Droppers that the arrays have room for at first.
_FIRST_ROOM = 32


class InnerSolution(NamedTuple):
    """What a step's forces are; the arrays are overwritten by the next step.

    ``contact_force`` (n,) [N]; ``compensation`` (m,) [N] of the droppers with a row; ``depth`` (n,)
    [m] and its ``rate`` (n,) [m/s] at the contacts; ``rounds`` of all iterations; ``pivoted``
    whether an active set cycled, so that pivoting had to find it; ``complete`` whether all droppers
    that are slack had a row, the limits of the line's response being large enough.
    """

    contact_force: np.ndarray
    compensation: np.ndarray
    depth: np.ndarray
    rate: np.ndarray
    rounds: int
    pivoted: bool = False
    complete: bool = True


class Gap:
    """Depths and rates at n contacts as functions of contact forces and compensations.

    Attributes
    ----------
    depth, rate : (n,) without forces [m], [m/s]
    depth_by_force, rate_by_force : (n, n) what forces take off them [m/N], [m/(N s)]
    numbers : (2 n + 2 n^2,) these four one after the other
    found : (2, n) depths and rates under the forces looked at last
    found_depth, found_rate : (n,) its rows
    line : whose answers these are
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self.numbers = np.zeros(2 * n * (1 + n))
        self.depth, self.rate = self.numbers[:n], self.numbers[n : 2 * n]
        compliances = self.numbers[2 * n :].reshape(2, n, n)
        self.depth_by_force, self.rate_by_force = compliances
        self.found = np.zeros((2, n))
        self.found_depth, self.found_rate = self.found
        self.line = LineResponse(n, 0)

    def put(self, line: LineResponse, heads: Heads) -> None:
        """Take the answers of both sides for this step.

        Raises
        ------
        RunBroken
            If one of them is no number; it would compare as out of contact and go unnoticed.
        """
        self.line = line
        if not complementarity_kernels.gap(heads.numbers, line.answers, self._n, self.numbers):
            raise RunBroken(NOT_FINITE)

    def under(self, force: np.ndarray, slack: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths [m] and rates [m/s] under forces (n,) and compensations (m,) [N]; overwritten by
        the next call.

        Raises
        ------
        RunBroken
            If one of them is no number: what was to give the forces has no solution.
        """
        rows, found = self.line.rows, self.found
        if not complementarity_kernels.under(self.numbers, rows, slack.size, force, slack, found):
            raise RunBroken(NOT_FINITE)
        return self.found_depth, self.found_rate

    def rounding(self, force: np.ndarray, slack: np.ndarray) -> np.ndarray:
        """What depths [m] and rates [m/s] of ``under`` may be wrong by, (2, n)."""
        pushed, line = np.abs(force), self.line
        depth = np.abs(self.depth) + np.abs(self.depth_by_force) @ pushed
        rate = np.abs(self.rate) + np.abs(self.rate_by_force) @ pushed
        if slack.size:
            depth += np.abs(line.couplings(1)).T @ np.abs(slack)
            rate += np.abs(line.couplings(2)).T @ np.abs(slack)
        return _ROUNDING * np.stack([depth, rate])


class InnerProblem:
    """Solves the inner problem through both compliances: the linearly implicit coupling.

    Lives on rank 0; not collective.

    Parameters
    ----------
    law : LawInSteps
    kept_ratio : share r of its stiffness that a slack dropper keeps
    band : (n_droppers, 2 half + 1), ``band[e, d - e + half]`` is G_de [-]; (0, 1) if droppers do
        not slacken

    Attributes
    ----------
    pivoted : whether an active set has cycled since this was last set to False
    """

    def __init__(self, law: LawInSteps, kept_ratio: float, band: np.ndarray) -> None:
        self.law = law
        self.gap = Gap(law.n)
        self._no_rounding = np.zeros((2, law.n))
        self._released = 1.0 - kept_ratio
        self._band, self._drop = band, np.zeros(band.shape[0])
        self.pivoted = False
        self._room = -1
        self._make_room(_FIRST_ROOM)

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces of the step.

        Raises
        ------
        RunBroken
            If the active set does not settle.
        """
        self.pivoted = False
        if self.law.is_linear:
            return self._with_tangents(line, heads)
        return self._with_law(line, heads)

    def slack_under(self, line: LineResponse, force: np.ndarray) -> np.ndarray:
        """Compensations (m,) [N] under given contact forces (n,) [N]."""
        n, m = self.law.n, line.count
        if not m or not complementarity_kernels.any_pushed(line.rows, m, n, force):
            return np.zeros(m)
        if m > self._room:
            self._make_room(m)
        push = np.zeros((2, n))
        complementarity_kernels.couple(
            line.rows, m, n, self._released, self._band, push, self._matrix, self._right
        )
        matrix = self._matrix[n : n + m, n : n + m].copy()
        right = self._right[n : n + m] - self._released * (line.couplings(0) @ force)
        always, solution = np.zeros(m, dtype=bool), np.zeros(m)
        rounds = complementarity_kernels.settle(matrix, right, always, solution, _MAX_ROUNDS)
        if rounds <= 0:
            self.pivoted = True
            _pivot(matrix, right, always, solution)
        return solution

    def covers(self, line: LineResponse, force: np.ndarray, slack: np.ndarray) -> bool:
        """Whether all droppers that are slack under forces (n,) and compensations (m,) [N] had a
        row."""
        return not complementarity_kernels.leaves_out(
            force, slack, line.rows, line.limits, self._band, self._drop
        )

    def _with_law(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces and compensations for a law that is not linear, by Newton's method."""
        gap, law = self.gap, self.law
        # Without a force heads stand highest: from there Newton's method comes from one side.
        gap.put(line, heads)
        law.linearise(gap.depth, gap.rate)
        rounds = 0
        for number in range(_MAX_TANGENTS):
            found = self._with_tangents(line, heads)
            rounds += found.rounds
            law.linearise(found.depth, found.rate)
            looks = number >= _USUAL_TANGENTS
            force = found.contact_force
            rounding = gap.rounding(force, found.compensation) if looks else self._no_rounding
            if law.agrees(force, rounding):
                return found._replace(rounds=rounds)
        raise NotConverged(
            f"the contact law finds no force within {_MAX_TANGENTS} tangents; take a smaller "
            "numerics.dt_s"
        )

    def _with_tangents(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces and compensations for the law's tangents."""
        gap, n, m = self.gap, self.law.n, line.count
        if m > self._room:
            self._make_room(m)
        gap.line = line
        if self._bound_to[0] is not heads.numbers or self._bound_to[1] is not line.rows:
            self._bind(heads, line)
        rounds, size, finite, complete = self._solve()
        if rounds <= 0:
            self.pivoted = True
            matrix, right = self._matrix[:size, :size].copy(), self._right[:size].copy()
            rounds = _pivot(matrix, right, self._always[:size], self._solution[:size]) - rounds
            force = self._solution[:n]
            if size == n and m and complementarity_kernels.any_pushed(line.rows, m, n, force):
                size, rounds = self._with_all(line, rounds)
            gap.under(force, self._solution[n:size])
            complete = self.covers(line, force, self._solution[n:size])
        elif not finite:
            raise RunBroken(NOT_FINITE)
        slack = self._solution[n:size] if size > n else self._no_slack
        depth, rate = gap.found_depth, gap.found_rate
        return InnerSolution(self._force, slack, depth, rate, rounds, self.pivoted, complete)

    def _with_all(self, line: LineResponse, rounds: int) -> tuple[int, int]:
        """Unknowns and rounds by pivoting, droppers included, where contacts alone needed it."""
        n, size = self.law.n, self.law.n + line.count
        complementarity_kernels.couple(
            line.rows, line.count, n, self._released, self._band, self.law.tangents[2:],
            self._matrix, self._right,
        )  # fmt: skip
        matrix, right = self._matrix[:size, :size].copy(), self._right[:size].copy()
        rounds += _pivot(matrix, right, self._always[:size], self._solution[:size])
        return size, rounds

    def _bind(self, heads: Heads, line: LineResponse) -> None:
        """Let the compiled loop work on these answers, mostly those of the step before."""
        self._bound_to = heads.numbers, line.rows
        self._solve = bound(complementarity_kernels.solve, *self.solving(heads.numbers, line))

    def solving(self, heads: np.ndarray, line: LineResponse) -> tuple[Any, ...]:
        """Arguments of ``inner_kernels.solve``; some are others when more droppers need room.

        ``heads`` (2 n + 2 n^2,) are the numbers of a ``HeadState``.
        """
        return (
            heads,
            line.summed,
            line.rows,
            line.limits,
            self.gap.numbers,
            self.law.tangents,
            self._released,
            self._band,
            self._always,
            self._matrix,
            self._right,
            self._solution,
            self.gap.found,
            self._drop,
            _MAX_ROUNDS,
        )

    def _make_room(self, n_droppers: int) -> None:
        n = self.law.n
        self._room = max(n_droppers, 2 * self._room)
        size = n + self._room
        self._matrix, self._right = np.zeros((size, size)), np.zeros(size)
        self._solution = np.zeros(size)
        self._force, self._no_slack = self._solution[:n], self._solution[:0]
        self._always = np.zeros(size, dtype=bool)
        self._always[:n] = self.law.pulls
        self._bound_to = _NOTHING


def _pivot(matrix: np.ndarray, right: np.ndarray, always: np.ndarray, solution: np.ndarray) -> int:
    """Murty's least-index pivoting: slower, but it cannot cycle for a P-matrix.

    Fills the solution and returns the rounds needed.
    """
    acts = always.copy()
    scale = 1e-12 * (1.0 + np.abs(right).max())
    for rounds in range(1, 20 * right.size + 100):
        complementarity_kernels.solve_on(matrix, right, acts, solution)
        residual = matrix @ solution - right
        wrong = np.where(acts, (solution < -scale) & ~always, residual < -scale)
        if not wrong.any():
            return rounds
        first = int(np.argmax(wrong))
        acts[first] = not acts[first]
    raise NotConverged(
        "contacts and slack droppers of this step have no common solution; take a smaller "
        "numerics.dt_s or less contact damping"
    )
