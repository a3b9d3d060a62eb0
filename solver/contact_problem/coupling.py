"""Coupling of line and pantographs by the contact forces of a step: three schemes.

``implicit`` (the default) solves for the forces through both compliances; see `complementarity`.
The two of this module are the ways of programs that exchange forces and motions only, kept to be
compared:

    explicit   the law at what both sides extrapolate to (the paper's, section 4)
    iterated   the law at what both sides answer to the forces before, until these agree

Both lose their stability where the contact is stiff for the mass that a step moves: see
docs/theory/one_solve.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from catenary.base.errors import NotConverged, RunBroken
from catenary.solver.contact.head_states import Heads
from catenary.solver.contact.line_response import LineResponse
from catenary.solver.contact_problem.complementarity import InnerProblem, InnerSolution
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.kernels import native
from catenary.solver.problem.problem import Numerics

# Forces that grow beyond this [N] will not come back.
DIVERGED = 1e9


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
