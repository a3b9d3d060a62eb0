"""Sparse matrices in one plane of a line at rest, summed over element matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from catenary.solver.model.alike import alike
from catenary.solver.model.elements import beam, exact_beam
from catenary.solver.model.model import Model


class Part(NamedTuple):
    """Elements; like elements share a matrix.

    Attributes
    ----------
    dofs : (n, m) unknowns of each
    matrices : (k, m, m)
    kind : (n,) which of them each has
    """

    dofs: np.ndarray
    matrices: np.ndarray
    kind: np.ndarray

    def only(self, which: slice | np.ndarray) -> Part:
        """Some of the elements."""
        return Part(self.dofs[which], self.matrices, self.kind[which])


def wire_parts(model: Model, at: np.ndarray, exact: bool = False) -> list[Part]:
    """Bending and tension of all wires.

    Parameters
    ----------
    model : Model
        Discrete line.
    at : ndarray, shape (n_nodes,)
        Number of each node's deflection; that of its slope follows.
    exact : bool, optional
        Whether elements bend as tensioned beams do, or by Hermite's functions as in motion.
    """
    mesh, parts = model.mesh, []
    for wire in model.problem.line.wires:
        first, second = mesh.elements(wire.name).T
        length = mesh.x(second) - mesh.x(first)
        dofs = np.stack([at[first], at[first] + 1, at[second], at[second] + 1], axis=1)
        tension = wire.tension_at(0.5 * (mesh.x(first) + mesh.x(second)))
        chosen, kind = alike(np.column_stack([length, tension]))
        elements = exact_beam if exact else beam
        stiffness = elements.stiffness(length[chosen], wire.bending_stiffness, tension[chosen])
        parts.append(Part(dofs, stiffness, kind))
    return parts


def springs_between(dofs: np.ndarray, stiffness: np.ndarray | float) -> Part:
    """Springs between pairs of unknowns (n, 2), of stiffness (n,) or all of one [N/m]."""
    unit = np.array([[1.0, -1.0], [-1.0, 1.0]])
    values = np.broadcast_to(np.asarray(stiffness, dtype=float), (len(dofs),))
    return Part(dofs, values[:, None, None] * unit, np.arange(len(dofs)))


def clamp_parts(model: Model, at: np.ndarray) -> list[Part]:
    """Clamps of one wire on another, which hold both ways; ``at`` as in ``wire_parts``."""
    line, parts = model.problem.line, []
    for number, clamps in enumerate(line.clamps):
        pairs = at[model.mesh.clamps[line.clamp_group == number]]
        parts.append(springs_between(pairs, clamps.stiffness))
    return parts


def summed(parts: list[Part], size: int) -> sparse.csc_matrix:
    """The matrix (size, size) of all parts."""
    matrices = [part.matrices[part.kind] for part in parts]
    at = [
        np.concatenate(
            [
                np.broadcast_to(part.dofs[axes], own.shape).ravel()
                for part, own in zip(parts, matrices, strict=True)
            ]
        )
        for axes in (np.s_[:, :, None], np.s_[:, None, :])
    ]
    values = np.concatenate([own.ravel() for own in matrices])
    return sparse.csc_matrix((values, (at[0], at[1])), shape=(size, size))


def columns_of(parts: list[Part], columns: np.ndarray, size: int) -> sparse.csc_matrix:
    """Some columns (size, k) of the matrix of all parts."""
    near = []
    for part in parts if columns.size else ():
        near.append(part.only(np.isin(part.dofs, columns).any(axis=1)))
    return summed(near, size)[:, columns] if near else sparse.csc_matrix((size, columns.size))
