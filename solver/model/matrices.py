"""M, K and C of a model and their sums: whole matrices, parts of rows, PETSc matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from catenary.solver.model.entries import iterate_entries
from catenary.solver.model.model import Model

if TYPE_CHECKING:
    from catenary.base.petsc import PETSc

# Rows whose entries are put together at once, some 50 MB of them.
_STRETCH = 2**16


def whole_matrix(
    model: Model,
    mass: float = 0.0,
    stiffness: float = 0.0,
    damping: float = 0.0,
    held_diagonal: float = 0.0,
) -> sparse.csc_matrix:
    """``mass`` M + ``stiffness`` K + ``damping`` C on all unknowns. Not collective.

    Rows and columns of held unknowns are empty but for ``held_diagonal``.
    """
    n = model.n_dofs
    parts = list(iterate_entries(model, 0, n, mass, stiffness, damping))
    if held_diagonal:
        held = model.constrained
        parts.append((held, held, np.full(held.size, held_diagonal)))
    if not parts:
        return sparse.csc_matrix((n, n))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return sparse.csc_matrix((values, (rows, columns)), shape=(n, n))


def stiffness_matrix(model: Model) -> sparse.csc_matrix:
    """K of the whole line, held unknowns with a unit diagonal. Not collective."""
    return whole_matrix(model, stiffness=1.0, held_diagonal=1.0)


def part_of(
    model: Model,
    rows: tuple[int, int],
    columns: tuple[int, int],
    coefficients: tuple[float, float, float],
    held_diagonal: float,
    size: int,
) -> sparse.bsr_matrix:
    """Ranges of rows and columns of a sum of M, K and C, with ``coefficients`` in this order.

    The result has sorted blocks of ``size``; ``rows`` and ``columns`` are (first, last) unknowns
    between blocks. Entries beyond ``columns`` are left out; those of held unknowns are zero but for
    ``held_diagonal``. Not collective.
    """
    # By stretches, as entries take several times the memory of blocks.
    step = _STRETCH - _STRETCH % size
    ends = [rows[0], *range(rows[0] + step, rows[1], step), rows[1]]
    parts = [
        _stretch_of(model, stretch, columns, coefficients, held_diagonal, size)
        for stretch in zip(ends[:-1], ends[1:], strict=True)
    ]
    if len(parts) == 1:
        return parts[0]
    counts = np.concatenate([np.diff(part.indptr) for part in parts])
    indptr = np.concatenate([np.zeros(1, parts[0].indptr.dtype), np.cumsum(counts)])
    indices = np.concatenate([part.indices for part in parts])
    shape = rows[1] - rows[0], columns[1] - columns[0]
    data = np.concatenate([part.data for part in parts])
    return sparse.bsr_matrix((data, indices, indptr), shape=shape)


def _stretch_of(
    model: Model,
    rows: tuple[int, int],
    columns: tuple[int, int],
    coefficients: tuple[float, float, float],
    held_diagonal: float,
    size: int,
) -> sparse.bsr_matrix:
    """``part_of`` for so few rows that their entries take little memory."""
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
    # Form finding needs matrices, but no PETSc: commands that load no more start sooner.
    from catenary.base.petsc import PETSc

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
