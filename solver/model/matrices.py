"""Sums of M, K and C of a model as PETSc matrices in blocks of nodes or stations."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from catenary.solver.base.petsc import PETSc
from catenary.solver.model.model import SAME_STATION, Model, iterate_entries
from catenary.solver.model.partition import Ownership


def part_of(
    model: Model,
    rows: tuple[int, int],
    columns: tuple[int, int],
    coefficients: tuple[float, float, float],
    held_diagonal: float,
    size: int,
) -> sparse.bsr_matrix:
    """Ranges of rows and columns of a sum of M, K and C in blocks of ``size``. Not collective.

    Both ranges begin and end between blocks. Entries beyond ``columns`` are left out; those of
    held unknowns are zero but for ``held_diagonal``. Indices are sorted.
    """
    parts = list(iterate_entries(model, *rows, *coefficients))
    held = model.constrained
    held = held[(held >= rows[0]) & (held < rows[1])]
    parts.append((held, held, np.full(held.size, held_diagonal)))
    row, column, value = (np.concatenate(part) for part in zip(*parts, strict=True))
    inside = (column >= columns[0]) & (column < columns[1])
    local = sparse.coo_matrix(
        (value[inside], (row[inside] - rows[0], column[inside] - columns[0])),
        shape=(rows[1] - rows[0], columns[1] - columns[0]),
    )
    blocks = local.tobsr((size, size))
    blocks.sort_indices()
    return blocks


def as_petsc(part: sparse.bsr_matrix, comm: Any) -> PETSc.Mat:
    """Rows of a matrix as PETSc's BAIJ: all of them, or this rank's. Collective on ``comm``.

    The caller destroys the matrix.
    """
    rows, columns = part.shape
    csr = (part.indptr.astype(PETSc.IntType), part.indices.astype(PETSc.IntType), part.data)
    shape = ((rows, None), (rows if comm.size > 1 else columns, None))
    matrix = PETSc.Mat().createBAIJ(shape, part.blocksize[0], csr=csr, comm=comm)
    matrix.assemble()
    if rows == columns or comm.size > 1:
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix


def columns_of(model: Model, rows: tuple[int, int]) -> tuple[int, int]:
    """Range of unknowns that M, K and C couple with those of ``rows``. Not collective."""
    low, high = rows
    for block in model.blocks:
        near = ((block.dofs >= rows[0]) & (block.dofs < rows[1])).any(axis=1)
        if near.any():
            low = min(low, int(block.dofs[near].min()))
            high = max(high, int(block.dofs[near].max()) + 1)
    return low, high


def station_block(model: Model, ownership: Ownership) -> int:
    """Unknowns of a station, a node of each wire at one place, or of a node if nodes do not pair.

    Not collective; the same on all ranks.
    """
    size, x = model.block_size, np.empty(model.mesh.n_nodes)
    if x.size % 2 or (ownership.bounds % (2 * size)).any():
        return size
    x[model.row_of_node] = model.mesh.points[:, 0]
    return 2 * size if (np.abs(x[1::2] - x[::2]) < SAME_STATION).all() else size
