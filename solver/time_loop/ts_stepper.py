"""One step at a time, as PETSc's TS of type ``python`` asks for it."""

from __future__ import annotations

from collections.abc import Callable

from catenary.solver.base.errors import NotConverged, RunBroken
from catenary.solver.base.petsc import PETSc
from catenary.solver.schemes.scheme import Scheme


class Stepper:
    """Context of a TS of type ``python`` that advances a scheme and shows each step.

    A step that breaks is told with its time and place, whatever broke in it, and counted if its
    equations were not solved.

    Parameters
    ----------
    show : called with number and time [s] of each good step; raises RunBroken, on all ranks, if
        nobody can watch any longer

    Attributes
    ----------
    step_number : of the last good step
    stopped : whether the scheme wanted no further step
    broken : the sentence of what broke, empty if nothing did
    """

    def __init__(
        self,
        scheme: Scheme,
        first_step: int,
        dt: float,
        stop_requested: Callable[[], bool],
        show: Callable[[int, float], None],
    ) -> None:
        self._scheme = scheme
        self._dt = dt
        self._stop_requested = stop_requested
        self._show = show
        self.step_number = first_step
        self.stopped = False
        self.broken = ""

    def step(self, ts: PETSc.TS) -> None:
        """Called by PETSc; errors may not pass through it, so they are kept for the march."""
        # Times are multiples of dt, not sums, so that a long run does not drift.
        time = (self.step_number + 1) * self._dt
        try:
            goes_on = self._scheme.step(time, self._stop_requested())
        except RunBroken as error:
            scheme = self._scheme
            scheme.counters.unconverged_steps += isinstance(error, NotConverged)
            place = float(scheme.pantographs.position[0])
            step = f"the step to t = {time:.4f} s with the train at {place:.1f} m"
            self._give_up(ts, f"{step}: {error}")
            return
        self.step_number += 1
        try:
            self._show(self.step_number, time)
        except RunBroken as error:
            self._give_up(ts, str(error))
            return
        ts.setTime(time)
        if not goes_on:
            self.stopped = True
            ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)

    def goes_on_from(self, step: int) -> bool:
        """Whether nothing broke or stopped before the end of this step."""
        return not (self.broken or self.stopped) and self.step_number == step

    def _give_up(self, ts: PETSc.TS, why: str) -> None:
        """End the time loop because of an error that the march reports."""
        self.broken = why
        # Not a reason of failure, for which PETSc would raise an error of its own.
        ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)

    def view(self, ts: PETSc.TS, viewer: PETSc.Viewer) -> None:
        """Name the scheme in -march_ts_view."""
        viewer.printfASCII(
            f"  step of the line and its train by scheme {type(self._scheme).__name__}\n"
        )
