"""The march: PETSc's TS drives our stepper, and observers are shown every state.

The Newmark family runs as a TS of type ``python``: PETSc owns the time loop, its options (prefix
``march_``), its monitors and its events; the stepper advances line and pantographs, by one step or,
where nobody looks at each, by a block of them.

Incidents cut a march into parts, each with a TS, matrices and columns of its own: a step of any
part costs what it costs without incidents. What happens at the end of a step is shown before.
"""

from __future__ import annotations

import gc
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from catenary.base.errors import CatenaryError, InputError, RunBroken
from catenary.base.mpi import MPI
from catenary.base.petsc import PETSc
from catenary.base.process import give_back
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import Pantographs, nominal_height_rule
from catenary.solver.effects.all_effects import simulated
from catenary.solver.integrators.slow_path import (
    SlowPath,
    single_steps_of,
    warn_of_slow_path,
)
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.linear.petsc_solvers import wants_single_steps, wants_solution
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import Happened, LineIncident, in_steps
from catenary.solver.problem.problem import Problem, steps_of
from catenary.solver.schemes.make_scheme import Parts, make_parts
from catenary.solver.schemes.scheme import OneSolve, Scheme
from catenary.solver.statics.after_incidents import (
    ChangedLine,
    acceleration_jump,
    changed_line,
    divided_by_mass,
    unchanged,
)
from catenary.solver.statics.elasticity import Elasticity
from catenary.solver.time_loop.compiled_steps import compiled_steps
from catenary.solver.time_loop.ts_stepper import ObserverList, Stepper, ts_of
from catenary.solver.time_loop.views.observers import Observer
from catenary.solver.time_loop.views.step_views import Showing
from catenary.solver.window.moving_columns import MovingColumns


@dataclass
class Outcome:
    """Result of a march.

    Attributes
    ----------
    outcome : "done", "interrupted" or the sentence of what broke
    wall : wall time of the time loop, changes of the line on the way included [s]
    cpu : processor time of this process in the time loop [s]
    n_steps : number of steps taken
    counters : counters of the scheme, by name
    traffic : messages and bytes a step since the line changed last, of the rank that sent most: to
        its neighbours, and each sum and broadcast as one; None on one rank, or if not counted
    slow_path : reason why steps took longer than they could, "" if they did not
    finishing : time after the loop in which observers wrote their remaining data [s]
    """

    outcome: str
    wall: float
    cpu: float
    n_steps: int
    counters: dict[str, int] = field(default_factory=dict)
    traffic: tuple[float, float] | None = None
    slow_path: str = ""
    finishing: float = 0.0


class March:
    """A line with its train, ready to run. Collective to make; ``destroy`` is collective too.

    A context manager that destroys itself.

    Attributes
    ----------
    first_step : number of the step that it goes on from

    Parameters
    ----------
    comm : mpi4py communicator
    problem, model, form : arguments and result of ``form_finding.find_form``, on all ranks
    elasticity : of the contact wires in a running span, for the height at which static forces are
        defined
    """

    def __init__(
        self,
        comm: Any,
        problem: Problem,
        model: Model,
        form: Equilibrium,
        elasticity: Elasticity,
    ) -> None:
        self._comm = comm
        self._problem = problem
        if problem is not model.problem:
            # The same line under other laws: a contact, a train, a damping of its own.
            model = replace(model, problem=problem, simulated=simulated(problem))
        self._first = model
        self._form = form
        self.ownership = distribute(model, comm.size, comm.rank)
        self._wire = ContactWires(model, form, self.ownership)
        height = nominal_height_rule(problem, model.simulated, self._wire, elasticity)
        self._pantographs = Pantographs(comm, problem, model.simulated, self._wire, height)
        self._moving = MovingColumns()
        # Arrays of a long line are large, so that the first parts take these.
        self._set_up(unchanged(model, form), self._wire)
        self._set_off(model)
        self._showing.cross(0.0)
        give_back(model.n_unknowns)
        self.first_step = 0
        self._happened: tuple[LineIncident, ...] = ()
        self._ahead = self._happening()
        if self.slow_path is not None and comm.rank == 0:
            warn_of_slow_path(self.slow_path)

    def _set_up(self, changed: ChangedLine, wires: ContactWires | None = None) -> None:
        """Make all that steps a line and shows it, from a line that is at rest. Collective."""
        self._changed = changed
        parts = make_parts(
            self._comm, self.ownership, self._problem, changed, self._pantographs, wires
        )
        self._line, self._scheme = parts.line, parts.scheme
        if self._problem.numerics.adaptive_tolerance is not None:
            self._scheme = self._in_levels(changed, parts)
        self._showing = Showing(
            self._comm,
            changed,
            self._form,
            parts.interaction,
            self._pantographs,
            self._scheme,
            self._moving,
        )

    def _set_off(self, model: Model) -> None:
        """Start with the acceleration by loads that act from the start on. Collective."""
        line = self._line
        if line.loads is None:
            return
        line.load_at(0.0)
        force = line.loads.values[line.operators.domain.owned]
        if self._comm.allreduce(int(force.any()), op=MPI.MAX):
            still = np.zeros(force.size)
            line.start(still, still, divided_by_mass(self._comm, self.ownership, model, force))

    def _in_levels(self, changed: ChangedLine, whole: Parts) -> Scheme:
        """The scheme of ``whole`` steps, with shorter ones where they are needed. Collective."""
        from catenary.solver.schemes.adaptive_steps import StepLevels

        problem = self._problem

        def finer(level: int) -> Parts:
            numerics = replace(problem.numerics, dt=problem.numerics.dt / 2**level)
            finer_problem = replace(problem, numerics=numerics)
            laws = self._first.simulated
            height = self._pantographs.nominal_height
            pantographs = Pantographs(self._comm, finer_problem, laws, self._wire, height)
            return make_parts(self._comm, self.ownership, finer_problem, changed, pantographs)

        return StepLevels(self._comm, problem.numerics, whole, finer)

    def _happening(self) -> list[Happened]:
        """Simulated incidents of the line, in order of time."""
        return in_steps(self._first.simulated.incidents, self._problem.numerics.dt)

    def _happen(self, happened: Happened) -> None:
        """Change the line under way; motion, contacts and counters go on. Collective."""
        before, line, scheme = self._changed, self._line, self._scheme
        after, step = changed_line(self._first, self._form, happened.incidents), happened.step
        moving = line.displacement, line.velocity
        jump = acceleration_jump(self._comm, self.ownership, before, after, moving)
        try:
            self._set_up(after)
            # The memory of the method besides the state moves with the acceleration.
            nothing = np.zeros_like(jump)
            self._line.start(nothing, nothing, jump)
            moved = line.state()
            jumped = self._line.state()
            self._line.restore({name: values + moved[name] for name, values in jumped.items()})
            past = line.past()
            if past is not None:
                self._line.recall(past, step)
            self._scheme.restore(scheme.state())
            self._scheme.counters = scheme.counters
        finally:
            scheme.destroy()
            line.destroy()
        self._happened = happened.incidents

    @property
    def station_widths(self) -> tuple[int, ...]:
        """Unknowns of a whole cross-section in each plane, planes that no matrix joins apart."""
        return self._line.operators.station_widths

    @property
    def slow_path(self) -> SlowPath | None:
        """Reason why steps are slow, None if they are not; with several ranks that of the line."""
        if self._line.slow_path is not None or self._comm.size > 1:
            return self._line.slow_path
        return single_steps_of(self._problem, self._showing.layout.in_loop)

    @property
    def n_steps(self) -> int:
        """Steps from the start of the run to its end."""
        return steps_of(self._problem)

    def restore(self, checkpoint: dict[str, Any]) -> None:
        """Continue from what ``StepView.checkpoint`` gave, on any number of ranks.

        Collective; every rank passes the same checkpoint. A march may go back to an earlier one.

        Raises
        ------
        InputError
            On all ranks, if it is not one of this line, or beyond the end of the run.
        """
        self.first_step = int(checkpoint["step"])
        if not 0 <= self.first_step <= self.n_steps:
            raise InputError(
                f"the state to continue from is of step {self.first_step}, and the run has "
                f"{self.n_steps}; start the run anew"
            )
        happening = self._happening()
        past = [happened for happened in happening if happened.step < self.first_step]
        incidents = past[-1].incidents if past else ()
        if incidents != self._happened:
            self.destroy()
            changed = changed_line(self._first, self._form, incidents)
            self._set_up(changed if incidents else unchanged(self._first, self._form))
        self._happened, self._ahead = incidents, happening[len(past) :]
        time = self.first_step * self._problem.numerics.dt
        self._pantographs.move_to(time)
        self._showing.checkpoints.restore(checkpoint)
        self._showing.cross(time, found=True)

    def run(
        self,
        observers: Sequence[Observer],
        stop_requested: Callable[[], bool] = lambda: False,
    ) -> Outcome:
        """March to the end, or until any rank's ``stop_requested`` says so. Collective.

        A step that breaks ends the march with its sentence as the outcome; observers have then
        seen everything up to the last good step.

        Raises
        ------
        InputError
            If an option under ``-march_`` is refused; no observer was started then.
        RunBroken
            If an observer cannot start.
        """
        dt, first = self._problem.numerics.dt, self.first_step
        since = first
        ahead = [happened for happened in self._ahead if happened.step < self.n_steps]
        ends = [*(happened.step for happened in ahead), self.n_steps]

        # PETSc's monitors of the solution look at each.
        def fill() -> None:
            self._line.solution.setArray(self._line.displacement)

        observer_list = ObserverList(observers, fill if wants_solution() else None)
        ts = self._make_ts(observer_list, stop_requested, first, ends[0])
        try:
            observer_list.start(self._showing.stage(dt, first * dt, self.n_steps))
        except RunBroken:
            ts.destroy()
            raise
        begin, computed = clock.perf_counter(), clock.process_time()
        try:
            observer_list.show(lambda: self._showing.view(first, first * dt))
        except RunBroken as error:
            self._stepper.broken = str(error)
        else:
            self._advance(ts)
        for happened, end in zip(ahead, ends[1:], strict=True):
            if not self._stepper.goes_on_from(happened.step):
                break
            ts.destroy()
            try:
                self._happen(happened)
            except RunBroken as error:
                self._stepper.broken = str(error)
                break
            since = happened.step
            ts = self._make_ts(observer_list, stop_requested, since, end)
            self._advance(ts)
        wall, cpu = clock.perf_counter() - begin, clock.process_time() - computed
        if self._stepper.broken:
            # The error's traceback may still hold the TS, which PETSc would then free, with the
            # help of Python, when Python has ended.
            gc.collect()
        ts.destroy()
        outcome = "done"
        if self._stepper.broken:
            outcome = self._stepper.broken
        elif self._stepper.stopped or self._stepper.step_number < self.n_steps:
            # The latter if an option of PETSc ends early, for instance -march_ts_max_steps.
            outcome = "interrupted"
        begin = clock.perf_counter()
        outcome = observer_list.finish(outcome)
        finishing = clock.perf_counter() - begin
        n_steps = self._stepper.step_number - first
        return Outcome(
            outcome,
            wall,
            cpu,
            n_steps,
            self._scheme.counters.as_dict(),
            self._traffic(max(1, self._stepper.step_number - since)),
            "" if self.slow_path is None else str(self.slow_path),
            finishing,
        )

    def in_loop(self) -> tuple[OneSolve, Showing, float]:
        """Scheme, shown channels and time step [s] of a march that one compiled loop takes
        from its start to its end. Not collective; one rank only.

        Raises
        ------
        InputError
            If its steps need more than that.
        """
        dt = self._problem.numerics.dt
        if self._ahead:
            raise InputError(
                "incidents change the line, and a prepared line stays as it is: take them away "
                "(incidents=)"
            )
        if compiled_steps(self._scheme, self._showing, dt, shows=False) is None:
            why = (
                "numerics.scheme is not one_solve"
                if self.slow_path is None
                else self.slow_path.reason
            )
            raise InputError(f"a prepared line takes all steps in the compiled loop, but {why}")
        assert isinstance(self._scheme, OneSolve)
        return self._scheme, self._showing, dt

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        self._scheme.destroy()
        self._line.destroy()

    def __enter__(self) -> March:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        # Errors of ours reach all ranks; at any other the rest may be waiting elsewhere.
        if error is None or isinstance(error, CatenaryError):
            self.destroy()

    def _advance(self, ts: PETSc.TS) -> None:
        """March to the end of ``ts``. Collective."""
        # Vectors like the solution are made, of the length of the line, which only options read.
        solution = self._line.solution
        if not wants_single_steps():
            solution = PETSc.Vec().createMPI((1, None), comm=self._comm)
        with flushed():
            ts.solve(solution)
        if solution is not self._line.solution:
            solution.destroy()

    def _traffic(self, n_steps: int) -> tuple[float, float] | None:
        """Messages and bytes a step of the rank that sent most; None if none. Collective."""
        scheme = self._scheme.traffic
        if self._comm.size == 1 or scheme is None:
            return None
        sent = np.array(scheme, dtype=float) / n_steps + np.array(self._line.operators.traffic)
        self._comm.Allreduce(MPI.IN_PLACE, sent, op=MPI.MAX)
        return float(sent[0]), float(sent[1])

    def _make_ts(
        self,
        observer_list: ObserverList,
        stop_requested: Callable[[], bool],
        first: int,
        end: int,
    ) -> PETSc.TS:
        """The time loop from step ``first``, shown already, to step ``end``. Collective."""
        dt = self._problem.numerics.dt
        blocks = None
        if not wants_single_steps():
            blocks = compiled_steps(self._scheme, self._showing, dt, observer_list.is_there)
        self._stepper = Stepper(
            self._scheme, self._showing, observer_list, stop_requested, dt, (first, end), blocks
        )
        return ts_of(self._comm, self._stepper, dt, (first, end), self.n_steps)
