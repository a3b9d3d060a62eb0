"""M, K and C of a model and their sums: entries, whole matrices, parts of rows, bands, PETSc's.

Unknowns stand in the order along the track, so that a sum has few bands.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import linalg, sparse

from catenary.base.errors import RunBroken
from catenary.solver.model.model import Block, Model

if TYPE_CHECKING:
    from catenary.base.petsc import PETSc

# Rows whose entries are put together at once, some 50 MB of them.
_STRETCH = 2**16
# Unknowns whose bands are put together at once, some ninety spans of two wires: entries of a
# hundred elements take nearly as long as those of a thousand.
_AT_ONCE = 2**14


def iterate_sums(
    model: Model,
    first: int,
    last: int,
    sums: Sequence[tuple[float, float, float]],
    wanted: np.ndarray | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Entries (rows, columns, values) of k sums of M, K and C at once, values (k, n), by blocks.

    ``sums`` are their coefficients of M, K and C. Only rows in [first, last), of these ``wanted``
    (last - first,) ones if that is given; rows and columns of constrained unknowns are left out.
    """
    for block in model.blocks:
        alpha, beta = model.damping_of_block(block)
        near = block.near(first, last)
        dofs, kind = block.dofs[near].astype(np.int64), block.kind[near]
        if wanted is not None:
            inside = (dofs >= first) & (dofs < last)
            chosen = (inside & wanted[np.where(inside, dofs - first, 0)]).any(axis=1)
            dofs, kind = dofs[chosen], kind[chosen]
        if not kind.size:
            continue
        shape = *dofs.shape, dofs.shape[1]
        rows = np.broadcast_to(dofs[:, :, None], shape)
        columns = np.broadcast_to(dofs[:, None, :], shape)
        keep = _kept(model, dofs, first, last)
        if wanted is not None:
            keep = np.ones(shape, dtype=bool) if keep is None else keep
            keep[keep] = wanted[rows[keep] - first]
        values = [_sum_of(block, alpha, beta, *of)[kind] for of in sums]
        if keep is None:
            yield rows.ravel(), columns.ravel(), np.stack([own.ravel() for own in values])
        else:
            yield rows[keep], columns[keep], np.stack([own[keep] for own in values])


def _sum_of(
    block: Block, alpha: float, beta: float, mass: float, stiffness: float, damping: float
) -> np.ndarray:
    """``mass`` M + ``stiffness`` K + ``damping`` C of the kinds of a block, (k, m, m)."""
    terms = (
        (mass + damping * beta, block.mass),
        (stiffness + damping * alpha, block.stiffness),
        (damping, block.damping),
    )
    there = [(share, own) for share, own in terms if own is not None]
    total = np.zeros(there[0][1].shape)
    for share, own in there:
        if share != 0.0:
            total += share * own
    return total


def _kept(model: Model, dofs: np.ndarray, first: int, last: int) -> np.ndarray | None:
    """Mask (n, m, m) of the entries of elements that are in rows from ``first`` to before ``last``
    and of free unknowns; None if all are."""
    low, high = int(dofs.min()), int(dofs.max()) + 1  # an element's unknowns are near each other
    held = model.constrained_between(low, high)
    inside = first <= low and high <= last
    if inside and not held.size:
        return None
    free = np.ones(high - low, dtype=bool)
    free[held - low] = False
    moves = free[dofs - low]
    mine = moves if inside else moves & (dofs >= first) & (dofs < last)
    return np.asarray(mine[:, :, None] & moves[:, None, :])


def entries_of(
    model: Model,
    first: int,
    last: int,
    coefficients: tuple[float, float, float],
    held_diagonal: float | None = None,
) -> tuple[np.ndarray, ...]:
    """All entries (rows, columns, values) of a sum of M, K and C, as ``iterate_sums`` has them, and
    those of held unknowns on the diagonal if ``held_diagonal`` is given."""
    none = np.zeros(0, dtype=np.int64)
    parts = [(none, none, np.zeros(0))]
    for rows, columns, values in iterate_sums(model, first, last, [coefficients]):
        parts.append((rows, columns, values[0]))
    if held_diagonal is not None:
        held = model.constrained_between(first, last)
        parts.append((held, held, np.full(held.size, held_diagonal)))
    return tuple(np.concatenate(part) for part in zip(*parts, strict=True))


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
    coefficients = mass, stiffness, damping
    rows, columns, values = entries_of(model, 0, n, coefficients, held_diagonal or None)
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
    row, column, value = entries_of(model, *rows, coefficients, held_diagonal)
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


def coupled_with(model: Model, rows: tuple[int, int]) -> tuple[int, int]:
    """Range of unknowns that M, K and C couple with those of ``rows``. Not collective."""
    low, high = rows
    for block in model.blocks:
        near = ((block.dofs >= rows[0]) & (block.dofs < rows[1])).any(axis=1)
        if near.any():
            low = min(low, int(block.dofs[near].min()))
            high = max(high, int(block.dofs[near].max()) + 1)
    return low, high


class OperatorBands:
    """Lower bands of A, as LAPACK takes them. Not collective.

    Those of a short line are put together once, for whoever reads them.

    Parameters
    ----------
    model : Model
    coefficients : of M, K and C in A
    """

    def __init__(self, model: Model, coefficients: tuple[float, float, float]) -> None:
        self._model, self._coefficients = model, coefficients
        self._first = self._last = 0
        self._numbers = np.zeros((1, 0))

    def between(self, first: int, last: int, further: int = 0) -> np.ndarray:
        """Bands (k, last - first) of A for the columns from ``first`` to before ``last``.

        Entry [i, j] is that of A in row ``first`` + j + i and column ``first`` + j. Entries of rows
        from ``last`` on are undefined. Columns to before ``further`` are read next.
        """
        if first < self._first or last > self._last:
            if self._model.n_dofs <= _AT_ONCE:
                self._put_together(0, self._model.n_dofs)
            else:
                self._put_together(first, max(last, min(first + _AT_ONCE, further)))
        numbers = self._numbers[:, first - self._first : last - self._first]
        bands = max(1, min(len(numbers), last - first))
        while bands > 1 and not numbers[bands - 1, : last - first + 1 - bands].any():
            bands -= 1
        return numbers[:bands]

    def solve(self, first: int, last: int, right: np.ndarray, further: int = 0) -> np.ndarray:
        """Answers (n, last - first) of the unknowns from ``first`` to before ``last``, alone, to
        forces ``right`` of the same shape, which are overwritten; ``further`` as in ``between``.

        Raises
        ------
        RunBroken
            If A is not positive definite there.
        """
        bands = self.between(first, last, further)
        try:
            answers = linalg.solveh_banded(
                bands, right.T, overwrite_b=True, lower=True, check_finite=False
            )
        except linalg.LinAlgError as error:
            raise RunBroken("the step operator cannot be factored: it is not positive") from error
        return np.asarray(answers.T)

    def _put_together(self, first: int, last: int) -> None:
        rows, columns, values = entries_of(self._model, first, last, self._coefficients, 1.0)
        lower = (columns <= rows) & (columns >= first)
        rows, columns, values = rows[lower], columns[lower], values[lower]
        apart, n = rows - columns, last - first
        bands = int(apart.max(initial=0)) + 1
        flat = np.bincount(n * apart + columns - first, weights=values, minlength=n * bands)
        self._first, self._last = first, last
        self._numbers = np.asarray(flat, dtype=float).reshape(bands, n)
