"""PETSc's TS around a stepper: its options, and those that the scene decides."""

from __future__ import annotations

from typing import Any

from catenary.base.errors import InputError
from catenary.base.petsc import PETSc
from catenary.solver.linear.petsc_solvers import PREFIX, refused_options
from catenary.solver.time_loop.ts_stepper import Stepper


def ts_of(comm: Any, stepper: Stepper, dt: float, steps: tuple[int, int], n_steps: int) -> PETSc.TS:
    """A time loop that takes the steps of a stepper. Collective.

    Parameters
    ----------
    dt : time step [s]
    steps : number of the step from which it goes on, and of its last one
    n_steps : of the whole run, which options of PETSc see

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
    _refuse_what_the_scene_says(ts, dt, first * dt)
    if end < n_steps:
        ts.setMaxSteps(min(end, ts.getMaxSteps()))
    return ts


def _refuse_what_the_scene_says(ts: PETSc.TS, dt: float, start_time: float) -> None:
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
