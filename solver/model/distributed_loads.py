"""Loads per length of a wire as forces on its unknowns."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.model.elements import beam
from catenary.solver.model.model import Model, wire_elements


def along(
    model: Model, wire: str, unknowns: tuple[str, str], points: np.ndarray | None = None
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Unknowns (n,) of a wire in a plane, and forces (n, n_points) of loads per length at points.

    The load per length [N/m] is linear between ``points`` (n_points,) [m], which ascend, and
    constant beyond them; without points they are the wire's nodes. It is taken at nodes, and linear
    along each element. Forces are those that do the same work.
    """
    dofs, length = wire_elements(model, wire, unknowns)
    nodes = model.mesh.wires[wire]
    number = np.empty(model.mesh.n_nodes, dtype=np.int64)
    number[nodes] = np.arange(nodes.size)
    rows, row_of = np.unique(dofs, return_inverse=True)
    forces = beam.linear_load(length)
    at = np.broadcast_to(row_of.reshape(dofs.shape)[:, :, None], forces.shape)
    column = np.broadcast_to(number[model.mesh.elements(wire)][:, None, :], forces.shape)
    weights = sparse.coo_matrix(
        (forces.ravel(), (at.ravel(), column.ravel())), shape=(rows.size, nodes.size)
    ).tocsr()
    if points is not None:
        weights = weights @ _interpolation(model.mesh.x(nodes), points)
    return rows, weights


def _interpolation(x: np.ndarray, points: np.ndarray) -> sparse.csr_matrix:
    """Values at ``x`` (n,) of what is linear between ``points`` (m,), as a matrix (n, m)."""
    m = points.size
    if m == 1:
        return sparse.csr_matrix(np.ones((x.size, 1)))
    low = np.clip(np.searchsorted(points, x, side="right") - 1, 0, m - 2)
    share = np.clip((x - points[low]) / (points[low + 1] - points[low]), 0.0, 1.0)
    i = np.arange(x.size)
    return sparse.coo_matrix(
        (np.concatenate([1.0 - share, share]), (np.tile(i, 2), np.concatenate([low, low + 1]))),
        shape=(x.size, m),
    ).tocsr()
