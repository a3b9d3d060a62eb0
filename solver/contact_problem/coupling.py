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

from typing import Protocol

import numpy as np

from catenary.base.errors import NotConverged, RunBroken
from catenary.solver.contact.head_states import Heads
from catenary.solver.contact.line_response import Coupled, LineResponse
from catenary.solver.contact_problem.complementarity import InnerProblem, InnerSolution
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.kernels.native import NOWHERE
from catenary.solver.problem.problem import Numerics

# Forces that grow beyond this [N] will not come back.
DIVERGED = 1e9


class Coupling(Protocol):
    """Finds the forces of a step. Lives on rank 0; not collective.

    ``extrapolates`` is whether it needs heights and rates extrapolated from both motions.
    """

    extrapolates: bool
    law: LawInSteps

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Contact forces and compensations of slack droppers.

        Raises
        ------
        RunBroken
            If none are found.
        """

    def state(self) -> np.ndarray:
        """Memory from step to step, as one array."""

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""


class _RemembersLaw:
    """Remembers nothing besides what the contact law does."""

    law: LawInSteps

    def state(self) -> np.ndarray:
        """Memory of the law."""
        return self.law.state()

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self.law.restore(state)


class Implicit(_RemembersLaw):
    """Linearly implicit through both compliances, stable for every stiffness and mass.

    Attributes
    ----------
    inner : InnerProblem
    """

    extrapolates = False

    def __init__(self, inner: InnerProblem) -> None:
        self.law = inner.law
        self.inner = inner
        self.solve = inner.solve


class Explicit(_RemembersLaw):
    """Forces from the extrapolated motion of both sides; droppers answer to them.

    ``line.early_height`` and ``early_rate`` (n,) and ``heads.early_height`` and ``early_velocity``
    (n,) hold the extrapolation.
    """

    extrapolates = True

    def __init__(self, inner: InnerProblem) -> None:
        self.law = inner.law
        self._inner = inner

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces of the law at the extrapolation."""
        law = self.law
        depth = heads.early_height - line.early_height
        depth[line.present == 0.0] = NOWHERE
        force = law.force(depth, heads.early_velocity - line.early_rate).copy()
        if not law.pulls:
            np.maximum(force, 0.0, out=force)
        force[line.present == 0.0] = 0.0
        _refuse_diverged(force)
        inner = self._inner
        inner.pivoted = False
        slack = inner.slack_under(line, force)
        inner.gap.put(line, heads)
        depth, rate = inner.gap.under(force, slack)
        complete = inner.covers(line, force, slack)
        return InnerSolution(force, slack, depth, rate, 1, inner.pivoted, complete)


class Iterated:
    """Forces and motions exchanged until they agree, which starts from the step before.

    Parameters
    ----------
    tolerance : largest difference of a force between two exchanges [N]
    max_iterations : exchanges a step
    """

    extrapolates = False

    def __init__(self, inner: InnerProblem, tolerance: float, max_iterations: int) -> None:
        self.law = inner.law
        self._inner = inner
        self._tolerance = tolerance
        self._max_iterations = max_iterations
        self._latest = np.zeros(inner.law.n)

    def state(self) -> np.ndarray:
        """The latest forces, from which the next step starts, and what the law remembers."""
        return np.concatenate([self._latest, self.law.state()])

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        n = self._latest.size
        self._latest = state[:n].copy()
        self.law.restore(state[n:])

    def solve(self, line: LineResponse, heads: Heads) -> InnerSolution:
        """Forces after as many exchanges as they need."""
        gap, law, force = self._inner.gap, self.law, self._latest
        gap.put(line, heads)
        self._inner.pivoted = False
        for number in range(1, self._max_iterations + 1):
            slack = self._inner.slack_under(line, force)
            new = law.force(*gap.under(force, slack)).copy()
            if not law.pulls:
                np.maximum(new, 0.0, out=new)
            new[line.present == 0.0] = 0.0
            _refuse_diverged(new)
            change = float(np.abs(new - force).max(initial=0.0))
            force = new
            if change <= self._tolerance:
                self._latest = force
                slack = self._inner.slack_under(line, force)
                depth, rate = gap.under(force, slack)
                complete = self._inner.covers(line, force, slack)
                return InnerSolution(
                    force, slack, depth, rate, number, self._inner.pivoted, complete
                )
        raise NotConverged(
            f"line and pantographs do not agree on the contact forces within "
            f"{self._max_iterations} exchanges (numerics.max_iterations): these still change by "
            f'{change:.3g} N; take numerics.coupling = "implicit" or a smaller numerics.dt_s'
        )


def make_coupling(law: LawInSteps, coupled: Coupled, numerics: Numerics) -> Coupling:
    """The coupling that the numerics ask for; ``coupled`` as for `InnerProblem`."""
    inner = InnerProblem(law, coupled)
    if numerics.coupling == "explicit":
        return Explicit(inner)
    if numerics.coupling == "iterated":
        return Iterated(inner, numerics.eps_force, numerics.max_iterations)
    return Implicit(inner)


def _refuse_diverged(force: np.ndarray) -> None:
    # Also true for what is no number.
    if not (np.abs(force) < DIVERGED).all():
        raise RunBroken(
            "the contact force grows beyond all bounds: the coupling is unstable at this step; "
            'take numerics.coupling = "implicit" or a smaller numerics.dt_s'
        )
