"""Context of PETSc's TS of type ``python``: takes one step at a time, or a block of them."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import Any

from catenary.base.errors import InputError, NotConverged, RunBroken
from catenary.base.petsc import PETSc
from catenary.solver.linear.petsc_solvers import PREFIX, refused_options
from catenary.solver.schemes.scheme import Scheme
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.views.observer_list import ObserverList
from catenary.solver.time_loop.views.step_views import Showing

# Wall time of a block [s], after which a wish to stop is seen, and steps of the first one.
_BLOCK_TIME, _FIRST_BLOCK = 0.05, 16
# So many times more steps may the next one have.
_GROWTH = 4


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
        blocks.show_to(self._observer_list, first, kept, broke=broken is not None)
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
