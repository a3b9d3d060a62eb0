"""The static lift of the contact wire under a unit force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.meshgen.spans import Spans
from catenary.solver.model.matrices import part_of
from catenary.solver.model.model import Model

# How far to both sides of a stretch a line is looked at first [m], and what stands still.
_FIRST_REACH, _STILL = 1500.0, 1e-13


@dataclass(frozen=True)
class Elasticity:
    """Static lift of the contact wire under a unit force, ``lift`` [m/N] at ``x`` [m], (n,)."""

    x: np.ndarray
    lift: np.ndarray


def elasticity(model: Model, x_from: float, x_to: float) -> Elasticity:
    """Static lift under a unit force at the contact wire's nodes in [x_from, x_to] [m].

    Droppers taut, arms included. The line outside is condensed to the unknowns that it is joined
    to; then there is a small solve for each node. Of a long line that is as much of it as moves by
    more than round-off. Not collective.
    """
    nodes = model.contact_nodes
    x = model.mesh.x(nodes)
    inside = np.flatnonzero((x >= x_from - 1e-9) & (x <= x_to + 1e-9))
    first, last = model.numbering.within(x_from, x_to)
    factor = sparse_linalg.splu(_seen_from(model, x_from, x_to))
    dofs = model.dofs(nodes[inside])
    # Where the wire is held it does not give way; the matrix has a one there, which is no spring.
    gives_way = ~np.isin(dofs, model.constrained)
    lift = np.zeros(inside.size)
    unit = np.zeros(last - first)
    for i, dof in zip(np.flatnonzero(gives_way), dofs[gives_way] - first, strict=True):
        unit[dof] = 1.0
        lift[i] = factor.solve(unit)[dof]
        unit[dof] = 0.0
    return Elasticity(x[inside], lift)


def _seen_from(model: Model, x_from: float, x_to: float) -> sparse.csc_matrix:
    """Stiffness of what stands in a stretch, all else eliminated."""
    numbering, width, reach = model.numbering, model.numbering.width, _FIRST_REACH
    first, last = numbering.within(x_from, x_to)
    while True:
        low, high = numbering.within(x_from - reach, x_to + reach)
        near, stiffness = (low, high), (0.0, 1.0, 0.0)
        matrix = part_of(model, near, near, stiffness, 1.0, numbering.block).tocsc()
        matrix.eliminate_zeros()
        condensed, motion = _condensed(matrix, first - low, last - low)
        # What moves at the ends of what was looked at, wherever the line goes on there.
        ends = [motion[:width]] if low > 0 else []
        ends += [motion[-width:]] if high < numbering.size else []
        most = _STILL * np.abs(motion).max(initial=0.0)
        if all(np.abs(end).max(initial=0.0) <= most for end in ends):
            return condensed
        reach *= 4.0


def _condensed(
    matrix: sparse.csc_matrix, first: int, last: int
) -> tuple[sparse.csc_matrix, np.ndarray]:
    """Rows and columns ``first`` to ``last`` of a symmetric matrix, the others eliminated.

    Also how these, (n, m), move with the unknowns that they are joined to.
    """
    others = np.r_[0:first, last : matrix.shape[0]]
    inner = matrix[first:last, first:last]
    between = matrix[:, first:last][others]
    joined = np.flatnonzero(np.diff(between.tocsc().indptr))
    if not joined.size:
        return inner, np.zeros((others.size, 0))
    right = between[:, joined].toarray()
    given_way = sparse_linalg.splu(matrix[:, others][others].tocsc()).solve(right)
    rows, columns = np.meshgrid(joined, joined, indexing="ij")
    change = sparse.csc_matrix(
        ((right.T @ given_way).ravel(), (rows.ravel(), columns.ravel())), shape=inner.shape
    )
    return (inner - change).tocsc(), given_way


def middle_span(line: Spans) -> tuple[float, float]:
    """Ends of the running span in the middle of the line [m]."""
    masts = line.support_positions
    first, last = line.n_transition[0], line.n_spans - line.n_transition[1]
    span = (first + last) // 2 if last > first else line.n_spans // 2
    return float(masts[span]), float(masts[span + 1])
