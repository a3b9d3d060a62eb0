"""Many steps of the scheme ``one_solve`` in one call, on one rank, as far as kernels can take them.

A step whose forces these do not find, because there are none, a link finds no room, or something
is no number, is finished by the scheme itself, from where the loop has left it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from catenary.base.petsc import event
from catenary.mbs.interface import affine, drive_width
from catenary.solver.contact_problem.coupling import Implicit
from catenary.solver.kernels import native
from catenary.solver.schemes.scheme import OneSolve, Scheme
from catenary.solver.time_loop.views.observers import StepView
from catenary.solver.time_loop.views.step_views import Showing
from catenary.solver.window.moving_columns import MovedStations
from catenary.solver.window.moving_window import MOST_STEPS

# Size of the rows of a block, so that it stays in the caches [B], and the most of them.
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
    scheme : the scheme whose steps are taken
    most : number of steps of the largest block
    times : (most,) times of the prepared steps [s]
    rows : (most, width) values of all channels after each step; empty without ``shows``
    taken : number of steps taken in the latest block, fewer than requested if one broke, if there
        was no room for its motion, or if loads were not known for all of them
    most_motions : largest number of steps of a block whose motion can be kept

    Parameters
    ----------
    dt : time step [s]
    shows : whether rows are recorded
    """

    def __init__(self, scheme: OneSolve, showing: Showing, dt: float, shows: bool) -> None:
        self.scheme, self._showing, self._dt, self._shows = scheme, showing, dt, shows
        width = showing.layout.width
        least = 1 if scheme.interaction.line.window is None else _ROWS_OF_PART
        self.most = max(least, min(_MOST_ROWS, _BLOCK_BYTES // (8 * width)))
        self.rows = np.zeros((self.most if shows else 0, width))
        self.times = np.zeros(self.most)
        self._moved = MovedStations(len(self.rows), showing.shown.columns)
        self.taken, self._block = 0, slice(0, 0)
        # The step before the prepared ones, and how many of these there are, and are taken.
        self._first, self._ready, self._done = -1, 0, 0
        n_numbers = 2 * scheme.interaction.line.ownership.n_local
        most = _MOST_MOTIONS
        if scheme.interaction.line.window is None:
            most = min(most, _MOTION_BYTES // (8 * n_numbers))
        self.most_motions = most if shows else 0
        pantographs, interaction = scheme.pantographs, scheme.interaction
        # Places of the pantographs' masses, which are kept with a motion.
        self._heads, places = pantographs.heads_in_loop()
        room = min(n_numbers * self.most_motions, _MOTION_BYTES // 8)
        self._kept = native.KeptMotions(
            motion_of=np.full(self.most, -1),
            numbers=np.zeros(room),
            stations=np.zeros((self.most_motions, 3), dtype=np.int64),
            used=np.zeros(1, dtype=np.int64),
            moved=showing.motion.moved,
            places=places,
            kept_places=np.zeros((self.most_motions, sum(array.size for array in places))),
        )
        assert interaction.line.passes is not None
        self._free = interaction.line.passes.native
        loads = interaction.line.loads
        self._loads = loads if loads is not None and loads.changes else None
        self._drives = np.zeros((self.most, pantographs.n, drive_width(pantographs.most_contacts)))
        self._counts = np.zeros(1, dtype=native.COUNTS)
        self._made_of: tuple[Any, Any] = None, None
        self._steps: native.Steps
        self._event = event("Steps")

    def take(self, step: int, n_steps: int, left: int, kept: Sequence[int] = ()) -> None:
        """Take up to ``n_steps`` <= ``most`` steps after the one of number ``step``, one at least.

        There are ``left`` steps to come. Of those of the indices ``kept``, at most
        ``most_motions``, the motion is kept.

        Raises
        ------
        RunBroken
            As ``OneSolve.step``; ``taken`` steps are then taken and shown.
        """
        if step != self._first + self._done or self._done == self._ready:
            self._prepare(step, left)
        begin, motion_of = self._done, self._kept.motion_of
        end = min(begin + n_steps, self._ready)
        self._block, self.taken = slice(begin, begin), 0
        motion_of[begin:end] = -1
        self._kept.used[0] = 0
        for number, at in enumerate(kept):
            # The last step is shown as it is.
            if begin + at < end - 1:
                motion_of[begin + at] = number
        try:
            while self._done < end:
                begun, is_full = self._take_on(end)
                if begun:
                    is_full = self._finish()
                if is_full:
                    end = self._done
        finally:
            self.taken = self._done - begin
            self._block = slice(begin, self._done)
            self._showing.follow(self._moved.now)

    def _prepare(self, step: int, left: int) -> None:
        """Fill in the inputs of the steps after number ``step``, ``left`` of them at most.

        Where states are looked at often these are many blocks.
        """
        pantographs, n_steps = self.scheme.pantographs, min(left, self.most)
        times = self.times[:n_steps]
        np.multiply(np.arange(step + 1, step + 1 + n_steps), self._dt, out=times)
        if self._loads is not None:
            n_steps = self._loads.cover(times)
            times = times[:n_steps]
        pantographs.move_to(step * self._dt)
        self.scheme.interaction.line.provide(float(pantographs.speed) * n_steps * self._dt)
        self._moved.end(self._first + self._done, self._done)
        self._moved.begin(step)
        pantographs.fill_drives(times, self._drives[:n_steps])
        self._first, self._done, self._ready = step, 0, n_steps

    def _finish(self) -> bool:
        """Finish a step in the scheme; return whether there is no room for its motion."""
        at = self._done
        time = float(self.times[at])
        self.scheme.finish(time, stop=False)
        self._done += 1
        if not self._shows:
            return False
        self.rows[at] = self._showing.view(self._first + self._done, time, followed=True).row
        return not self._keep_motion(int(self._kept.motion_of[at]))

    def shown(
        self, step: int, kept: Sequence[int], *, broke: bool
    ) -> tuple[np.ndarray, np.ndarray, Iterator[StepView]]:
        """Times, rows and views of the steps of the latest block, the first of which follows number
        ``step``, for observers.

        ``kept`` are the indices of the steps whose motion was kept, as passed to ``take``. A block
        that ``broke`` has left its state amid a step.
        """
        times, rows = self.times[self._block], self.rows[self._block]
        return times, rows, self._views(step, times, rows, kept, broke)

    def _views(
        self, step: int, times: np.ndarray, rows: np.ndarray, kept: Sequence[int], broke: bool
    ) -> Iterator[StepView]:
        """Views of the steps whose motion was kept, then of the last step."""
        showing, room = self._showing, self._kept
        starts, seen = showing.shown.columns.starts, 0
        for number, at in enumerate(kept):
            if at >= self.taken - (not broke):
                break
            begin, end, first = room.stations[number].tolist()
            last = first + 2 * int(starts[end] - starts[begin])
            motion = (begin, end), room.numbers[first:last]
            seen = at + 1
            upto = step + seen, times[:seen], rows[:seen]
            yield showing.view_of(*upto, (motion, room.kept_places[number]))
        if not broke or seen < self.taken:
            yield showing.view_of(step + self.taken, times, rows, broke=broke)

    def _keep_motion(self, number: int) -> bool:
        """Keep the motion of a step as motion ``number``, unless negative; False without room."""
        kept = self._kept
        if number < 0:
            return True
        shown = self._showing.shown
        return bool(native.keep(kept, number, shown.motion, shown.columns))

    def _take_on(self, end: int) -> tuple[bool, bool]:
        """Go on up to before index ``end`` as far as kernels can; whether the scheme has to finish
        a step, and whether there is no room for the motion of the last one."""
        self._event.begin()
        counters = self.scheme.counters
        self._counts[:] = 0
        try:
            taken = self.steps().take(self._done, end)
        finally:
            steps, rounds, slack, repeated, pivoted = self._counts[0].tolist()
            counters.steps += steps
            counters.solves += steps
            counters.rounds += rounds
            counters.slack_dropper_steps += slack
            counters.repeated_steps += repeated
            counters.pivoted_steps += pivoted
            self._done += steps
            self._event.end()
        return taken.begun, taken.is_full

    def steps(self) -> native.Steps:
        """Native steps on the arrays that the scheme has now."""
        coupling = self.scheme.coupling
        assert isinstance(coupling, Implicit)
        share, room = self.scheme.share, coupling.inner.room
        # A step may exchange these arrays for larger ones.
        if self._made_of[0] is not share or self._made_of[1] is not room:
            self._made_of = share, room
            moved, showing = self._moved, self._showing
            parts = step_parts(
                self.scheme,
                self._heads,
                free=self._free,
                loads=[] if self._loads is None else [self._loads.arguments],
                shown=showing.shown,
                channels=showing.layout.copied,
            )
            block = native.Block(
                times=self.times,
                drives=self._drives,
                rows=self.rows,
                now=moved.now,
                behind=moved.behind,
                kept=self._kept,
                counts=self._counts,
            )
            self._steps = self._made(parts, block)
        return self._steps

    def _made(self, parts: native.StepParts, block: native.Block) -> Any:
        """Native steps of these parts."""
        return native.Steps(parts, block)


def step_parts(scheme: OneSolve, heads: Sequence[native.Head], **of_line: Any) -> native.StepParts:
    """Arguments of native steps on the arrays that a scheme has now. Not collective.

    Parameters
    ----------
    scheme : OneSolve
        Scheme whose steps are taken.
    heads : sequence of native.Head
        Its pantographs as kernels step them.
    **of_line
        What the line adds: ``free`` steps, None where others take these, ``loads``, ``shown`` and
        ``channels``.
    """
    pantographs, coupling = scheme.pantographs, scheme.coupling
    assert isinstance(coupling, Implicit)
    n = pantographs.n_contacts
    strips = np.zeros(2 * n * (1 + n))
    problem = coupling.inner.problem(affine(strips, n), scheme.share)
    return native.StepParts(
        speed=float(pantographs.speed),
        train=pantographs.places_along,
        contacts=scheme.interaction.contacts,
        heads=heads,
        strips=strips,
        problem=problem,
        law=coupling.law.in_loop(),
        lateral_place=pantographs.lateral_place,
        switched=np.zeros(problem.room.most, dtype=np.int64),
        train_outputs=pantographs,
        outputs=pantographs.outputs,
        **of_line,
    )


def compiled_steps(
    scheme: Scheme, showing: Showing, dt: float, shows: bool
) -> CompiledSteps | None:
    """Compiled loop over steps of ``dt`` [s], None if the scheme has none. Not collective.

    ``showing`` gives the rows of the steps, which are recorded if ``shows`` is set.
    """
    if not isinstance(scheme, OneSolve) or scheme.comm.size > 1 or scheme.judge is not None:
        return None
    line = scheme.interaction.line
    if not isinstance(scheme.coupling, Implicit) or line.passes is None:
        return None
    if not showing.layout.in_loop:
        return None  # as a channel is a function
    return CompiledSteps(scheme, showing, dt, shows)
