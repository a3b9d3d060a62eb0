"""Exact solves of a line's step operator by libraries, against which steps are measured."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from petsc4py import PETSc
from scipy import linalg

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.model.matrices import as_petsc, part_of
from catenary.solver.model.model import Model


def by_petsc(line: LineIntegrator, model: Model, block: int, kind: str, order: str) -> Callable:
    """A solve with PETSc's factors of the step operator."""
    whole, coefficients = (0, model.n_dofs), (1.0, line.position_factor, line.velocity_factor)
    matrix = as_petsc(part_of(model, whole, whole, coefficients, 1.0, block), PETSc.COMM_SELF)
    pc = PETSc.PC().create(PETSc.COMM_SELF)
    pc.setOperators(matrix)
    pc.setType(kind)
    pc.setFactorOrdering(order)
    pc.setUp()
    answer, right = matrix.createVecs()
    right.set(1.0)
    solve = pc.getFactorMatrix().solve
    return lambda: solve(right, answer)


def by_lapack(line: LineIntegrator, model: Model) -> Callable:
    """A solve with LAPACK's Cholesky factor of the step operator's band."""
    whole, coefficients = (0, model.n_dofs), (1.0, line.position_factor, line.velocity_factor)
    matrix = part_of(model, whole, whole, coefficients, 1.0, 1).tocoo()
    below = matrix.row - matrix.col
    band = np.zeros((below.max() + 1, model.n_dofs))
    kept = below >= 0
    band[below[kept], matrix.col[kept]] = matrix.data[kept]
    factor = linalg.cholesky_banded(band, lower=True)
    solve = linalg.get_lapack_funcs("pbtrs", (factor,))
    right = np.ones(model.n_dofs)
    return lambda: solve(factor, right, lower=1)


LIBRARIES: dict[str, Callable[[LineIntegrator, Model], Callable]] = {
    "PETSc, Cholesky in blocks of stations": partial(
        by_petsc, block=4, kind="cholesky", order="natural"
    ),
    "PETSc, LU of nodes in nested dissection": partial(by_petsc, block=2, kind="lu", order="nd"),
    "LAPACK, Cholesky of the band": by_lapack,
}
