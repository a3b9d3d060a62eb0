"""Many steps of the scheme ``one_solve`` in one call, on one rank, as far as a loop can take them.

A step whose forces the loop does not find, because an active set cycles, a link finds no room, or
something is no number, is finished by the scheme itself, from where the loop has left it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from catenary.mbs.head.head_records import drive_width
from catenary.solver.base.kernels.bound import bound
from catenary.solver.base.kernels.pointers import HeldCall, address_of
from catenary.solver.base.petsc_events import event
from catenary.solver.contact.line_response import affine
from catenary.solver.contact_problem.complementarity_kernels import SmallProblem
from catenary.solver.contact_problem.coupling import Implicit
from catenary.solver.schemes.one_solve import OneSolve
from catenary.solver.schemes.scheme import Scheme
from catenary.solver.time_loop import step_kernels
from catenary.solver.time_loop.step_kernels import (
    FULL,
    N_COUNTS,
    REPEATED,
    ROUNDS,
    SLACK,
    KeptMotions,
    Steps,
)
from catenary.solver.time_loop.views.observers import StepView
from catenary.solver.time_loop.views.step_views import Showing
from catenary.solver.window.moving_columns import MovedStations
from catenary.solver.window.moving_window import MOST_STEPS

# What rows of a block may take, so that it stays in the caches [B], and the most of them.
_BLOCK_BYTES, _MOST_ROWS = 2**19, MOST_STEPS
# Rows of a block at least, if what moves is a part of the line only.
_ROWS_OF_PART = 64
# The same of motions that are kept. A step of a line of which not one fits takes far longer than
# the end of a block.
_MOTION_BYTES, _MOST_MOTIONS = 2**21, 16


class CompiledSteps:
    """Takes steps of a scheme and keeps the rows that observers are shown. One rank only.

    Attributes
    ----------
    most : steps of the largest block
    times : (most,) of the steps of the latest block [s]
    rows : (most, width) what each of them shows; empty if nobody looks
    taken : steps of the latest block that were taken, fewer than asked for if one broke, if there
        was no room for its motion, or if loads were not known for all of them
    most_motions : steps of a block of which the motion can be kept

    Parameters
    ----------
    dt : time step [s]
    shows : whether rows are wanted
    """

    def __init__(self, scheme: OneSolve, showing: Showing, dt: float, shows: bool) -> None:
        self._scheme, self._showing, self._dt, self._shows = scheme, showing, dt, shows
        width = showing.layout.width
        least = 1 if scheme.interaction.line.window is None else _ROWS_OF_PART
        self.most = max(least, min(_MOST_ROWS, _BLOCK_BYTES // (8 * width)))
        self.rows = np.zeros((self.most if shows else 0, width))
        self.times = np.zeros(self.most)
        self._moved = MovedStations(len(self.rows), showing.shown.columns)
        self.taken = 0
        n_numbers = 2 * scheme.interaction.line.ownership.n_local
        most = _MOST_MOTIONS
        if scheme.interaction.line.window is None:
            most = min(most, _MOTION_BYTES // (8 * n_numbers))
        self.most_motions = most if shows else 0
        # Where masses of the pantographs are, which is kept with a motion.
        self._place_arrays = scheme.pantographs.places()
        taps = [
            address_of(array) + 8 * at for array in self._place_arrays for at in range(array.size)
        ]
        room = min(n_numbers * self.most_motions, _MOTION_BYTES // 8)
        self._kept = KeptMotions(
            motion_of=np.full(self.most, -1),
            numbers=np.zeros(room),
            stations=np.zeros((self.most_motions, 3), dtype=np.int64),
            used=np.zeros(1, dtype=np.int64),
            moved=showing.motion.moved,
            taps=np.array(taps, dtype=np.int64),
            tapped=np.zeros((self.most_motions, len(taps))),
        )
        pantographs, interaction = scheme.pantographs, scheme.interaction
        n = pantographs.n_contacts
        records, passes = pantographs.records(), interaction.line.passes
        law = scheme.coupling.law.in_loop()
        assert records is not None and passes is not None and law is not None
        self._free = passes.held
        loads = interaction.line.loads
        self._loads = loads if loads is not None and loads.changes else None
        self._loading: HeldCall | None = None
        if self._loads is not None:
            self._loading = HeldCall(self._loads.kernel, self._loads.arguments)
        self._records, self._law = records, law
        self._heads = np.zeros(2 * n * (1 + n))
        self._at_contacts = affine(self._heads, n)
        self._drives = np.zeros((self.most, pantographs.n, drive_width(pantographs.most_contacts)))
        self._counts = np.zeros(N_COUNTS, dtype=np.int64)
        self._bound_to: tuple[Any, Any] = None, None
        self._bound: Callable[[int, int], tuple[int, bool]]
        self._event = event("Steps")
        self._loop()  # compiled, or loaded, before the clock of a march starts

    def take(self, step: int, n_steps: int, kept: Sequence[int] = ()) -> None:
        """Take up to ``n_steps`` <= ``most`` steps after the one of number ``step``, one at least.

        Of those of the indices ``kept``, at most ``most_motions``, the motion is kept.

        Raises
        ------
        RunBroken
            As ``OneSolve.step``; ``taken`` steps are then taken and shown.
        """
        scheme, self.taken = self._scheme, 0
        times = self.times[:n_steps]
        np.multiply(np.arange(step + 1, step + 1 + n_steps), self._dt, out=times)
        if self._loads is not None:
            n_steps = self._loads.cover(times)
            times = times[:n_steps]
        line, speed = self._scheme.interaction.line, float(scheme.pantographs.speed)
        scheme.pantographs.move_to(step * self._dt)
        line.provide(speed * n_steps * self._dt)
        self._moved.begin(step)
        self._kept.motion_of[:n_steps] = -1
        self._kept.used[0] = 0
        for number, at in enumerate(kept):
            # The last step is shown as it is.
            if at < n_steps - 1:
                self._kept.motion_of[at] = number
        scheme.pantographs.fill_drives(times.tolist(), self._drives[:n_steps])
        is_full = False
        while self.taken < n_steps:
            if self._take_on(n_steps):
                time = float(times[self.taken])
                scheme.finish(time, stop=False)
                if self._shows:
                    number = step + self.taken + 1
                    view = self._showing.view(number, time, followed=True)
                    self.rows[self.taken] = view.row
                    is_full = not self._keep_motion(int(self._kept.motion_of[self.taken]))
                self.taken += 1
            if is_full or self._counts[FULL]:
                n_steps = self.taken
        self._moved.end(step + n_steps, n_steps)
        self._showing.follow(self._moved.now)

    def last_view(self, step: int) -> StepView:
        """The state after the latest block, ``step`` being the number of its last step."""
        last = self.taken - 1
        return self._showing.view_of(step, float(self.times[last]), self.rows[last])

    def motion_view(self, step: int, at: int, number: int) -> StepView:
        """What is left of a step in the midst of the latest block, see ``MotionObserver``.

        Parameters
        ----------
        step : its number
        at : its index in the block
        number : of the kept motion
        """
        kept = self._kept
        begin, end, first = kept.stations[number].tolist()
        starts = self._showing.shown.columns.starts
        last = first + 2 * int(starts[end] - starts[begin])
        motion = (begin, end), kept.numbers[first:last]
        time, row = float(self.times[at]), self.rows[at]
        return self._showing.view_of_kept(step, time, row, motion, kept.tapped[number])

    def _keep_motion(self, number: int) -> bool:
        """Keep the motion of a step as that of a number, none if below 0; whether there is room."""
        kept, motion = self._kept, self._showing.motion
        if number < 0:
            return True
        columns, line = self._showing.shown.columns, self._scheme.interaction.line
        own, first = slice(*columns.starts[kept.moved].tolist()), int(kept.used[0])
        last = first + 2 * (own.stop - own.start)
        if last > kept.numbers.size:
            return False
        kept.numbers[first:last] = np.append(line.displacement[own], line.velocity[own])
        kept.stations[number] = *motion.moved, first
        kept.used[0] = last
        motion.moved[:] = columns.ends[:2]
        kept.tapped[number] = np.concatenate(self._place_arrays)
        return True

    def _take_on(self, n_steps: int) -> bool:
        """Go on with a block as far as the loop can; whether the scheme has to finish a step."""
        self._event.begin()
        first, counts, counters = self.taken, self._counts, self._scheme.counters
        counts[:] = 0
        done, begun = self._loop()(first, n_steps)
        counters.steps += done
        counters.solves += done
        counters.rounds += int(counts[ROUNDS])
        counters.slack_dropper_steps += int(counts[SLACK])
        counters.repeated_steps += int(counts[REPEATED])
        self.taken += done
        self._event.end()
        return bool(begun)

    def _loop(self) -> Callable[[int, int], tuple[int, bool]]:
        """The compiled loop, on the arrays that the scheme has now."""
        coupling = self._scheme.coupling
        assert isinstance(coupling, Implicit)
        share, unknowns = self._scheme.share, coupling.inner.unknowns
        # A step may exchange these arrays for larger ones.
        if self._bound_to[0] is not share or self._bound_to[1] is not unknowns:
            self._bound_to = share, unknowns
            self._arguments = self._steps(coupling.inner.problem(self._at_contacts, share))
            self._bound = bound(step_kernels.take, *self._arguments, later=(0, 0))
        return self._bound

    def _steps(self, problem: SmallProblem) -> tuple[Any, ...]:
        """Arguments of the loop but its last two."""
        scheme = self._scheme
        pantographs, interaction = scheme.pantographs, scheme.interaction
        steps = Steps(
            speed=float(pantographs.speed),
            moving=pantographs.moving,
            placing=interaction.placing,
            free=self._free.address,
            loading=(0, 0) if self._loading is None else self._loading.address,
            clock=np.zeros(1) if self._loads is None else self._loads.clock,
            records=self._records,
            heads=self._heads,
            responding=interaction.responding(scheme.share),
            problem=problem,
            law=self._law,
            superposing=interaction.superposing,
            compensating=interaction.compensating,
            working=interaction.working,
            crossing=interaction.crossing,
            lateral_place=pantographs.lateral_place,
            switched=np.zeros(problem.unknowns.right.size, dtype=np.int64),
            ends=pantographs.ends,
            of_step=pantographs.of_step,
            outputs=pantographs.outputs,
            shown=self._showing.shown,
            taps=self._showing.layout.taps,
        )
        rows = self.rows, (self._moved.now, self._moved.behind)
        return *steps, self.times, self._drives, *rows, self._kept, self._counts, self._shows


def compiled_steps(
    scheme: Scheme, showing: Showing, dt: float, shows: bool
) -> CompiledSteps | None:
    """What takes steps of a scheme in one loop, None if there is no such loop. Not collective."""
    if not isinstance(scheme, OneSolve) or scheme.comm.size > 1 or scheme.judge is not None:
        return None
    line = scheme.interaction.line
    if not isinstance(scheme.coupling, Implicit) or line.passes is None:
        return None
    if not hasattr(step_kernels.take, "overloads"):
        return None  # NUMBA_DISABLE_JIT
    if scheme.coupling.law.in_loop() is None or scheme.pantographs.records() is None:
        return None
    if not showing.layout.in_loop:
        return None  # a channel that is a function
    return CompiledSteps(scheme, showing, dt, shows)
