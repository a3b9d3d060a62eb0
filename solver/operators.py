"""Sums of M, K and C of a model as distributed PETSc matrices in blocks of one node."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from catenary.solver.distribution import Ownership
from catenary.solver.model import Model, iterate_entries


def assemble(
    comm: Any,
    model: Model,
    ownership: Ownership,
    *,
    mass: float = 0.0,
    stiffness: float = 0.0,
    damping: float = 0.0,
    held_diagonal: float = 0.0,
) -> PETSc.Mat:
    """``mass`` M + ``stiffness`` K + ``damping`` C in BAIJ format. Collective.

    Rows and columns of held unknowns are zero but for ``held_diagonal``. The caller destroys it.
    """
    first, last, n = ownership.first, ownership.last, model.n_dofs
    parts = list(iterate_entries(model, first, last, mass, stiffness, damping))
    held = model.constrained[ownership.owned(model.constrained)]
    parts.append((held, held, np.full(held.size, held_diagonal)))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    size = model.block_size
    local = sparse.coo_matrix((values, (rows - first, columns)), shape=(last - first, n))
    blocks = local.tobsr((size, size))
    blocks.sort_indices()
    matrix = PETSc.Mat().createBAIJ(
        ((last - first, n), (last - first, n)),
        size,
        csr=(
            blocks.indptr.astype(PETSc.IntType),
            blocks.indices.astype(PETSc.IntType),
            blocks.data,
        ),
        comm=comm,
    )
    matrix.assemble()
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix
