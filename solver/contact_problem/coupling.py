"""Coupling of line and pantographs by a step's contact forces: three schemes, one small problem.

All forces act through the line's and the pantographs' compliance within the step:

    h_i = h0_i + sum_j B_ij f_j - sum_d P_di s_d          wire height at contact i
    z_i = z0_i - sum_j C_ij f_j                           height of a strip of the head
    R_d = R0_d + sum_j Q_dj f_j - sum_e G_de s_e          reserve of link d
    f_i = max(0, law(delta_i, delta_i')),  delta = z - h  contact law
    s_d = released_d max(0, -R_d)                         compensation of a link (2.7)

The reserve of a dropper is the tension that it would carry if it pushed, or that of its spring
alone where dampers of slack droppers are kept in action; a share r of its stiffness may be kept,
released = 1 - r. Stops and others with a gap, and dependents, whose s has any sign while that of
their leader is not zero: `model.switching_links`.

With the law linear, or replaced by its tangent, this is a linear complementarity problem. Its
matrix is a P-matrix, so that it has one solution, unless the convective part of a contact damper
outweighs the compliances, or there are dependents (docs/theory/one_solve.md). An active-set
iteration (semismooth Newton) finds it, mostly in one or two rounds; a set that cycles is handed to
pivoting, and a step without solution ends the run with a sentence. A law that is not linear is
linearised again at what was found: Newton's method, which for a convex spring comes from one side
and cannot overshoot.

The coupling ``implicit`` (the default) solves this problem exactly. Two others are the ways of
programs that exchange forces and motions only, kept to be compared:

    explicit   the law at what both sides extrapolate to (the paper's, section 4)
    iterated   the law at what both sides answer to the forces before, until these agree

Both lose their stability where the contact is stiff for the mass that a step moves: see
docs/theory/one_solve.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from catenary.base.errors import NotConverged, RunBroken
from catenary.mbs.interface import affine
from catenary.solver.contact.pantographs import Heads
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.kernels import native
from catenary.solver.problem.problem import Numerics

# Mostly one or two rounds are needed; a set that cycles shows within a few.
_MAX_ROUNDS = 30
# Message of a step that holds NaN or infinity.
NOT_FINITE = "it has no finite solution; try a smaller numerics.dt_s"
_NO_SOLUTION = (
    "contacts and slack droppers of this step have no common solution; take a smaller "
    "numerics.dt_s or less contact damping"
)
# Links that the arrays have room for at first.
_FIRST_ROOM = 32
# Forces that grow beyond this [N] will not come back.
DIVERGED = 1e9


class InnerSolution(NamedTuple):
    """Forces of a step; the arrays are overwritten by the next step.

    ``contact_force`` (n,) [N]; ``compensation`` (m,) [N] of the links with a row; ``depth`` (n,)
    [m] and its ``rate`` (n,) [m/s] at the contacts; ``rounds`` of all iterations; ``pivoted``
    whether an active set cycled, so that pivoting had to find it; ``complete`` whether all links
    that have switched had a row, the bounds of the line's response being large enough.
    """

    contact_force: np.ndarray
    compensation: np.ndarray
    depth: np.ndarray
    rate: np.ndarray
    rounds: int
    pivoted: bool = False
    complete: bool = True


class InnerProblem:
    """Solves the inner problem through both compliances: the linearly implicit coupling.

    Lives on rank 0; not collective.

    Parameters
    ----------
    law : LawInSteps
    coupled : all links of the line; none if no link switches

    Attributes
    ----------
    gap : Affine of depths [m], their rates [m/s] without forces, and what forces take off them
    found : Depths under the forces looked at last
    pivoted : whether an active set has cycled since this was last set to False
    room : room for the problem, another one when more links need some
    """

    def __init__(self, law: LawInSteps, coupled: native.Coupled) -> None:
        self.law = law
        self.gap = affine(np.zeros(2 * law.n * (1 + law.n)), law.n)
        self.found = native.Depths(*np.zeros((2, law.n)))
        self.coupled = coupled
        self.pivoted = False
        self._room = -1
        self._bound_to: tuple[native.Affine | None, LineResponse | None]
        self.make_room(_FIRST_ROOM)

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces of the step.

        Raises
        ------
        RunBroken
            If the active set does not settle, or a law that is not linear finds no force.
        """
        n, m = self.law.n, line.count
        if m > self._room:
            self.make_room(m)
        if self._bound_to[0] is not heads.affine or self._bound_to[1] is not line:
            # Mostly they are those of the step before.
            self._bound_to = heads.affine, line
            problem = self.problem(heads.affine, line)
            self._solve = native.solve.bound(problem, self.law.marched)
        rounds, size, finite, complete, self.pivoted = self._solve()
        if rounds < 0:
            raise NotConverged(_NO_SOLUTION)
        if not finite:
            raise RunBroken(NOT_FINITE)
        if rounds == 0:
            raise NotConverged(
                f"the contact law finds no force within {native.MOST_TANGENTS} tangents; take a "
                "smaller numerics.dt_s"
            )
        depth, rate = self.found
        forces = self._solution[:n], self._solution[n:size]
        return InnerSolution(*forces, depth, rate, rounds, self.pivoted, complete)

    def slack_under(self, line: LineResponse, force: np.ndarray) -> np.ndarray:
        """Compensations (m,) [N] under given contact forces (n,) [N].

        Raises
        ------
        NotConverged
            If there are none.
        """
        m = line.count
        if m > self._room:
            self.make_room(m)
        links = line.rows, m, self.coupled
        rounds, pivoted = native.slack_under(*links, force, _MAX_ROUNDS, self.room)
        self.pivoted |= pivoted
        if rounds <= 0:
            raise NotConverged(_NO_SOLUTION)
        return self._solution[:m].copy()

    def take(self, line: LineResponse, heads: Heads) -> None:
        """Take the gap without forces from the answers of both sides for this step.

        Raises
        ------
        RunBroken
            If one of them is no number; it would compare as out of contact and go unnoticed.
        """
        if not native.subtract(heads.affine, line.line, line.present, self.gap):
            raise RunBroken(NOT_FINITE)

    def under(self, line: LineResponse, force: np.ndarray, slack: np.ndarray) -> native.Depths:
        """Depths [m] and rates [m/s] under contact forces ``force`` (n,) [N] and compensations
        ``slack`` (m,) [N] of links in ``line``; overwritten by the next call.

        Raises
        ------
        RunBroken
            If one of them is not finite: the problem that gave the forces has no solution.
        """
        if not native.under(self.gap, line.rows, force, slack, self.found):
            raise RunBroken(NOT_FINITE)
        return self.found

    def covers(self, line: LineResponse, force: np.ndarray, slack: np.ndarray) -> bool:
        """Whether every link that switches under contact forces ``force`` (n,) [N] has a row in
        ``line``; ``slack`` (m,) are the compensations of the links with a row [N]."""
        return not native.leaves_out(force, slack, line.rows, line.bounds, self.coupled)

    def problem(self, heads: native.Affine, line: LineResponse) -> native.SmallProblem:
        """Small problem as kernels solve it; ``room`` is another one when more links need it."""
        return native.SmallProblem(
            heads=heads,
            share=line.arrays,
            gap=self.gap,
            pulls=self.law.pulls,
            tangents=self.law.tangents,
            coupled=self.coupled,
            room=self.room,
            found=self.found,
            max_rounds=_MAX_ROUNDS,
        )

    def make_room(self, n_links: int) -> None:
        """Make room for at least so many links with a row; ``room`` is then another one."""
        self._room = max(n_links, 2 * self._room)
        self.room = native.Room(self.law.n + self._room)
        self._solution = self.room.solution
        self._bound_to = None, None


class Coupling(ABC):
    """Finds the forces of a step. Lives on rank 0; not collective.

    ``extrapolates`` is whether it needs heights and rates extrapolated from both motions.
    """

    extrapolates = False

    def __init__(self, inner: InnerProblem) -> None:
        self.inner, self.law = inner, inner.law

    @abstractmethod
    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Contact forces and compensations of slack droppers.

        Raises
        ------
        RunBroken
            If none are found.
        """

    def state(self) -> np.ndarray:
        """Memory from step to step, as one array; mostly that of the law."""
        return self.law.state()

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self.law.restore(state)

    def _applied(self, force: np.ndarray, line: LineResponse) -> np.ndarray:
        """A copy of the law's forces (n,) [N]: none where no wire is, none that pull unless the law
        has these; RunBroken if they diverge."""
        least = -np.inf if self.law.pulls else 0.0
        applied = np.where(line.present == 0.0, 0.0, np.maximum(force, least))
        # Also true for what is no number.
        if not (np.abs(applied) < DIVERGED).all():
            raise RunBroken(
                "the contact force grows beyond all bounds: the coupling is unstable at this step; "
                'take numerics.coupling = "implicit" or a smaller numerics.dt_s'
            )
        return applied

    def _answered(
        self, line: LineResponse, force: np.ndarray, slack: np.ndarray, rounds: int
    ) -> InnerSolution:
        """The solution with forces and compensations, from both sides' answers in the gap."""
        inner = self.inner
        depth, rate = inner.under(line, force, slack)
        complete = inner.covers(line, force, slack)
        return InnerSolution(force, slack, depth, rate, rounds, inner.pivoted, complete)


class Implicit(Coupling):
    """Linearly implicit through both compliances, stable for every stiffness and mass."""

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        return self.inner.solve(line, heads)


class Explicit(Coupling):
    """Forces from the extrapolated motion of both sides; droppers answer to them.

    ``line.early_height`` and ``early_rate`` (n,) and ``heads.early_height`` and ``early_velocity``
    (n,) hold the extrapolation.
    """

    extrapolates = True

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        depth = heads.early_height - line.early_height
        depth[line.present == 0.0] = native.NOWHERE
        force = self._applied(self.law.force(depth, heads.early_velocity - line.early_rate), line)
        self.inner.pivoted = False
        slack = self.inner.slack_under(line, force)
        self.inner.take(line, heads)
        return self._answered(line, force, slack, 1)


class Iterated(Coupling):
    """Forces and motions exchanged until they agree, which starts from the step before.

    Parameters
    ----------
    tolerance : largest difference of a force between two exchanges [N]
    max_iterations : exchanges a step
    """

    def __init__(self, inner: InnerProblem, tolerance: float, max_iterations: int) -> None:
        super().__init__(inner)
        self._tolerance = tolerance
        self._max_iterations = max_iterations
        self._latest = np.zeros(inner.law.n)

    def state(self) -> np.ndarray:
        """The latest forces, from which the next step starts, and what the law remembers."""
        return np.concatenate([self._latest, super().state()])

    def restore(self, state: np.ndarray) -> None:
        n = self._latest.size
        self._latest = state[:n].copy()
        super().restore(state[n:])

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        inner, force = self.inner, self._latest
        inner.take(line, heads)
        inner.pivoted = False
        slack = inner.slack_under(line, force)
        for number in range(1, self._max_iterations + 1):
            new = self._applied(self.law.force(*inner.under(line, force, slack)), line)
            change = float(np.abs(new - force).max(initial=0.0))
            force, slack = new, inner.slack_under(line, new)
            if change <= self._tolerance:
                self._latest = force
                return self._answered(line, force, slack, number)
        raise NotConverged(
            f"line and pantographs do not agree on the contact forces within "
            f"{self._max_iterations} exchanges (numerics.max_iterations): these still change by "
            f'{change:.3g} N; take numerics.coupling = "implicit" or a smaller numerics.dt_s'
        )


def make_coupling(law: LawInSteps, coupled: native.Coupled, numerics: Numerics) -> Coupling:
    """The coupling that the numerics ask for; ``coupled`` as for `InnerProblem`."""
    inner = InnerProblem(law, coupled)
    if numerics.coupling == "explicit":
        return Explicit(inner)
    if numerics.coupling == "iterated":
        return Iterated(inner, numerics.eps_force, numerics.max_iterations)
    return Implicit(inner)
