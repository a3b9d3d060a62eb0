"""Solves with the constant step operator: LU on one rank, one neighbour exchange on many.

On several ranks the solver is restricted additive Schwarz whose overlap is the reach of A^-1:
each rank solves its own run of the line and as much of its neighbours' as can influence it,
which makes the preconditioner a direct solver. That is verified; where it does not hold, the
same preconditioner is iterated.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from petsc4py import PETSc

from catenary.solver.distribution import Ownership
from catenary.solver.errors import InputError, RunBroken

logger = logging.getLogger(__name__)

PREFIX = "march_"
# A direct solve of a matrix as well conditioned as A (below 1e6) leaves about 1e-15.
_DIRECT = 1e-12


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


class StepSolver:
    """Factored step operator. Collective to make and to use; the maker calls ``destroy``.

    Parameters
    ----------
    comm : mpi4py communicator
    matrix : the operator A, kept by reference
    ownership : Ownership
    overlap : range of unknowns [low, high) that influences this rank's own
    model_block_size : unknowns of a node; the matrix may have blocks of stations
    """

    def __init__(
        self,
        comm: Any,
        matrix: PETSc.Mat,
        ownership: Ownership,
        overlap: tuple[int, int],
        model_block_size: int,
    ) -> None:
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setOptionsPrefix(PREFIX)
        self._ksp.setOperators(matrix)
        self._ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = self._ksp.getPC()
        # In blocks of stations a line is block tridiagonal: Cholesky's factor in the order along
        # the track has no more blocks than the matrix, and fewest numbers of all. In blocks of
        # nodes, where nodes do not pair, nested dissection takes two thirds of the time of that.
        pairs = matrix.getBlockSize() > model_block_size
        if comm.size == 1:
            pc.setType(PETSc.PC.Type.CHOLESKY if pairs else PETSc.PC.Type.LU)
            pc.setFactorOrdering(_ordering(pairs))
        else:
            self._set_up_schwarz(pc, ownership, overlap, matrix.getBlockSize())
        # Of an iteration that the options ask for; a direct solver has no tolerance.
        self._ksp.setTolerances(rtol=_DIRECT)
        with refused_options():
            self._ksp.setFromOptions()
            self._ksp.setUp()
            if pc.getType() == PETSc.PC.Type.ASM:
                self._set_up_own_solvers(pc, pairs)
            self._ksp.setUpOnBlocks()
        self._verify(matrix)
        self._direct = self.is_direct

    def solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve A ``solution`` = ``right``. Collective.

        Raises
        ------
        RunBroken
            If an iteration does not converge; a direct solver was verified when it was made.
        """
        self._ksp.solve(right, solution)
        if not self._direct:
            self.check()

    def check(self) -> None:
        """Raise RunBroken if the last solve did not converge. Collective only in its effect."""
        reason = self._ksp.getConvergedReason()
        if reason < 0:
            raise RunBroken(
                f"the linear solver did not converge (PETSc reason {reason}); drop the options "
                f"under -{PREFIX} or give the scene a smaller numerics.dt_s"
            )

    @property
    def is_direct(self) -> bool:
        """Whether one application of the preconditioner solves exactly."""
        return bool(self._ksp.getType() == PETSc.KSP.Type.PREONLY)

    def destroy(self) -> None:
        """Free the factors. Collective."""
        self._ksp.destroy()

    @staticmethod
    def _set_up_schwarz(
        pc: PETSc.PC, ownership: Ownership, overlap: tuple[int, int], block: int
    ) -> None:
        pc.setType(PETSc.PC.Type.ASM)
        pc.setASMType(PETSc.PC.ASMType.RESTRICT)
        own = PETSc.IS().createStride(ownership.n_local, ownership.first, 1, comm=PETSc.COMM_SELF)
        low, high = overlap if ownership.n_local else (ownership.first, ownership.first)
        # Whole blocks; there are no others, and ends of the line are ends of blocks.
        low, high = low - low % block, high + -high % block
        wide = PETSc.IS().createStride(high - low, low, 1, comm=PETSc.COMM_SELF)
        pc.setASMLocalSubdomains(1, [wide], [own])

    @staticmethod
    def _set_up_own_solvers(pc: PETSc.PC, pairs: bool) -> None:
        """Make this rank's own solver direct unless options say otherwise."""
        for solver in pc.getASMSubKSP():
            own = solver.getPC()
            # A rank may own nothing, of which there is no Cholesky factor.
            factors_pairs = pairs and solver.getOperators()[0].getSize()[0] > 0
            solver.setType(PETSc.KSP.Type.PREONLY)
            own.setType(PETSc.PC.Type.CHOLESKY if factors_pairs else PETSc.PC.Type.LU)
            own.setFactorOrdering(_ordering(factors_pairs))
            solver.setFromOptions()

    def _verify(self, matrix: PETSc.Mat) -> None:
        """Measure the residual for a load on every unknown; iterate if it is not round-off."""
        solution, right = matrix.createVecs()
        residual = right.duplicate()
        first, last = right.getOwnershipRange()
        right.setArray(np.cos(1.0 + 3.7 * np.arange(first, last)))
        right.assemble()
        self._ksp.solve(right, solution)
        self.check()
        matrix.mult(solution, residual)
        residual.axpy(-1.0, right)
        relative = residual.norm() / right.norm()
        if not np.isfinite(relative):
            raise RunBroken("the step operator cannot be factored: it is singular or not finite")
        if relative > _DIRECT and self.is_direct:
            logger.warning(
                "the solver leaves a residual of %.1e in one application; iterating with GMRES",
                relative,
            )
            self._ksp.setType(PETSc.KSP.Type.GMRES)
            self._ksp.setTolerances(rtol=1e-14, max_it=200)
        for vector in (solution, right, residual):
            vector.destroy()


def _ordering(pairs: bool) -> str:
    return str(PETSc.Mat.OrderingType.NATURAL if pairs else PETSc.Mat.OrderingType.ND)
