"""Sparse matrices in one plane of a line at rest: summed over elements, factored in bands.

Factors in bands are little more than the numbers of the matrix. Those of a sparse matrix of some
hundred thousand nodes take several times the memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import lapack

from catenary.base.errors import InputError
from catenary.solver.model import beam
from catenary.solver.model.alike import alike
from catenary.solver.model.model import Model

# Elements whose matrices are summed at once.
_AT_ONCE = 1 << 10


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


def wire_parts(model: Model, at: np.ndarray, exact: bool) -> list[Part]:
    """Bending and tension of all wires.

    Parameters
    ----------
    model : Model
        Discrete line.
    at : ndarray, shape (n_nodes,)
        Number of each node's deflection; that of its slope follows.
    exact : bool
        Whether elements bend as tensioned beams do, or by Hermite's functions as in motion.
    """
    mesh, parts = model.mesh, []
    for wire in model.problem.line.wires:
        first, second = mesh.elements(wire.name).T
        length = mesh.x(second) - mesh.x(first)
        dofs = np.stack([at[first], at[first] + 1, at[second], at[second] + 1], axis=1)
        tension = wire.tension_at(0.5 * (mesh.x(first) + mesh.x(second)))
        chosen, kind = alike(np.column_stack([length, tension]))
        matrices = beam.exact_stiffness if exact else beam.stiffness
        stiffness = matrices(length[chosen], wire.bending_stiffness, tension[chosen])
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


class BandedFactors:
    """Factors of a banded matrix (n, n). Not collective.

    The value of a ``given`` unknown is known and its force is not: the column of the unknown holds
    the entries ``forces`` in place of those of the parts.

    Attributes
    ----------
    from_given : (n,) sum of all parts times the values of the given unknowns

    Parameters
    ----------
    parts : summands of the matrix
    given, values : (m,) numbers of the given unknowns, and their values
    forces : rows, columns and entries (k,) of the columns of given unknowns
    size : n

    Raises
    ------
    InputError
        If the matrix is singular: a line of free tables whose heights nothing can give.
    """

    def __init__(
        self,
        parts: Sequence[Part],
        given: np.ndarray,
        values: np.ndarray,
        forces: tuple[np.ndarray, np.ndarray, np.ndarray],
        size: int,
    ) -> None:
        rows, columns, numbers = forces
        reach = int(np.abs(rows - columns).max(initial=0))
        for part in parts:
            reach = max(reach, int(np.ptp(part.dofs, axis=1).max(initial=0)))
        self._reach = reach
        free, known = np.ones(size, dtype=bool), np.zeros(size)
        free[given], known[given] = False, values
        self.from_given = np.zeros(size)
        bands = np.zeros((3 * reach + 1, size), order="F")
        for part in parts:
            for first in range(0, len(part.dofs), _AT_ONCE):
                dofs = part.dofs[first : first + _AT_ONCE]
                matrices = part.matrices[part.kind[first : first + _AT_ONCE]]
                at = np.flatnonzero(~free[dofs].all(axis=1))
                if at.size:
                    forces_there = np.einsum("eij,ej->ei", matrices[at], known[dofs[at]])
                    np.add.at(self.from_given, dofs[at], forces_there)
                    matrices[at] *= free[dofs[at]][:, None]
                _add(bands, dofs, matrices)
        np.add.at(bands, (2 * reach + rows - columns, columns), numbers)
        self._factors, self._pivots, info = lapack.dgbtrf(bands, reach, reach, overwrite_ab=True)
        if info != 0:
            raise InputError(
                "the line has no static equilibrium: a height is wanted where nothing can give it, "
                f"or nothing holds a wire (a singular matrix, LAPACK {info}); look at supports "
                "with holds, at clamps and at ends"
            )

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The solution (n,) for a right-hand side (n,)."""
        reach = self._reach
        solution, _ = lapack.dgbtrs(self._factors, reach, reach, right, self._pivots)
        return np.asarray(solution)


def _add(bands: np.ndarray, dofs: np.ndarray, matrices: np.ndarray) -> None:
    """Add ``matrices`` (k, m, m) of elements with unknowns ``dofs`` (k, m) to the general ``bands``
    of LAPACK, (3 reach + 1, n) in Fortran's order."""
    depth = bands.shape[0]
    first, last = dofs.min(), dofs.max() + 1
    rows, columns = dofs[:, :, None], dofs[:, None, :]
    place = (depth - 1) // 3 * 2 + rows - columns + depth * (columns - first)
    sums = np.bincount(place.ravel(), matrices.ravel(), minlength=depth * (last - first))
    bands.T.reshape(-1)[depth * first : depth * last] += sums
