"""Two ways through a time step: one solve and a small exact problem, or the paper's correction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from mpi4py import MPI

from catenary.mbs.interface import HeadState
from catenary.solver.contact import Touches
from catenary.solver.errors import RunBroken
from catenary.solver.exchange import Exchange, Merged, Reply, Verdict
from catenary.solver.inner import InnerProblem
from catenary.solver.interaction import Interaction
from catenary.solver.pantographs import Pantographs
from catenary.solver.problem import Numerics

LoadSource = Callable[[float], list[tuple[np.ndarray, np.ndarray]]]

# First guesses of what droppers elsewhere may lose [N] and of contact forces [N]; both grow when
# a step shows that they were too small, and that step is repeated.
_FIRST_MARGIN = 5.0
_FIRST_BOUND = 200.0


@dataclass
class Counters:
    """What the steps of a run needed."""

    steps: int = 0
    rounds: int = 0
    repeated_steps: int = 0
    slack_dropper_steps: int = 0
    solves: int = 0
    unconverged_steps: int = 0

    def as_dict(self) -> dict[str, int]:
        """Names and counts, for the result file."""
        return dict(self.__dict__)


class Scheme(Protocol):
    """Advances line and pantographs by one step."""

    counters: Counters

    def step(self, time: float, stop: bool) -> bool:
        """Advance to ``time`` [s]; False if any rank wants this step to be the last. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the step has no solution or holds something that is no number.
        """


@dataclass
class OneSolve:
    """One solve for the free response, then the exact small problem of contacts and slack droppers.

    The columns of A^-1 that the forces act through are tabulated, so that superposition needs no
    second solve.
    """

    comm: Any
    interaction: Interaction
    pantographs: Pantographs
    inner: InnerProblem
    loads: LoadSource
    counters: Counters = field(default_factory=Counters)

    def __post_init__(self) -> None:
        self._exchange = Exchange(self.comm, self.pantographs.n)
        self._margin = _FIRST_MARGIN
        self._bound = np.full(self.pantographs.n, _FIRST_BOUND)
        self._advance: Callable[[], None] = lambda: None

    def step(self, time: float, stop: bool) -> bool:
        line, interaction = self.interaction.line, self.interaction
        line.predict()
        line.free_acceleration(self.loads(time))
        touches = self.pantographs.move_to(time)
        interaction.place(touches)
        # From here on the line holds the end of the step without contacts and slack droppers.
        line.correct()
        reply = self._solve_inner(time, stop, touches)
        interaction.superpose(reply.contact_force, reply.droppers, reply.compensation)
        if self.comm.rank == 0:
            self._advance()
        self.counters.steps += 1
        self.counters.solves += 1
        return reply.verdict == Verdict.ADVANCE

    def _solve_inner(self, time: float, stop: bool, touches: Touches) -> Reply:
        line = self.interaction.line
        heads = self.pantographs.predict(time) if self.comm.rank == 0 else []
        while True:
            share = self.interaction.response(touches, self._bound, self._margin)
            broken = not np.isfinite(share.height.sum() + line.acceleration.sum())
            merged = self._exchange.to_root(share, stop, broken)
            reply = self._exchange.from_root(
                self._answer(merged, heads) if merged is not None else None
            )
            if reply.verdict == Verdict.BROKEN:
                raise RunBroken(
                    f"the step to t = {time:.4f} s has no finite solution with the train at "
                    f"{float(self.pantographs.position[0]):.1f} m; try a smaller numerics.dt_s"
                )
            if reply.verdict == Verdict.ENLARGE:
                self._exchange.enlarge(int(reply.contact_force[0]))
            elif reply.verdict == Verdict.REPEAT:
                self._margin *= 2.0
                self._bound *= 2.0
                self.counters.repeated_steps += 1
            else:
                return reply

    def _coupling_among(self, droppers: np.ndarray) -> np.ndarray:
        """How compensations of these droppers change each other's tension, (m, m) [-]."""
        coupling = self.interaction.slack_coupling
        assert coupling is not None
        return coupling.among(droppers)

    def _answer(self, merged: Merged, heads: list[HeadState]) -> Reply:
        """What rank 0 makes of all shares."""
        n = self.pantographs.n
        empty, none = np.zeros(0, dtype=int), np.zeros(0)
        response, coupling = merged.response, self.interaction.slack_coupling
        # A head that is no number would compare as out of contact and go unnoticed.
        if merged.broken or not all(math.isfinite(sum(head)) for head in heads):
            return Reply(Verdict.BROKEN, np.zeros(n), empty, none)
        if merged.overflow:
            return Reply(Verdict.ENLARGE, np.full(n, float(2 * merged.overflow)), empty, none)
        try:
            result = self.inner.solve(response, heads, self._coupling_among)
        except RunBroken:
            return Reply(Verdict.BROKEN, np.zeros(n), empty, none)
        droppers, compensation = empty, none
        if coupling is not None:
            if result.compensation.any():
                slack = np.flatnonzero(result.compensation)
                droppers, compensation = response.droppers[slack], result.compensation[slack]
                missed = self._margin < coupling.largest_drop_elsewhere(
                    response.droppers, result.compensation
                )
            else:
                missed = False
            if missed or (result.contact_force > self._bound).any():
                return Reply(Verdict.REPEAT, np.zeros(n), empty, none)
        self.counters.rounds += result.rounds
        self.counters.slack_dropper_steps += droppers.size
        self._advance = lambda: self.pantographs.advance(
            result.contact_force, heads, result.wire_height
        )
        verdict = Verdict.ADVANCE_AND_STOP if merged.stop else Verdict.ADVANCE
        return Reply(verdict, result.contact_force, droppers, compensation)


@dataclass
class FixedPoint:
    """The paper's correction: eqs. (2.4) to (2.7) repeated until the iterates agree.

    Contact forces and the compensation of slack droppers are evaluated from the latest iterate
    and the whole system is solved again.
    """

    comm: Any
    interaction: Interaction
    pantographs: Pantographs
    numerics: Numerics
    contact_stiffness: float
    contact_damping: float
    may_lose_contact: bool
    kept_ratio: float
    may_slacken: bool
    loads: LoadSource
    counters: Counters = field(default_factory=Counters)

    def __post_init__(self) -> None:
        n = self.interaction.line.ownership.n_local
        self._predicted = np.zeros((2, n))
        self._latest = np.zeros((2, n))

    # Iterates that grow beyond all numbers are told by ``_settled``, not by NumPy.
    @np.errstate(over="ignore", invalid="ignore")
    def step(self, time: float, stop: bool) -> bool:
        line = self.interaction.line
        if self.comm.size > 1:
            stop = self.comm.allreduce(int(stop)) > 0
        line.predict()
        self._predicted[0] = line.displacement
        self._predicted[1] = line.velocity
        line.internal_forces()
        touches = self.pantographs.move_to(time)
        heads: list[HeadState] = self.comm.bcast(
            self.pantographs.predict(time) if self.comm.rank == 0 else None, root=0
        )
        external = self.loads(time)
        force = self.pantographs.contact_force.copy()
        self.comm.Bcast(force, root=0)
        height = np.zeros_like(force)
        for _ in range(self.numerics.max_iterations):
            force, height = self._contact(touches, heads, force)
            compensation = self._compensation()
            self._latest[0] = line.displacement
            self._latest[1] = line.velocity
            np.copyto(line.displacement, self._predicted[0])
            np.copyto(line.velocity, self._predicted[1])
            line.solve(external + self.interaction.loads(touches, force, compensation))
            line.correct()
            self.counters.rounds += 1
            if self._settled(time):
                break
        else:
            self.counters.unconverged_steps += 1
            raise self._broken("does not converge", time)
        self.counters.steps += 1
        self.counters.solves = self.counters.rounds
        if self.comm.rank == 0:
            self.pantographs.advance(force, heads, height)
        return not stop

    def _contact(
        self, touches: Touches, heads: list[HeadState], force: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Contact forces [N] and wire heights [m] from the latest iterate, on all ranks."""
        height, rate = self.interaction.heights(touches)
        both = np.concatenate([height, rate])
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, both)
        height, rate = both[: force.size], both[force.size :]
        new = np.empty_like(force)
        for i, head in enumerate(heads):
            depth = head.height - head.height_compliance * force[i]
            depth -= height[i]
            speed = head.velocity - head.velocity_compliance * force[i]
            speed -= rate[i]
            new[i] = self.contact_stiffness * depth + self.contact_damping * speed
        return (np.maximum(new, 0.0) if self.may_lose_contact else new), height

    def _compensation(self) -> np.ndarray:
        """Forces that cancel what owned droppers push (eq. 2.7) [N]."""
        if not self.may_slacken:
            return np.zeros(0)
        tension = self.interaction.droppers.tension()
        return np.asarray((1.0 - self.kept_ratio) * np.maximum(0.0, -tension))

    def _settled(self, time: float) -> bool:
        line, numerics = self.interaction.line, self.numerics
        change = np.array(
            [
                np.abs(line.displacement - self._latest[0]).max(initial=0.0) / numerics.eps_d,
                np.abs(line.velocity - self._latest[1]).max(initial=0.0) / numerics.eps_v,
            ]
        )
        largest = float(np.nan_to_num(change, nan=np.inf, posinf=np.inf).max())
        if self.comm.size > 1:
            largest = self.comm.allreduce(largest, op=MPI.MAX)
        if not np.isfinite(largest):
            raise self._broken("diverges", time)
        return largest < 1.0

    def _broken(self, how: str, time: float) -> RunBroken:
        return RunBroken(
            f"the fixed-point correction {how} at t = {time:.4f} s (at most "
            f"{self.numerics.max_iterations} iterations, numerics.max_iterations) with the train "
            f"at {float(self.pantographs.position[0]):.1f} m; take numerics.scheme = "
            '"one_solve" or a smaller numerics.dt_s'
        )
