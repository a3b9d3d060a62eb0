"""Solvers for the constant step operator: factored once, by stations or by PETSc.

On several ranks each solves for its own part of the line and as much of its neighbours' as can
influence it: restricted additive Schwarz with an overlap as wide as the reach of A^-1, which is a
direct solver. ``LineOperators`` verifies that, and iterates where it does not hold.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from catenary.base.errors import InputError
from catenary.base.petsc import PETSc
from catenary.solver.linear.station_factors import StationFactors
from catenary.solver.model.matrices import as_petsc
from catenary.solver.model.partition import Ownership

PREFIX, PART_PREFIX = "march_", "march_sub_"
# Options that show a solver and change nothing.
_LOOKS = (f"{PREFIX}ksp_view", f"{PREFIX}ksp_monitor", f"{PREFIX}ksp_converged_reason")
# A direct solve of a matrix as well conditioned as A (below 1e6) leaves about 1e-15.
DIRECT = 1e-12


def trial_load(low: int, high: int) -> np.ndarray:
    """A load on the unknowns from ``low`` to before ``high``, on each another one, by which the
    residual of a solve is judged."""
    return np.cos(1.0 + 3.7 * np.arange(low, high))


@contextmanager
def refused_options() -> Iterator[None]:
    """Turn PETSc's error about an option into one for the user. Every rank meets the same one.

    Raises
    ------
    InputError
    """
    try:
        yield
    except PETSc.Error as error:
        words = [line for line in str(error).splitlines() if line.strip()]
        last = words[-1].partition("] ")[2] or words[-1]
        raise InputError(
            f"PETSc refuses the options under -{PREFIX}, which the scene's [petsc] table and the "
            f"words after -- give: {last}"
        ) from error


class Wrapped(NamedTuple):
    """An array and the PETSc vector that wraps it: the same numbers for both."""

    array: np.ndarray
    vector: PETSc.Vec

    def tell_petsc(self) -> None:
        """Tell PETSc that the array was written.

        A vector keeps its norm until PETSc is informed of a change of its numbers: an iteration
        would take the norm of an earlier right-hand side, or keep an initial guess because it
        takes it for zero already (PETSc 3.22).
        """
        self.vector.stateIncrease()


class KspSolver:
    """A PETSc solver of the step operator. Collective on the communicator of its ``KSP``.

    Attributes
    ----------
    matrix : the operator, as PETSc's
    """

    matrix: PETSc.Mat
    _ksp: PETSc.KSP

    def solve(self, right: Wrapped, solution: Wrapped) -> None:
        """Solve A ``solution`` = ``right``. Collective."""
        right.tell_petsc()
        solution.tell_petsc()
        self._ksp.solve(right.vector, solution.vector)

    @property
    def is_direct(self) -> bool:
        """Whether one application of the preconditioner is all of a solve."""
        return bool(self._ksp.getType() == PETSc.KSP.Type.PREONLY)

    @property
    def failure(self) -> int:
        """PETSc's reason why the last solve did not converge; 0 if it did."""
        return min(0, self._ksp.getConvergedReason())

    def iterate(self) -> None:
        """Use what is set up as a preconditioner of GMRES from now on."""
        self._ksp.setType(PETSc.KSP.Type.GMRES)
        self._ksp.setTolerances(rtol=1e-14, max_it=200)


class PartSolver(KspSolver):
    """Factors of this rank's part of the step operator, all of it on one rank.

    Not collective. With an overlap as wide as the reach of A^-1 the rank's own unknowns are exact
    without messages to other ranks; ``residual`` of ``LineOperators`` verifies that.

    PETSc's matrix and solver are made if our own factors cannot be used, if PETSc's options concern
    them, and for an iteration.

    Parameters
    ----------
    part : assembles the part of the operator, in blocks of stations or of nodes
    in_stations : whether the blocks are stations
    is_whole : whether the part is the whole line, which decides the prefix of its options
    factors : our own, None if they cannot be used

    Attributes
    ----------
    factors : our own, None if PETSc's are used
    """

    def __init__(
        self,
        part: Callable[[], sparse.bsr_matrix],
        in_stations: bool,
        is_whole: bool,
        factors: StationFactors | None = None,
    ) -> None:
        self._part, self._in_stations = part, in_stations
        self._prefix, self.factors = _prefix(is_whole), factors
        self._made: list[Callable[[], object]] = []  # what frees PETSc's objects
        self._solve: Callable[[Wrapped, Wrapped], None] = super().solve
        if self.factors is None or _is_given(f"{self._prefix}ksp_", f"{self._prefix}mat_"):
            self._ksp.setUp()  # what options ask for, and PETSc refuses, is found out here
        else:
            self._solve = self._solve_by_stations

    @cached_property
    def matrix(self) -> PETSc.Mat:
        """``part`` as a sequential PETSc matrix."""
        matrix = as_petsc(self._part(), PETSc.COMM_SELF)
        # PETSc cannot free a PC in Python when Python has ended, so that it is freed before,
        # whatever error kept ``destroy`` from being called. No other rank takes part.
        self._made.append(weakref.finalize(self, _destroy, matrix))
        return matrix

    @cached_property
    def _ksp(self) -> PETSc.KSP:
        ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self._made.append(weakref.finalize(self, _destroy, ksp))
        ksp.setOptionsPrefix(self._prefix)
        ksp.setOperators(self.matrix)
        _choose_direct(ksp, self._in_stations)
        if self.factors is not None:
            ksp.getPC().setType(PETSc.PC.Type.PYTHON)
            ksp.getPC().setPythonContext(self.factors)
        # Of an iteration that the options ask for; a direct solver has no tolerance.
        ksp.setTolerances(rtol=DIRECT)
        with refused_options():
            ksp.setFromOptions()
            ksp.setUp()
        return ksp

    def solve(self, right: Wrapped, solution: Wrapped) -> None:
        self._solve(right, solution)

    def _solve_by_stations(self, right: Wrapped, solution: Wrapped) -> None:
        assert self.factors is not None
        self.factors.solve(right.array, solution.array)

    @property
    def _uses_petsc(self) -> bool:
        return "_ksp" in self.__dict__

    @property
    def is_direct(self) -> bool:
        """Whether a solve cannot fail to converge: neither options nor ``iterate`` ask for more."""
        return not self._uses_petsc or super().is_direct

    @property
    def failure(self) -> int:
        return super().failure if self._uses_petsc else 0

    def bypass_ksp(self) -> None:
        """Use the bare factors from now on, if the solver is direct.

        What PETSc does around them is a tenth of a solve with a short line.
        """
        if not self.is_direct:
            return
        if self.factors is not None:
            self._solve = self._solve_by_stations
            return
        pc = self._ksp.getPC()
        if pc.getType() in (PETSc.PC.Type.CHOLESKY, PETSc.PC.Type.LU):
            factored = pc.getFactorMatrix().solve
            self._solve = lambda right, solution: factored(right.vector, solution.vector)

    def view(self) -> None:
        """Print what PETSc says of the solver."""
        self._ksp.view()

    def iterate(self) -> None:
        """Use the factors as a preconditioner of GMRES from now on."""
        super().iterate()
        self._solve = super().solve

    def destroy(self) -> None:
        """Free matrix and factors."""
        for free in reversed(self._made):
            free()


class SchwarzSolver(KspSolver):
    """PETSc's restricted additive Schwarz on all ranks. Collective to make and to use.

    Takes the place of ``PartSolver`` where that is not exact, or where options ask for another
    solver: the same overlap, two scatters more.

    Parameters
    ----------
    comm : mpi4py communicator
    part : this rank's rows of the operator A
    ownership : Ownership
    overlap : range of unknowns [low, high) that influences this rank's own, in whole blocks
    in_stations : whether the matrix has blocks of stations
    """

    def __init__(
        self,
        comm: Any,
        part: sparse.bsr_matrix,
        ownership: Ownership,
        overlap: tuple[int, int],
        in_stations: bool,
    ) -> None:
        self.matrix = as_petsc(part, comm)
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setOptionsPrefix(PREFIX)
        self._ksp.setOperators(self.matrix)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = self._ksp.getPC()
        pc.setType(PETSc.PC.Type.ASM)
        pc.setASMType(PETSc.PC.ASMType.RESTRICT)
        own = PETSc.IS().createStride(ownership.n_local, ownership.first, 1, comm=PETSc.COMM_SELF)
        low, high = overlap if ownership.n_local else (ownership.first, ownership.first)
        wide = PETSc.IS().createStride(high - low, low, 1, comm=PETSc.COMM_SELF)
        pc.setASMLocalSubdomains(1, [wide], [own])
        self._ksp.setTolerances(rtol=DIRECT)
        with refused_options():
            self._ksp.setFromOptions()
            self._ksp.setUp()
            if pc.getType() == PETSc.PC.Type.ASM:
                for solver in pc.getASMSubKSP():
                    # A rank may own nothing, of which there is no Cholesky factor.
                    has_any = solver.getOperators()[0].getSize()[0] > 0
                    _choose_direct(solver, in_stations and has_any)
                    solver.setFromOptions()
            self._ksp.setUpOnBlocks()

    def destroy(self) -> None:
        """Free matrix and factors. Collective."""
        self._ksp.destroy()
        self.matrix.destroy()


def wants_distributed_solver() -> bool:
    """Whether PETSc's options name a solver for the whole line on all ranks, not only a look."""
    return any(
        name.startswith((f"{PREFIX}ksp_", f"{PREFIX}pc_")) and not name.startswith(_LOOKS)
        for name in PETSc.Options().getAll()
    )


def allows_own_factors(is_whole: bool) -> bool:
    """Whether PETSc's options choose no factors for a part of a line, or for the whole one."""
    return not _is_given(f"{_prefix(is_whole)}pc_")


def wants_own_solver() -> bool:
    """Whether PETSc's options ask nothing of the solver of a whole line."""
    return not _is_given(*(f"{PREFIX}{kind}_" for kind in ("ksp", "pc", "mat")))


def wants_view() -> bool:
    """Whether PETSc's options ask to see the solver of the line."""
    return _is_given(f"{PREFIX}ksp_view")


def wants_solution() -> bool:
    """Whether PETSc's options ask to see the solution of the time loop, or to store it."""
    return _is_given(f"{PREFIX}ts_monitor_", f"{PREFIX}ts_save_trajectory")


def wants_single_steps() -> bool:
    """Whether PETSc's options ask to drive, see or time steps one by one."""
    return _is_given(f"{PREFIX}ts_", "log_")


def _prefix(is_whole: bool) -> str:
    return PREFIX if is_whole else PART_PREFIX


def _destroy(*objects: PETSc.Object) -> None:
    for held in objects:
        held.destroy()


def _is_given(*prefixes: str) -> bool:
    return any(name.startswith(prefixes) for name in PETSc.Options().getAll())


def _choose_direct(ksp: PETSc.KSP, in_stations: bool) -> None:
    """Make a sequential solver direct, by PETSc's factorisation that is fastest here.

    In blocks of stations a line is block tridiagonal: Cholesky's factor in the order along the
    track has no more blocks than the matrix, and fewest numbers of all. In blocks of nodes, where
    nodes do not pair, nested dissection takes two thirds of the time of that.
    """
    pc, ordering = ksp.getPC(), PETSc.Mat.OrderingType
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc.setType(PETSc.PC.Type.CHOLESKY if in_stations else PETSc.PC.Type.LU)
    pc.setFactorOrdering(str(ordering.NATURAL if in_stations else ordering.ND))
