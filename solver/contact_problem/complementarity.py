"""The small dense problem of a step: contact forces and switching links, solved exactly.

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
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import NotConverged, RunBroken
from catenary.solver.contact.head_states import Heads
from catenary.solver.contact.line_response import Affine, Coupled, LineResponse, Share, affine
from catenary.solver.contact_problem.law_tangents import LawInSteps, Tangents
from catenary.solver.kernels import native


class System(NamedTuple):
    """matrix x = right of m unknowns, the length of ``right``; the matrix may have more of both.

    This and the room for solving it are as ``kernels/contact_problem/active_set.hpp`` and
    ``room.hpp`` take them.
    """

    matrix: np.ndarray
    right: np.ndarray
    solution: np.ndarray


class Signs(NamedTuple):
    """Of m unknowns: which may have any sign, ``always``; of a dependent's how many rows its
    leader's is before it, which it acts with, 0 of others, ``behind``."""

    always: np.ndarray
    behind: np.ndarray


class PathRoom(NamedTuple):
    """Room for a path of simplices in up to n dimensions: ``columns`` (n + 1, n + 1), ``numbers``
    (7, n + 1), ``counts`` (4, n + 1), ``all`` (n + 1,)."""

    columns: np.ndarray
    numbers: np.ndarray
    counts: np.ndarray
    all: np.ndarray


class PivotRoom(NamedTuple):
    """Room to pivot with up to k unknowns: ``needs``, ``excludes`` and ``partly`` (k, k),
    ``turned`` (20 k + 100,), ``numbers`` (4, k), ``counts`` (2, k), ``marks`` (3, k), ``path`` in
    k / 2 dimensions."""

    needs: np.ndarray
    excludes: np.ndarray
    turned: np.ndarray
    partly: np.ndarray
    numbers: np.ndarray
    counts: np.ndarray
    marks: np.ndarray
    path: PathRoom


class Room(NamedTuple):
    """Room to solve for up to k unknowns: ``factors`` (k, k), ``pivoting``, the others (k,)."""

    factors: np.ndarray
    acting: np.ndarray
    order: np.ndarray
    left: np.ndarray
    change: np.ndarray
    acts: np.ndarray
    before: np.ndarray
    pivoting: PivotRoom


def room_for(k: int) -> Room:
    """Room to solve for up to k unknowns."""
    acting, order = np.zeros((2, k), dtype=np.int64)
    left, change = np.zeros((2, k))
    acts, before = np.zeros((2, k), dtype=bool)
    n = k // 2 + 1
    counts = np.zeros((4, n), dtype=np.int64)
    path = PathRoom(np.zeros((n, n)), np.zeros((7, n)), counts, np.zeros(n, dtype=bool))
    needs, excludes = np.zeros((2, k, k), dtype=bool)
    pivoting = PivotRoom(
        needs,
        excludes,
        turned=np.zeros(20 * k + 100, dtype=np.int64),
        partly=np.zeros((k, k)),
        numbers=np.zeros((4, k)),
        counts=np.zeros((2, k), dtype=np.int64),
        marks=np.zeros((3, k), dtype=bool),
        path=path,
    )
    return Room(np.zeros((k, k)), acting, order, left, change, acts, before, pivoting)


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


class Unknowns(NamedTuple):
    """Room for the small problem with up to k unknowns: the contact forces, then compensations.

    ``always`` and ``behind`` (k,) are ``Signs``, ``matrix`` (k, k), ``right`` and ``solution`` (k,)
    a ``System``.
    """

    always: np.ndarray
    behind: np.ndarray
    matrix: np.ndarray
    right: np.ndarray
    solution: np.ndarray
    room: Room


class Depths(NamedTuple):
    """Depths [m] and rates [m/s] of the gap at n contacts under forces, (n,) each."""

    depth: np.ndarray
    rate: np.ndarray


class SmallProblem(NamedTuple):
    """Small problem as kernels solve it; see ``small_problem.hpp``.

    Attributes
    ----------
    heads, gap : Affine of the heads at the contacts, and room for that of the depths
    share : of the line, summed over ranks
    pulls : whether forces of contacts whose wire is on the strip may have any sign
    tangents : of the contact law
    coupled : all links
    unknowns : room for the problem, in which the solution is left
    found : Depths under the solution
    max_rounds : of the active-set iteration
    """

    heads: Affine
    share: Share
    gap: Affine
    pulls: bool
    tangents: Tangents
    coupled: Coupled
    unknowns: Unknowns
    found: Depths
    max_rounds: int


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


class Gap:
    """Depths and rates at n contacts as functions of contact forces and compensations.

    Attributes
    ----------
    affine : Affine of depths [m], their rates [m/s] without forces, and what forces take off them
    found : Depths under the forces looked at last
    line : whose answers these are
    """

    def __init__(self, n: int) -> None:
        self.affine = affine(np.zeros(2 * n * (1 + n)), n)
        self.found = Depths(*np.zeros((2, n)))
        self.line = LineResponse(n, 0)

    def put(self, line: LineResponse, heads: Heads) -> None:
        """Take the answers of both sides for this step.

        Raises
        ------
        RunBroken
            If one of them is no number; it would compare as out of contact and go unnoticed.
        """
        self.line = line
        if not native.subtract(heads.affine, line.line, line.present, self.affine):
            raise RunBroken(NOT_FINITE)

    def under(self, force: np.ndarray, slack: np.ndarray) -> Depths:
        """Depths [m] and rates [m/s] under contact forces ``force`` (n,) [N] and compensations
        ``slack`` (m,) [N]; overwritten by the next call.

        Raises
        ------
        RunBroken
            If one of them is not finite: the problem that gave the forces has no solution.
        """
        if not native.under(self.affine, self.line.rows, force, slack, self.found):
            raise RunBroken(NOT_FINITE)
        return self.found


class InnerProblem:
    """Solves the inner problem through both compliances: the linearly implicit coupling.

    Lives on rank 0; not collective.

    Parameters
    ----------
    law : LawInSteps
    coupled : all links of the line; none if no link switches

    Attributes
    ----------
    pivoted : whether an active set has cycled since this was last set to False
    unknowns : room for the problem, another one when more links need some
    """

    def __init__(self, law: LawInSteps, coupled: Coupled) -> None:
        self.law = law
        self.gap = Gap(law.n)
        self.coupled = coupled
        self.pivoted = False
        self._room = -1
        self._bound_to: tuple[Affine | None, LineResponse | None]
        self.make_room(_FIRST_ROOM)

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
        """Compensations (m,) [N] under given contact forces (n,) [N].

        Raises
        ------
        NotConverged
            If there are none.
        """
        n, m = self.law.n, line.count
        coupled = self.coupled
        if not m or not native.any_switched(line.rows, m, coupled, force):
            return np.zeros(m)
        if m > self._room:
            self.make_room(m)
        _, behind, matrix, right, _, room = self.unknowns
        none, links = np.zeros(n), slice(n, n + m)
        native.couple(line.rows, m, coupled, none, none, self.unknowns)
        own = right[links] - matrix[links, :n] @ force
        system = System(matrix[links, links].copy(), own, np.zeros(m))
        signs = Signs(np.zeros(m, dtype=bool), behind[links])
        rounds, pivoted = native.find_solution(system, signs, _MAX_ROUNDS, room)
        self.pivoted |= pivoted
        if rounds <= 0:
            raise NotConverged(_NO_SOLUTION)
        return system.solution

    def covers(self, line: LineResponse, force: np.ndarray, slack: np.ndarray) -> bool:
        """Whether every link that switches under contact forces ``force`` (n,) [N] has a row in
        ``line``; ``slack`` (m,) are the compensations of the links with a row [N]."""
        return not native.leaves_out(force, slack, line.rows, line.bounds, self.coupled)

    def _with_law(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces and compensations for a law that is not linear, by Newton's method."""
        gap, law = self.gap, self.law
        # Without a force heads stand highest: from there Newton's method comes from one side.
        gap.put(line, heads)
        law.linearise(gap.affine.place, gap.affine.rate)
        rounds = 0
        for number in range(native.MOST_TANGENTS):
            found = self._with_tangents(line, heads)
            rounds += found.rounds
            law.linearise(found.depth, found.rate)
            forces = found.contact_force, found.compensation
            if native.agrees(gap.affine, line.rows, *forces, law, number):
                return found._replace(rounds=rounds)
        raise NotConverged(
            f"the contact law finds no force within {native.MOST_TANGENTS} tangents; take a "
            "smaller numerics.dt_s"
        )

    def _with_tangents(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces and compensations for the law's tangents."""
        gap, n, m = self.gap, self.law.n, line.count
        if m > self._room:
            self.make_room(m)
        gap.line = line
        if self._bound_to[0] is not heads.affine or self._bound_to[1] is not line:
            # Mostly they are those of the step before.
            self._bound_to = heads.affine, line
            self._solve = native.solve.bound(self.problem(heads.affine, line))
        rounds, size, finite, complete, pivoted = self._solve()
        self.pivoted |= pivoted
        if rounds <= 0:
            raise NotConverged(_NO_SOLUTION)
        if not finite:
            raise RunBroken(NOT_FINITE)
        solution = self.unknowns.solution
        found = solution[:n], solution[n:size], *gap.found
        return InnerSolution(*found, rounds, self.pivoted, complete)

    def problem(self, heads: Affine, line: LineResponse) -> SmallProblem:
        """Small problem as kernels solve it; ``unknowns`` are others when more links need room."""
        return SmallProblem(
            heads=heads,
            share=line.share,
            gap=self.gap.affine,
            pulls=self.law.pulls,
            tangents=self.law.tangents,
            coupled=self.coupled,
            unknowns=self.unknowns,
            found=self.gap.found,
            max_rounds=_MAX_ROUNDS,
        )

    def make_room(self, n_links: int) -> None:
        """Make room for at least so many links with a row; ``unknowns`` are then others."""
        n = self.law.n
        self._room = max(n_links, 2 * self._room)
        size = n + self._room
        always = np.zeros(size, dtype=bool)
        always[:n] = self.law.pulls
        behind = np.zeros(size, dtype=np.int64)
        system = System(np.zeros((size, size)), *np.zeros((2, size)))
        self.unknowns = Unknowns(always, behind, *system, room_for(size))
        self._bound_to = None, None
