"""Context of PETSc's TS of type ``python``: takes one step at a time, or a block of them.

The observers of a march get blocks of steps, which end where one needs a state.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from catenary.base.errors import InputError, NotConverged, RunBroken
from catenary.base.petsc import PETSc, event
from catenary.solver.linear.petsc_solvers import PREFIX, refused_options
from catenary.solver.schemes.scheme import Scheme
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView
from catenary.solver.time_loop.views.step_views import Showing

# Wall time of a block [s], after which a wish to stop is seen, and steps of the first one.
_BLOCK_TIME, _FIRST_BLOCK = 0.05, 16
# So many times more steps may the next one have.
_GROWTH = 4


class ObserverList:
    """The observers of a run. Methods are called on all ranks at the same steps.

    Parameters
    ----------
    observers : in the order in which they are shown what there is
    after : called after each state is shown
    """

    def __init__(self, observers: Sequence[Observer], after: Callable[[], None] | None) -> None:
        self._observers = observers
        self._after = after
        # The latest step that each was shown.
        self._latest = [0] * len(observers)
        self._event = event("Show")

    @property
    def is_there(self) -> bool:
        """Whether there are observers."""
        return bool(self._observers)

    def start(self, stage: Stage) -> None:
        """Start all observers. If one cannot, those before end with its sentence, and RunBroken is
        raised."""
        for number, observer in enumerate(self._observers):
            try:
                observer.start(stage)
            except RunBroken as error:
                ObserverList(self._observers[:number], None).finish(str(error))
                raise

    def next_state(self, step: int) -> int:
        """The next step after ``step`` whose state has to be shown; rows of others will do."""
        if self._after is not None:
            return step + 1
        return min((one.next_state(step) for one in self._observers), default=NEVER)

    def next_motion(self, step: int) -> int:
        """The next step after ``step`` whose motion has to be kept."""
        return min((one.next_motion(step) for one in self._observers), default=NEVER)

    def show(self, view: Callable[[], StepView]) -> None:
        """Show a state to the observers; RunBroken if one cannot go on."""
        if self._observers:
            with self._event:
                shown = view()
                for number, observer in enumerate(self._observers):
                    self._latest[number] = shown.step
                    observer.observe(shown)
        if self._after is not None:
            self._after()

    def show_block(
        self,
        first: int,
        times: np.ndarray,
        rows: np.ndarray,
        views: Iterable[StepView],
    ) -> None:
        """Show a block of steps; RunBroken if an observer cannot go on.

        Parameters
        ----------
        first : int
            Number of the step before the block, which is shown.
        times, rows : ndarray
            Times (k,) [s] and rows (k, n) of its steps.
        views : iterable of StepView
            Views of the steps whose motion is kept, then of the last step.
        """
        last = first + len(times)
        if last == first:
            return
        if self._observers:
            with self._event:
                for view in views:
                    step = view.step
                    for number, observer in enumerate(self._observers):
                        if step < last and observer.next_motion(step - 1) != step:
                            continue
                        since, self._latest[number] = self._latest[number] - first, step
                        view.move_to(step, times[since : step - first], rows[since : step - first])
                        observer.observe(view)
        if self._after is not None:
            self._after()

    def finish(self, outcome: str) -> str:
        """Call the ``finish`` of all observers; return how the march ended after that.

        An observer that breaks now changes a good end to its sentence for those that follow.
        """
        for observer in self._observers:
            try:
                observer.finish(outcome)
            except RunBroken as error:
                if outcome in ("done", "interrupted"):
                    outcome = str(error)
        return outcome


class Stepper:
    """Context of a TS of type ``python`` that advances a scheme and shows each step.

    A step that breaks is reported with its time and place, whatever broke in it, and counted if its
    equations were not solved. For PETSc a block is a step, but for the number of the step.

    Parameters
    ----------
    observer_list : is shown each good step; raises RunBroken, on all ranks, if none can watch any
        longer
    steps : number of the first step, which is shown already, and of the last one
    blocks : takes steps of the scheme many at once, None to take each for itself

    Attributes
    ----------
    step_number : of the last good step
    stopped : whether the scheme has ended the march
    broken : the sentence of what broke, empty if nothing did
    """

    def __init__(
        self,
        scheme: Scheme,
        showing: Showing,
        observer_list: ObserverList,
        stop_requested: Callable[[], bool],
        dt: float,
        steps: tuple[int, int],
        blocks: CompiledSteps | None,
    ) -> None:
        self._scheme = scheme
        self._showing = showing
        self._observer_list = observer_list
        self._stop_requested = stop_requested
        self._dt = dt
        self.step_number, self._end = steps
        self._blocks = blocks
        self._most = _FIRST_BLOCK
        self.stopped = False
        self.broken = ""

    def step(self, ts: PETSc.TS) -> None:
        """Called by PETSc; errors may not pass through it, so they are kept for the march."""
        goes_on, stop = True, self._stop_requested()
        try:
            if self._blocks is None or stop:
                goes_on = self._step(stop)
            else:
                self._take(self._blocks, ts)
        except RunBroken as error:
            self.broken = str(error)
            # Not a reason of failure, for which PETSc would raise an error of its own.
            ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)
            return
        ts.setTime(self.step_number * self._dt)
        if not goes_on:
            self.stopped = True
            ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)

    def goes_on_from(self, step: int) -> bool:
        """Whether nothing broke or stopped before the end of this step."""
        return not (self.broken or self.stopped) and self.step_number == step

    def view(self, ts: PETSc.TS, viewer: PETSc.Viewer) -> None:
        """Name the scheme in -march_ts_view."""
        viewer.printfASCII(
            f"  step of the line and its train by scheme {type(self._scheme).__name__}\n"
        )

    def _step(self, stop: bool) -> bool:
        """Take one step and show it; False if it is the last."""
        number = self.step_number + 1
        # Times are multiples of dt, not sums, so that a long run does not drift.
        time = number * self._dt
        try:
            goes_on = self._scheme.step(time, stop)
        except RunBroken as error:
            raise self._placed(error) from error
        self.step_number = number
        self._observer_list.show(lambda: self._showing.view(number, time))
        return goes_on

    def _take(self, blocks: CompiledSteps, ts: PETSc.TS) -> None:
        """Take steps up to the next state that an observer needs, and show them."""
        first = self.step_number
        until = min(self._end, self._observer_list.next_state(first))
        n_steps = min(until - first, blocks.most, self._most)
        n_steps, kept = self._motions_of(blocks, first, n_steps)
        begin, broken = clock.perf_counter(), None
        try:
            blocks.take(first, n_steps, self._end - first, kept)
        except RunBroken as error:
            broken = error
        spent = clock.perf_counter() - begin
        allowed = int(_BLOCK_TIME * n_steps / max(spent, 1e-9))
        self._most = max(1, min(_GROWTH * self._most, allowed))
        self.step_number = first + blocks.taken
        shown = blocks.shown(first, kept, broke=broken is not None)
        self._observer_list.show_block(first, *shown)
        if broken is not None:
            raise self._placed(broken) from broken
        ts.setStepNumber(self.step_number - 1)  # PETSc adds one

    def _motions_of(self, blocks: CompiledSteps, first: int, n_steps: int) -> tuple[int, list[int]]:
        """Steps of a block after step ``first`` that wants ``n_steps``, and which of them keep the
        motion; it ends where there is no room for a further one."""
        kept: list[int] = []
        at = self._observer_list.next_motion(first)
        while at < first + n_steps:
            if len(kept) == blocks.most_motions:
                return at - first, kept
            kept.append(at - first - 1)
            at = self._observer_list.next_motion(at)
        return n_steps, kept

    def _placed(self, error: RunBroken) -> RunBroken:
        """The error of the next step with its time and place."""
        scheme = self._scheme
        scheme.counters.unconverged_steps += isinstance(error, NotConverged)
        time, place = (self.step_number + 1) * self._dt, float(scheme.pantographs.position[0])
        return RunBroken(f"the step to t = {time:.4f} s with the train at {place:.1f} m: {error}")


def ts_of(comm: Any, stepper: Stepper, dt: float, steps: tuple[int, int], n_steps: int) -> PETSc.TS:
    """A time loop that takes the steps of a stepper. Collective.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of the ranks.
    stepper : Stepper
        Stepper whose steps are taken.
    dt : float
        Time step [s].
    steps : tuple of int
        Numbers of the step from which the loop goes on and of its last one.
    n_steps : int
        Number of steps of the whole run, which options of PETSc see.

    Raises
    ------
    InputError
        If an option under ``-march_`` is refused.
    """
    first, end = steps
    ts = PETSc.TS().create(comm)
    ts.setOptionsPrefix(PREFIX)
    ts.setProblemType(PETSc.TS.ProblemType.NONLINEAR)
    ts.createPython(stepper, comm=comm)
    ts.setOptionsPrefix(PREFIX)
    ts.setTime(first * dt)
    ts.setTimeStep(dt)
    ts.setStepNumber(first)
    ts.setMaxSteps(n_steps)
    ts.setMaxTime(2.0 * n_steps * dt)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.STEPOVER)
    with refused_options():
        ts.setFromOptions()
    _refuse_options_of_the_scene(ts, dt, first * dt)
    if end < n_steps:
        ts.setMaxSteps(min(end, ts.getMaxSteps()))
    return ts


def _refuse_options_of_the_scene(ts: PETSc.TS, dt: float, start_time: float) -> None:
    found = ""
    if abs(ts.getTimeStep() - dt) > 1e-12 * dt:
        found = (
            f"_dt is {ts.getTimeStep():g}; the time step is part of the scene: give "
            f"numerics.dt_s instead, which is {dt:g} s"
        )
    elif ts.getTime() != start_time:
        found = (
            f"_init_time is {ts.getTime():g}, but the run starts at {start_time:g} s; "
            "give train.start_m instead"
        )
    elif ts.getType() != PETSc.TS.Type.PYTHON:
        found = (
            f"_type is {ts.getType()}; the method is part of the scene: give "
            "numerics.scheme, numerics.integrator, numerics.newmark_beta or "
            "numerics.newmark_gamma instead"
        )
    if found:
        ts.destroy()
        raise InputError(f"the PETSc option -{PREFIX}ts{found}")
