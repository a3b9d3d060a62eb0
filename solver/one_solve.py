"""The default way through a step: one solve, and a small exact problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catenary.solver.contact import Touches
from catenary.solver.coupling import Coupling
from catenary.solver.errors import RunBroken
from catenary.solver.exchange import Exchange, Merged, Reply, Verdict
from catenary.solver.heads import Heads
from catenary.solver.interaction import Interaction
from catenary.solver.pantographs import Pantographs
from catenary.solver.schemes import Counters, LoadSource

# First guesses of what droppers elsewhere may lose [N] and of contact forces [N]; both grow when
# a step shows that they were too small, and that step is repeated.
_FIRST_MARGIN = 5.0
_FIRST_BOUND = 200.0


@dataclass
class OneSolve:
    """One solve for the free response, then the exact small problem of contacts and slack droppers.

    The columns of A^-1 that the forces act through are tabulated, so that superposition needs no
    second solve.
    """

    comm: Any
    interaction: Interaction
    pantographs: Pantographs
    coupling: Coupling
    loads: LoadSource
    counters: Counters = field(default_factory=Counters)

    def __post_init__(self) -> None:
        n = self.pantographs.n_contacts
        self._exchange = Exchange(self.comm, n, self.coupling.extrapolates)
        self._margin = _FIRST_MARGIN
        self._bound = np.full(n, _FIRST_BOUND)
        self._advance: Callable[[], None] = lambda: None
        self._why = ""

    def step(self, time: float, stop: bool) -> bool:
        line, interaction = self.interaction.line, self.interaction
        line.predict()
        touches = self.pantographs.move_to(time)
        early = interaction.heights(touches) if self.coupling.extrapolates else None
        line.free_acceleration(self.loads(time))
        interaction.place(touches)
        # From here on the line holds the end of the step without contacts and slack droppers.
        line.correct()
        reply = self._solve_inner(time, stop, touches, early)
        interaction.superpose(reply.contact_force, reply.droppers, reply.compensation)
        if self.comm.rank == 0:
            self._advance()
        self.counters.steps += 1
        self.counters.solves += 1
        return reply.verdict == Verdict.ADVANCE

    def state(self) -> np.ndarray:
        """What coupling and law remember, as one array."""
        return self.coupling.state()

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self.coupling.restore(state)

    def _solve_inner(
        self,
        time: float,
        stop: bool,
        touches: Touches,
        early: tuple[np.ndarray, np.ndarray] | None,
    ) -> Reply:
        line = self.interaction.line
        heads = self._heads(time) if self.comm.rank == 0 else None
        while True:
            share = self.interaction.response(touches, self._bound, self._margin)
            if early is not None:
                share.early_height, share.early_rate = early
            broken = not np.isfinite(share.height.sum() + line.acceleration.sum())
            merged = self._exchange.to_root(share, stop, broken)
            answer = None
            if merged is not None and heads is not None:
                answer = self._answer(time, merged, heads)
            reply = self._exchange.from_root(answer)
            if reply.verdict == Verdict.BROKEN:
                raise self._broken(time)
            if reply.verdict == Verdict.ENLARGE:
                self._exchange.enlarge(int(reply.contact_force[0]))
            elif reply.verdict == Verdict.REPEAT:
                self._margin *= 2.0
                self._bound *= 2.0
                self.counters.repeated_steps += 1
            else:
                return reply

    def _heads(self, time: float) -> Heads:
        heads = self.pantographs.predict(time)
        if self.coupling.extrapolates:
            heads.early_height[:], heads.early_velocity[:] = self.pantographs.extrapolate(time)
        return heads

    def _broken(self, time: float) -> RunBroken:
        """Why the step has no solution, which rank 0 knows, on all ranks. Collective."""
        why = self._why
        if self.comm.size > 1:
            why = self.comm.bcast(why, root=0)
        return RunBroken(
            f"the step to t = {time:.4f} s with the train at "
            f"{float(self.pantographs.position[0]):.1f} m: {why}"
        )

    def _coupling_among(self, droppers: np.ndarray) -> np.ndarray:
        """How compensations of these droppers change each other's tension, (m, m) [-]."""
        coupling = self.interaction.slack_coupling
        assert coupling is not None
        return coupling.among(droppers)

    def _answer(self, time: float, merged: Merged, heads: Heads) -> Reply:
        """What rank 0 makes of all shares."""
        n = self.pantographs.n_contacts
        empty, none = np.zeros(0, dtype=int), np.zeros(0)
        response, coupling = merged.response, self.interaction.slack_coupling
        # A head that is no number would compare as out of contact and go unnoticed.
        if merged.broken or not heads.is_finite():
            self._why = "it has no finite solution; try a smaller numerics.dt_s"
            return Reply(Verdict.BROKEN, np.zeros(n), empty, none)
        if merged.overflow:
            return Reply(Verdict.ENLARGE, np.full(n, float(2 * merged.overflow)), empty, none)
        try:
            result = self.coupling.solve(response, heads, self._coupling_among)
        except RunBroken as error:
            self._why = str(error)
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
        law = self.coupling.law
        try:
            law.accept(time, result.depth, result.rate, result.contact_force)
        except RunBroken as error:
            self._why = str(error)
            return Reply(Verdict.BROKEN, np.zeros(n), empty, none)
        self._advance = lambda: self.pantographs.advance(
            result.contact_force, law.reported(result.contact_force), result.wire_height
        )
        verdict = Verdict.ADVANCE_AND_STOP if merged.stop else Verdict.ADVANCE
        return Reply(verdict, result.contact_force, droppers, compensation)
