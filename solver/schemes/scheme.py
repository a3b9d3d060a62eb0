"""Schemes: ways through a time step for line and pantographs.

The default one solves for the free response once, and then a small exact problem.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from catenary.base.errors import RunBroken
from catenary.base.parallel import on_root
from catenary.base.petsc import EVENTS, event
from catenary.solver.contact.forces_on_line import ForcesOnLine
from catenary.solver.contact.pantographs import Heads, Pantographs
from catenary.solver.contact_problem.coupling import NOT_FINITE, Coupling, InnerSolution
from catenary.solver.contact_problem.force_exchange import (
    Exchange,
    LineResponse,
    Reply,
    Verdict,
)
from catenary.solver.kernels import native

# First guesses of what reserves elsewhere may lose [N] and of contact forces [N]; both grow when a
# step shows that they were too small, and that step is repeated.
_FIRST_MARGIN = 5.0
_FIRST_BOUND = 200.0
# No reserve is below it: no link is reported, but for one that is not finite.
_NO_MARGIN = -np.finfo(float).max


def find_crossings(interaction: ForcesOnLine, pantographs: Pantographs, time: float) -> None:
    """Find where wires that move sideways cross the strips at ``time`` [s], the end of a step.

    Contacts are located then, and their forces do not act yet. Collective."""
    interaction.find_across()
    pantographs.cross(time, interaction.presence)


@dataclass
class Counters:
    """Counts of the work of a run's steps.

    ``repeated_steps``: bounds of what may slacken were too small; ``pivoted_steps``: the active
    set of contacts and slack droppers cycled, and pivoting found it; ``unconverged_steps``:
    iterations ended above their tolerances, which ends the run (``Stepper`` counts that step)
    unless their number is given.
    """

    steps: int = 0
    rounds: int = 0
    repeated_steps: int = 0
    pivoted_steps: int = 0
    slack_dropper_steps: int = 0
    solves: int = 0
    unconverged_steps: int = 0

    def as_dict(self) -> dict[str, int]:
        """Names and counts, for the result file."""
        return dict(self.__dict__)


class Decision(NamedTuple):
    """Whether a step is taken, and the level of the next, or of its repetition."""

    accepted: bool
    level: int


class StepController(Protocol):
    """Decides on steps whose forces are found, where steps adapt (`adaptive_steps`)."""

    def decide(
        self,
        time: float,
        depth: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        compliance: np.ndarray,
    ) -> Decision:
        """Accept or reject a step; parameters as of `StepError.of`. Rank 0 only."""

    def set_level(self, level: int) -> None:
        """Set the level of the next step, as ``decide`` returned it on rank 0. All ranks."""


class StepRejected(Exception):
    """Step control rejected the step; only the state of the line has changed. On all ranks."""


class Scheme(ABC):
    """Advances line and pantographs by one step."""

    counters: Counters
    pantographs: Pantographs

    @abstractmethod
    def step(self, time: float, stop: bool) -> bool:
        """Advance to ``time`` [s]; False if ``stop`` is set on any rank. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the step has no solution or a result is not finite; NotConverged if
            iterations ended above their tolerances. ``Stepper`` adds time and place to the message.
        """

    @property
    def traffic(self) -> tuple[int, int] | None:
        """Messages and bytes that this rank sent so far, those to neighbours left out; None if
        they are not counted."""
        return None

    @abstractmethod
    def state(self) -> np.ndarray:
        """State of the contacts from which a run continues, as one array."""

    @abstractmethod
    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""

    def destroy(self) -> None:  # noqa: B027  (many have none)
        """Free PETSc objects of the scheme's own. Collective."""


@dataclass
class OneSolve(Scheme):
    """One solve for the free response, then the exact small problem of contacts and links.

    The columns of A^-1 that the forces act through are tabulated, so that superposition needs no
    second solve. Steps are taken as they come, unless a ``judge`` is put in.
    """

    comm: Any
    interaction: ForcesOnLine
    pantographs: Pantographs
    coupling: Coupling
    counters: Counters = field(default_factory=Counters)
    judge: StepController | None = None

    def __post_init__(self) -> None:
        n = self.pantographs.n_contacts
        switches = self.interaction.link_coupling is not None
        self._bounds = native.Bounds(
            np.full(n, _FIRST_BOUND),
            np.full(n, _FIRST_BOUND if self.coupling.law.pulls else 0.0),
            np.full(1, _FIRST_MARGIN if switches else _NO_MARGIN),
        )
        self._exchange = Exchange(self.comm, n, self.coupling.extrapolates, self._bounds)
        self._respond = self.interaction.responder(self._exchange.share.arrays)
        self._none = np.zeros(n)
        self._found: InnerSolution | None = None
        self._why: RunBroken | None = None
        self._events = {name: event(name) for name in EVENTS}

    def step(self, time: float, stop: bool) -> bool:
        self.begin(time)
        return self.finish(time, stop)

    def begin(self, time: float) -> None:
        """Take the line to the end of the step at ``time`` [s] without contacts and slack droppers.

        Collective, as ``finish``.
        """
        line, interaction, events = self.interaction.line, self.interaction, self._events
        events["LineColumns"].begin()
        self.pantographs.move_to(time)
        line.provide(0.0)
        interaction.place()
        events["LineColumns"].end()
        events["LineFree"].begin()
        line.load_at(time)
        if self.coupling.extrapolates:
            line.predict()
            share = self._exchange.share
            interaction.heights(share.early_height, share.early_rate)
            line.free_acceleration()
            line.correct()
            interaction.links.find_reserve()
        else:
            line.free_step()
        events["LineFree"].end()

    def finish(self, time: float, stop: bool) -> bool:
        """Find the forces of a step that has begun and take line and pantographs to its end; as
        ``step``."""
        interaction, events = self.interaction, self._events
        reply = self._solve_inner(time, stop)
        if self.judge is not None:
            self.judge.set_level(reply.level)
            if reply.verdict == Verdict.REJECT:
                raise StepRejected
        events["LineSuperpose"].begin()
        interaction.superpose(reply.contact_force, reply.links, reply.compensation)
        events["LineSuperpose"].end()
        events["PantoAdvance"].begin()
        if self.pantographs.joints_in_loop:
            on_root(self.comm, self._advance)  # joints may fail to close, which all must know
        else:
            self._advance()
        events["PantoAdvance"].end()
        self.counters.steps += 1
        self.counters.solves += 1
        return reply.verdict == Verdict.ADVANCE

    def _advance(self) -> None:
        """Move the pantographs on. Does nothing but on rank 0."""
        found = self._found
        if found is not None:
            force = found.contact_force
            self.pantographs.advance(force, self.coupling.law.reported(force), found.depth)

    def state(self) -> np.ndarray:
        return self.coupling.state()

    def restore(self, state: np.ndarray) -> None:
        self.coupling.restore(state)

    @property
    def share(self) -> LineResponse:
        """This rank's share of the inner problem, another one when it needs more room."""
        return self._exchange.share

    def make_room(self, n_links: int) -> None:
        """Make room for rows of so many links a rank. Collective."""
        early = self.share.early_height, self.share.early_rate
        self._exchange.enlarge(n_links)
        self.share.early_height[:], self.share.early_rate[:] = early
        self._respond = self.interaction.responder(self.share.arrays)

    @property
    def traffic(self) -> tuple[int, int]:
        """Messages and bytes that this rank sent to agree on forces."""
        return self._exchange.messages, self._exchange.bytes_sent

    def _solve_inner(self, time: float, stop: bool) -> Reply:
        exchange, interaction, events = self._exchange, self.interaction, self._events
        if self.pantographs.lateral:
            find_crossings(interaction, self.pantographs, time)
        events["ContactInner"].begin()
        heads = self._heads(time) if self.comm.rank == 0 else None
        events["ContactInner"].end()
        while True:
            share = exchange.share
            events["ContactShare"].begin()
            self._respond()
            events["ContactShare"].end()
            share.put_stop(stop)
            merged = exchange.to_root()
            answer = None
            if merged is not None:
                events["ContactInner"].begin()
                answer = self._answer(time, merged, heads)
                events["ContactInner"].end()
            reply = exchange.from_root(answer)
            if reply.verdict == Verdict.BROKEN:
                raise self._broken()
            if reply.verdict == Verdict.ENLARGE:
                self.make_room(2 * reply.room)
            elif reply.verdict == Verdict.REPEAT:
                for bound in self._bounds:
                    bound *= 2.0
                self.counters.repeated_steps += 1
            else:
                return reply

    def _heads(self, time: float) -> Heads | None:
        """Prediction of the heads on rank 0, None if a pantograph cannot go on."""
        try:
            heads = self.pantographs.predict(time)
            if self.coupling.extrapolates:
                heads.early_height[:], heads.early_velocity[:] = self.pantographs.extrapolate(time)
        except RunBroken as error:
            # Told with the answer: the other ranks wait for that.
            self._why = _alone(error)
            return None
        return heads

    def _broken(self) -> RunBroken:
        """Error of a step without solution, which rank 0 knows, on all ranks. Collective."""
        why, self._why = self._why, None
        if self.comm.size > 1:
            why = self.comm.bcast(why, root=0)
        assert why is not None
        return why

    def _answer(self, time: float, response: LineResponse, heads: Heads | None) -> Reply:
        """Solution of the inner problem on rank 0 from the shares of all ranks."""
        self._found = None
        if heads is None:
            return Reply(Verdict.BROKEN, self._none)
        _, wants_to_stop, is_broken, missing_room = response.flags
        if is_broken:
            self._why = RunBroken(NOT_FINITE)
            return Reply(Verdict.BROKEN, self._none)
        if missing_room:
            return Reply(Verdict.ENLARGE, self._none, room=int(missing_room))
        law, level = self.coupling.law, 0
        try:
            found = self.coupling.solve(response, heads)
            if not found.complete:
                return Reply(Verdict.REPEAT, self._none)
            if self.judge is not None:
                yielding = heads.height_compliance.diagonal() + response.line.by_force.diagonal()
                accepted, level = self.judge.decide(
                    time, found.depth, found.contact_force, law.tangents.by_depth, yielding
                )
                if not accepted:
                    return Reply(Verdict.REJECT, self._none, level=level)
            law.accept(time, found.depth, found.rate, found.contact_force)
        except RunBroken as error:
            self._why = _alone(error)
            return Reply(Verdict.BROKEN, self._none)
        self._found = found
        self.counters.rounds += found.rounds
        self.counters.pivoted_steps += found.pivoted
        verdict = Verdict.ADVANCE_AND_STOP if wants_to_stop else Verdict.ADVANCE
        slack = found.compensation
        n_switched = np.count_nonzero(slack)
        if not n_switched:
            return Reply(verdict, found.contact_force, level=level)
        links = response.links
        if n_switched < slack.size:
            switched = slack != 0.0
            links, slack = links[switched], slack[switched]
        slackens = self.interaction.links.table.slackens
        self.counters.slack_dropper_steps += int(np.count_nonzero(slackens[links]))
        return Reply(verdict, found.contact_force, links, slack, level=level)


def _alone(error: RunBroken) -> RunBroken:
    """The error without its traceback, whose frames would keep PETSc's objects alive on this rank
    alone: PETSc then frees its communicator on the others only, and the next object made hangs."""
    error.__cause__ = error.__context__ = None
    return error.with_traceback(None)
