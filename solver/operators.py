"""Sums of M, K and C of a model as distributed PETSc matrices in blocks of nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy import sparse

from catenary.solver.distribution import Ownership
from catenary.solver.model import Model, iterate_entries

# Nodes closer than this along the track belong to one station [m].
_SAME_STATION = 1e-6


def assemble(
    comm: Any,
    model: Model,
    ownership: Ownership,
    *,
    mass: float = 0.0,
    stiffness: float = 0.0,
    damping: float = 0.0,
    held_diagonal: float = 0.0,
    block_size: int | None = None,
) -> PETSc.Mat:
    """``mass`` M + ``stiffness`` K + ``damping`` C in BAIJ format. Collective.

    Rows and columns of held unknowns are zero but for ``held_diagonal``. ``block_size`` is that of
    a node unless given. The caller destroys the matrix.
    """
    first, last, n = ownership.first, ownership.last, model.n_dofs
    parts = list(iterate_entries(model, first, last, mass, stiffness, damping))
    held = model.constrained[ownership.owned(model.constrained)]
    parts.append((held, held, np.full(held.size, held_diagonal)))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    size = model.block_size if block_size is None else block_size
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


def station_block(model: Model, ownership: Ownership) -> int:
    """Unknowns of a station, a node of each wire at one place, or of a node if nodes do not pair.

    Not collective; the same on all ranks.
    """
    size, x = model.block_size, np.empty(model.mesh.n_nodes)
    if x.size % 2 or (ownership.bounds % (2 * size)).any():
        return size
    x[model.row_of_node] = model.mesh.points[:, 0]
    return 2 * size if (np.abs(x[1::2] - x[::2]) < _SAME_STATION).all() else size
