"""Solvers for the constant step operator: factored once, by PETSc.

On several ranks each solves for its own part of the line and as much of its neighbours' as can
influence it: restricted additive Schwarz with an overlap as wide as the reach of A^-1, which is a
direct solver. ``LineOperators`` verifies that, and iterates where it does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from catenary.solver.distribution import Ownership
from catenary.solver.errors import InputError

PREFIX, PART_PREFIX = "march_", "march_sub_"
# A direct solve of a matrix as well conditioned as A (below 1e6) leaves about 1e-15.
DIRECT = 1e-12


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


class PartSolver:
    """Factors of this rank's part of the step operator, all of it on one rank.

    Not collective. With an overlap as wide as the reach of A^-1 the rank's own unknowns come out
    exactly, without a word to other ranks; ``residual`` of ``LineOperators`` verifies that.

    Parameters
    ----------
    matrix : sequential, in blocks of stations or of nodes; kept by reference
    in_stations : whether its blocks are stations
    is_whole : whether it is the whole line, which decides the prefix of its options
    """

    def __init__(self, matrix: PETSc.Mat, in_stations: bool, is_whole: bool) -> None:
        self._ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self._ksp.setOptionsPrefix(PREFIX if is_whole else PART_PREFIX)
        self._ksp.setOperators(matrix)
        _choose_direct(self._ksp, in_stations)
        # Of an iteration that the options ask for; a direct solver has no tolerance.
        self._ksp.setTolerances(rtol=DIRECT)
        with refused_options():
            self._ksp.setFromOptions()
            self._ksp.setUp()
        self._solve = self._ksp.solve

    def solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve A ``solution`` = ``right`` here."""
        self._solve(right, solution)

    @property
    def is_direct(self) -> bool:
        """Whether a solve cannot fail to converge: neither options nor ``iterate`` ask for more."""
        return bool(self._ksp.getType() == PETSc.KSP.Type.PREONLY)

    @property
    def failure(self) -> int:
        """PETSc's reason why the last solve did not converge; 0 if it did."""
        return min(0, self._ksp.getConvergedReason())

    def hurry(self) -> None:
        """Use the bare factors from now on, if the solver is direct.

        What PETSc does around them is a tenth of a solve with a short line.
        """
        pc = self._ksp.getPC()
        if self.is_direct and pc.getType() in (PETSc.PC.Type.CHOLESKY, PETSc.PC.Type.LU):
            self._solve = pc.getFactorMatrix().solve

    def iterate(self) -> None:
        """Use the factors as a preconditioner of GMRES from now on."""
        _use_gmres(self._ksp)

    def destroy(self) -> None:
        """Free the factors."""
        self._ksp.destroy()


class SchwarzSolver:
    """PETSc's restricted additive Schwarz on all ranks. Collective to make and to use.

    Takes the place of ``PartSolver`` where that is not exact, or where options ask for another
    solver: the same overlap, two scatters more.

    Parameters
    ----------
    comm : mpi4py communicator
    matrix : the distributed operator A, kept by reference
    ownership : Ownership
    overlap : range of unknowns [low, high) that influences this rank's own, in whole blocks
    in_stations : whether the matrix has blocks of stations
    """

    def __init__(
        self,
        comm: Any,
        matrix: PETSc.Mat,
        ownership: Ownership,
        overlap: tuple[int, int],
        in_stations: bool,
    ) -> None:
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setOptionsPrefix(PREFIX)
        self._ksp.setOperators(matrix)
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

    def solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve A ``solution`` = ``right``. Collective."""
        self._ksp.solve(right, solution)

    @property
    def is_direct(self) -> bool:
        """Whether one application of the preconditioner is all of a solve."""
        return bool(self._ksp.getType() == PETSc.KSP.Type.PREONLY)

    @property
    def failure(self) -> int:
        """PETSc's reason why the last solve did not converge, the same on all ranks; 0 if it
        did."""
        return min(0, self._ksp.getConvergedReason())

    def iterate(self) -> None:
        """Use what is set up as a preconditioner of GMRES from now on."""
        _use_gmres(self._ksp)

    def destroy(self) -> None:
        """Free the factors. Collective."""
        self._ksp.destroy()


def wants_distributed_solver() -> bool:
    """Whether PETSc's options name a solver for the whole line on all ranks."""
    given = PETSc.Options().getAll()
    return any(name.startswith((f"{PREFIX}ksp_", f"{PREFIX}pc_")) for name in given)


def _choose_direct(ksp: PETSc.KSP, in_stations: bool) -> None:
    """Make a sequential solver direct, by the factorisation that is fastest here.

    In blocks of stations a line is block tridiagonal: Cholesky's factor in the order along the
    track has no more blocks than the matrix, and fewest numbers of all. In blocks of nodes, where
    nodes do not pair, nested dissection takes two thirds of the time of that.
    """
    pc, ordering = ksp.getPC(), PETSc.Mat.OrderingType
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc.setType(PETSc.PC.Type.CHOLESKY if in_stations else PETSc.PC.Type.LU)
    pc.setFactorOrdering(str(ordering.NATURAL if in_stations else ordering.ND))


def _use_gmres(ksp: PETSc.KSP) -> None:
    ksp.setType(PETSc.KSP.Type.GMRES)
    ksp.setTolerances(rtol=1e-14, max_it=200)
