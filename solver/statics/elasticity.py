"""The static lift of the contact wire under a unit force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.meshgen.spans import Spans
from catenary.solver.model.matrices import stiffness_matrix
from catenary.solver.model.model import Model


@dataclass(frozen=True)
class Elasticity:
    """Static lift of the contact wire under a unit force, ``lift`` [m/N] at ``x`` [m], (n,)."""

    x: np.ndarray
    lift: np.ndarray


def elasticity(model: Model, x_from: float, x_to: float) -> Elasticity:
    """Static lift under a unit force at the contact wire's nodes in [x_from, x_to] [m].

    Droppers taut, arms included. The line outside is condensed to the unknowns that it is joined
    to, exactly; then there is a small solve for each node. Not collective.
    """
    nodes = model.contact_nodes
    x = model.mesh.x(nodes)
    inside = np.flatnonzero((x >= x_from - 1e-9) & (x <= x_to + 1e-9))
    first, last = model.numbering.within(x_from, x_to)
    factor = sparse_linalg.splu(_condensed(stiffness_matrix(model), first, last))
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


def _condensed(matrix: sparse.csc_matrix, first: int, last: int) -> sparse.csc_matrix:
    """Rows and columns ``first`` to ``last`` of a symmetric matrix, the others eliminated."""
    others = np.r_[0:first, last : matrix.shape[0]]
    inner = matrix[first:last, first:last]
    between = matrix[:, first:last][others]
    joined = np.flatnonzero(np.diff(between.tocsc().indptr))
    if not joined.size:
        return inner
    right = between[:, joined].toarray()
    given_way = sparse_linalg.splu(matrix[:, others][others].tocsc()).solve(right)
    rows, columns = np.meshgrid(joined, joined, indexing="ij")
    change = sparse.csc_matrix(
        ((right.T @ given_way).ravel(), (rows.ravel(), columns.ravel())), shape=inner.shape
    )
    return (inner - change).tocsc()


def middle_span(line: Spans) -> tuple[float, float]:
    """Ends of the running span in the middle of the line [m]."""
    masts = line.support_positions
    first, last = line.n_transition[0], line.n_spans - line.n_transition[1]
    span = (first + last) // 2 if last > first else line.n_spans // 2
    return float(masts[span]), float(masts[span + 1])
