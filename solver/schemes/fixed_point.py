"""The paper's way through a step: whole solves, repeated until they agree."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catenary.base.errors import NotConverged
from catenary.base.mpi import MPI
from catenary.base.parallel import on_root
from catenary.solver.contact.forces_on_line import ForcesOnLine
from catenary.solver.contact.pantographs import Heads, Pantographs
from catenary.solver.contact_problem.coupling import DIVERGED
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.kernels.native import NOWHERE
from catenary.solver.problem.problem import Numerics
from catenary.solver.schemes.scheme import (
    Counters,
    Scheme,
    StepController,
    StepRejected,
    find_crossings,
)

# A correction that moves any of the line by more than this [m] will not come back.
_FAR = 10.0


@dataclass
class FixedPoint(Scheme):
    """The paper's correction: eqs. (2.4) to (2.7) repeated until the iterates agree.

    Contact forces and the compensation of switched links are evaluated from the latest iterate
    and the whole system is solved again. With a fixed number of ``numerics.iterations`` a step
    goes on with what they have reached; those above the tolerances are counted.
    """

    comm: Any
    interaction: ForcesOnLine
    pantographs: Pantographs
    numerics: Numerics
    law: LawInSteps
    counters: Counters = field(default_factory=Counters)
    judge: StepController | None = None

    def __post_init__(self) -> None:
        n = self.interaction.line.ownership.n_local
        self._predicted = np.zeros((2, n))
        self._latest = np.zeros((2, n))
        self._change = np.zeros((2, n))
        self._heads = Heads(self.pantographs.n_contacts)
        self._force = np.zeros(self.pantographs.n_contacts)
        self._nowhere = np.zeros(self._force.size, dtype=bool)

    # Iterates that grow beyond all numbers are reported by ``_settled``, not by NumPy.
    @np.errstate(over="ignore", invalid="ignore")
    def step(self, time: float, stop: bool) -> bool:
        line = self.interaction.line
        if self.comm.size > 1:
            stop = self.comm.allreduce(int(stop)) > 0
        self.pantographs.move_to(time)
        self.interaction.locate()
        line.predict()
        # Of this scheme's lines they are the arrays themselves.
        moved, sped = line.displacement, line.velocity
        self._predicted[0] = moved
        self._predicted[1] = sped
        line.load_at(time)
        line.internal_forces()
        self._nowhere = self.interaction.presence == 0.0
        if self.pantographs.lateral:
            find_crossings(self.interaction, self.pantographs, time)
        heads = self._heads_everywhere(time)
        force = self._force
        fixed = self.numerics.iterations
        for number in range(1, (fixed or self.numerics.max_iterations) + 1):
            force, depth, rate = self._contact(heads, force)
            compensation = self._compensation()
            self._latest[0], self._latest[1] = moved, sped
            moved[:], sped[:] = self._predicted
            line.solve(self.interaction.loads(force, compensation))
            line.correct()
            self.counters.rounds += 1
            # The error of a fixed number of them is found after the last only.
            if (fixed is None or number == fixed) and self._settled():
                break
        else:
            if fixed is None:
                raise self._broken("does not converge")
            self.counters.unconverged_steps += 1
        if fixed is not None and not (np.abs(force) < DIVERGED).all():
            raise self._broken("diverges")
        if self.judge is not None:
            self._refuse_rejected(self.judge, time, depth, force, heads)
        self.counters.steps += 1
        self.counters.solves = self.counters.rounds
        self._force = force
        self.interaction.add_work(force)
        # All ranks hold the same forces, so that all remember the same impacts.
        self.law.accept(time, depth, rate, force)
        heads_below = self.pantographs
        on_root(self.comm, lambda: heads_below.advance(force, self.law.reported(force), depth))
        return not stop

    def _refuse_rejected(
        self, judge: StepController, time: float, depth: np.ndarray, force: np.ndarray, heads: Heads
    ) -> None:
        """Raise StepRejected on all ranks if the step is not to be taken. Collective."""
        stiffness = self.law.tangents.by_depth
        # The line's compliance has no part in this scheme.
        yielding = heads.height_compliance.diagonal()
        decision = on_root(self.comm, lambda: judge.decide(time, depth, force, stiffness, yielding))
        judge.set_level(decision.level)
        if not decision.accepted:
            raise StepRejected

    def state(self) -> np.ndarray:
        return np.concatenate([self._force, self.law.state()])

    def restore(self, state: np.ndarray) -> None:
        n = self._force.size
        self._force = state[:n].copy()
        self.law.restore(state[n:])

    def _heads_everywhere(self, time: float) -> Heads:
        """Rank 0's prediction on all ranks, which all know if there is none."""
        if self.comm.size == 1:
            return self.pantographs.predict(time)
        heads = self._heads
        heads.numbers[:] = on_root(self.comm, lambda: self.pantographs.predict(time).numbers)
        return heads

    def _contact(
        self, heads: Heads, force: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Contact forces [N], depths [m] and their rates [m/s] from the latest iterate, on all
        ranks."""
        both = np.zeros((2, force.size))
        self.interaction.heights(both[0], both[1])
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, both)
        height, rate = both
        depth = heads.height - heads.height_compliance @ force - height
        depth[self._nowhere] = NOWHERE
        speed = heads.velocity - heads.velocity_compliance @ force - rate
        new = self.law.force(depth, speed).copy()
        new[self._nowhere] = 0.0
        return (new if self.law.pulls else np.maximum(new, 0.0)), depth, speed

    def _compensation(self) -> np.ndarray:
        """Compensations of owned links in the latest iterate (eq. 2.7) [N]."""
        links = self.interaction.links
        return links.compensation() if links.table.switches else np.zeros(0)

    def _settled(self) -> bool:
        line, numerics, change = self.interaction.line, self.numerics, self._change
        np.subtract(line.displacement, self._latest[0], out=change[0])
        np.subtract(line.velocity, self._latest[1], out=change[1])
        np.abs(change, out=change)
        moved, sped = change.max(axis=1, initial=0.0).tolist()
        largest = max(moved / numerics.eps_d, sped / numerics.eps_v)
        if not (moved < _FAR and np.isfinite(sped)):  # also true for what is no number
            largest = np.inf
        if self.comm.size > 1:
            largest = self.comm.allreduce(largest, op=MPI.MAX)
        if not np.isfinite(largest):
            raise self._broken("diverges")
        return largest < 1.0

    def _broken(self, how: str) -> NotConverged:
        fixed, most = self.numerics.iterations, self.numerics.max_iterations
        allowed = f"at most {most} iterations, numerics.max_iterations"
        if fixed is not None:
            allowed = f"numerics.iterations is {fixed}"
        return NotConverged(
            f'the fixed-point correction {how} ({allowed}); take numerics.scheme = "one_solve" '
            "or a smaller numerics.dt_s"
        )
