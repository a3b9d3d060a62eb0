"""Entries of M, K and C of a model, without PETSc."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from catenary.solver.model.model import Block, Model


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
