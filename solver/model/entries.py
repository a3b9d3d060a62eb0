"""Entries of M, K and C of a model, without PETSc."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from catenary.solver.model.model import Model


def iterate_entries(
    model: Model,
    first: int,
    last: int,
    mass: float,
    stiffness: float,
    damping: float,
    wanted: np.ndarray | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Entries (rows, columns, values) of ``mass`` M + ``stiffness`` K + ``damping`` C.

    Only rows in [first, last), of these ``wanted`` (last - first,) ones if that is given; rows and
    columns of constrained unknowns are left out.
    """
    sums = [(mass, stiffness, damping)]
    for rows, columns, values in iterate_sums(model, first, last, sums, wanted):
        yield rows, columns, values[0]


def iterate_sums(
    model: Model,
    first: int,
    last: int,
    sums: Sequence[tuple[float, float, float]],
    wanted: np.ndarray | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """``iterate_entries`` for k sums of M, K and C at once, with values (k, n).

    ``sums`` are their coefficients of M, K and C; ``first``, ``last`` and ``wanted`` select rows as
    in ``iterate_entries``.
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
        moves = _free(model, dofs)
        shape = *dofs.shape, dofs.shape[1]
        rows = np.broadcast_to(dofs[:, :, None], shape)
        columns = np.broadcast_to(dofs[:, None, :], shape)
        keep = (rows >= first) & (rows < last) & moves[:, :, None] & moves[:, None, :]
        if wanted is not None:
            keep[keep] = wanted[rows[keep] - first]
        values = []
        for mass, stiffness, damping in sums:
            matrix = np.zeros(shape)
            if block.mass is not None:
                matrix += (mass + damping * beta) * block.mass[kind]
            if block.stiffness is not None:
                matrix += (stiffness + damping * alpha) * block.stiffness[kind]
            if block.damping is not None:
                matrix += damping * block.damping[kind]
            values.append(matrix[keep])
        yield rows[keep], columns[keep], np.stack(values)


def _free(model: Model, dofs: np.ndarray) -> np.ndarray:
    """Mask of unknowns that are not held, shape as ``dofs``; they stand close to each other."""
    low, high = int(dofs.min()), int(dofs.max()) + 1
    free = np.ones(high - low, dtype=bool)
    free[model.constrained_between(low, high) - low] = False
    return np.asarray(free[dofs - low])
