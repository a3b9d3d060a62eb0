"""Sums of M, K and C of a model as PETSc matrices in blocks of nodes or stations."""

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
    coefficients: tuple[float, float, float],
    block_size: int,
) -> PETSc.Mat:
    """Sum of M, K and C with ``coefficients``, distributed, in BAIJ format. Collective.

    Rows and columns of held unknowns are zero but for ones on the diagonal. The caller destroys
    the matrix.
    """
    first, last, n = ownership.first, ownership.last, model.n_dofs
    blocks = _blocks(model, (first, last), (0, n), coefficients, 1.0, block_size)
    return _finished(
        PETSc.Mat().createBAIJ(
            ((last - first, n), (last - first, n)), block_size, csr=_csr(blocks), comm=comm
        )
    )


def assemble_part(
    model: Model,
    rows: tuple[int, int],
    columns: tuple[int, int],
    coefficients: tuple[float, float, float],
    held_diagonal: float,
    block_size: int,
) -> PETSc.Mat:
    """The same for a range of rows and of columns, on this rank alone. Not collective.

    Both ranges begin and end between blocks. Entries beyond ``columns`` are left out; those of
    held unknowns are zero but for ``held_diagonal``.
    """
    blocks = _blocks(model, rows, columns, coefficients, held_diagonal, block_size)
    shape = (rows[1] - rows[0], columns[1] - columns[0])
    return _finished(
        PETSc.Mat().createBAIJ(shape, block_size, csr=_csr(blocks), comm=PETSc.COMM_SELF)
    )


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
    return 2 * size if (np.abs(x[1::2] - x[::2]) < _SAME_STATION).all() else size


def _blocks(
    model: Model,
    rows: tuple[int, int],
    columns: tuple[int, int],
    coefficients: tuple[float, float, float],
    held_diagonal: float,
    size: int,
) -> sparse.bsr_matrix:
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


def _csr(blocks: sparse.bsr_matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return (
        blocks.indptr.astype(PETSc.IntType),
        blocks.indices.astype(PETSc.IntType),
        blocks.data,
    )


def _finished(matrix: PETSc.Mat) -> PETSc.Mat:
    matrix.assemble()
    if matrix.getSize()[0] == matrix.getSize()[1]:
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix
