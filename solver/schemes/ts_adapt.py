"""PETSc's TSAdapt as a controller of step sizes: which steps are taken, and how long the next is.

petsc4py does not expose TSAdapt, and a TS of type ``python`` takes its step size from the hook
``adaptStep`` of its context, never from its own TSAdapt. So a small TS on one rank presents the
estimated error as the difference of two solutions, and PETSc's C functions are called through
ctypes, from the library that petsc4py has loaded. All five are public: they are declared in
``petscts.h`` and have manual pages (TSGetAdapt; TSAdaptCandidatesClear, TSAdaptCandidateAdd,
TSAdaptChoose and TSAdaptCheckStage at the level of developers of time steppers). Arguments are
handles, integers, reals and booleans of the sizes that petsc4py was built with. Options are those
of PETSc: ``-march_ts_adapt_type``, ``_safety``, ``_reject_safety``, ``_clip``,
``_always_accept``, ``_scale_solve_failed``, ``_monitor``.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.base.petsc import PETSc
from catenary.solver.linear.petsc_solvers import PREFIX, refused_options

# The local error of a step of a method of order two falls with the cube of its size.
_ORDER = 3
_Int = ctypes.c_int64 if np.dtype(PETSc.IntType).itemsize == 8 else ctypes.c_int
_Real = ctypes.c_double
_FAILED = -3  # SNES_DIVERGED_LINEAR_SOLVE, as good as any other reason


class Choice(NamedTuple):
    """Whether a step is taken, and the size of the next, or of its repetition [s]."""

    accepted: bool
    size: float


class StepControl:
    """A controller on this rank alone. Not collective; the maker calls ``destroy``.

    Parameters
    ----------
    tolerance : of the estimated error of a step [N]
    longest, smallest : limits of the step size [s]

    Raises
    ------
    InputError
        If PETSc refuses an option, or one gives what the scene gives.
    """

    def __init__(self, tolerance: float, longest: float, smallest: float) -> None:
        self._library = ctypes.CDLL(PETSc.__file__)
        self._error = _ErrorAsStep()
        self._solution = PETSc.Vec().createSeq(1)
        self._ts = ts = PETSc.TS().create(PETSc.COMM_SELF)
        ts.setOptionsPrefix(PREFIX)
        ts.createPython(self._error, comm=PETSc.COMM_SELF)
        ts.setOptionsPrefix(PREFIX)
        ts.setSolution(self._solution)
        ts.setTolerances(rtol=0.0, atol=tolerance)
        ts.setStepLimits(smallest, longest)
        ts.setMaxSNESFailures(-1)
        self._set_from_options(tolerance, longest, smallest)
        self._adapt = ctypes.c_void_p()
        self._call("TSGetAdapt", self._handle, ctypes.byref(self._adapt))
        self._call("TSAdaptCandidatesClear", self._adapt)
        self._call(
            "TSAdaptCandidateAdd",
            self._adapt, None, _Int(_ORDER), _Int(1), _Real(1.0), _Real(1.0), ctypes.c_int(1),
        )  # fmt: skip
        self._next, self._accepts = _Real(), ctypes.c_int(1)
        # Called at every step, so that what it is called with is made once.
        self._choose = self._library.TSAdaptChoose
        self._choose.argtypes = [ctypes.c_void_p, ctypes.c_void_p, _Real, *[ctypes.c_void_p] * 3]
        self._results = (None, ctypes.addressof(self._next), ctypes.addressof(self._accepts))
        self._n_accepted = 0

    def choose(self, error: float, time: float, size: float) -> Choice:
        """What to do with a step of ``size`` [s] to ``time`` [s], wrong by ``error`` [N]."""
        ts = self._ts
        # For the monitor alone.
        ts.setTime(time - size)
        ts.setStepNumber(self._n_accepted)
        ts.setTimeStep(size)
        self._error.value = error
        code = self._choose(self._adapt, ts.handle, size, *self._results)
        if code:
            raise PETSc.Error(code)
        accepted = bool(self._accepts.value)
        self._n_accepted += accepted
        return Choice(accepted, self._next.value)

    def after_failure(self, time: float, size: float) -> float:
        """Size [s] with which to repeat a step of ``size`` [s] that has no solution."""
        ts = self._ts
        ts.setTime(time - size)
        ts.setTimeStep(size)
        ts.getSNES().setConvergedReason(_FAILED)
        self._call(
            "TSAdaptCheckStage",
            self._adapt, self._handle, _Real(time), ctypes.c_void_p(self._solution.handle),
            ctypes.byref(self._accepts),
        )  # fmt: skip
        return float(ts.getTimeStep())

    def destroy(self) -> None:
        """Free all PETSc objects."""
        self._ts.destroy()
        self._solution.destroy()

    @property
    def _handle(self) -> ctypes.c_void_p:
        return ctypes.c_void_p(self._ts.handle)

    def _call(self, name: str, *arguments: Any) -> None:
        code = getattr(self._library, name)(*arguments)
        if code:
            raise PETSc.Error(code)

    def _set_from_options(self, tolerance: float, longest: float, smallest: float) -> None:
        """PETSc's basic controller unless an option says otherwise; see `ts_alpha2`."""
        ts, options, name = self._ts, PETSc.Options(PREFIX), "ts_adapt_type"
        own = not options.hasName(name)
        if own:
            options.setValue(name, "basic")
        try:
            with refused_options():
                ts.setFromOptions()
                ts.setUp()
        finally:
            if own:
                options.delValue(name)
        relative, absolute = ts.getTolerances()
        for option, found, said, key in (
            ("ts_atol", absolute, tolerance, "numerics.adaptive_tolerance_N"),
            ("ts_rtol", relative, 0.0, "numerics.adaptive_tolerance_N"),
            ("ts_adapt_dt_min", ts.getStepLimits()[0], smallest, "numerics.smallest_dt_s"),
            ("ts_adapt_dt_max", ts.getStepLimits()[1], longest, "numerics.dt_s"),
        ):
            if found != said:
                self.destroy()
                raise InputError(
                    f"the PETSc option -{PREFIX}{option} is {found:g}; the scene says it: give "
                    f"{key} instead"
                )


class _ErrorAsStep:
    """Context of the small TS: its solution is 0, and that of lower order is the error ``value``,
    so that PETSc's weighted norm of their difference is the error over its tolerance."""

    value = 0.0

    def step(self, ts: PETSc.TS) -> None:
        """Never called: the march steps."""
        raise NotImplementedError("this TS only controls")

    def evaluatestep(self, ts: PETSc.TS, order: int, result: PETSc.Vec) -> bool:
        """The error as the solution of lower order."""
        result.set(self.value)
        return True
