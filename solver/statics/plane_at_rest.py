"""One plane of a line at rest: stiffness summed over elements, factored in bands, and solved with.

Factors in bands are little more than the numbers of the matrix. Those of a sparse matrix of some
hundred thousand nodes take several times the memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from catenary.base.errors import InputError
from catenary.solver.model import beam
from catenary.solver.model.alike import alike
from catenary.solver.model.model import Model
from catenary.solver.statics.repeated_ends import settled

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
    return [springs_between(at[pairs], own.stiffness) for own, pairs in model.clamps_by_group()]


class Followed(NamedTuple):
    """Given unknowns, ``ends``, that move as others, ``masts``, do, and stand ``rise`` [m] higher,
    (k,) each."""

    ends: np.ndarray
    masts: np.ndarray
    rise: np.ndarray


class PlaneAtRest:
    """The wires of a line in one plane between what holds them, factored. Not collective.

    Unknowns are deflection and slope of each node. Where one is given, the force that holds the
    wire there is unknown in its place. Ends that follow masts are found by turns.

    Parameters
    ----------
    parts : summands of the stiffness (n, n)
    given, values : (m,) numbers of given unknowns, and their values
    held_at : (m,) unknowns on which the forces act that hold the given ones
    droppers : (k, 2) upper and lower ends of what holds a given lower end with its force, and is
        pulled by it at the upper one
    followed : ends among the given unknowns that follow others
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
        held_at: np.ndarray,
        droppers: np.ndarray,
        followed: Followed,
        size: int,
    ) -> None:
        self._given, self._followed, self._known = given, followed, np.zeros(size)
        self._known[given] = values
        rows = np.concatenate([held_at, droppers[:, 0]])
        columns = np.concatenate([given, droppers[:, 1]])
        sign = np.repeat([-1.0, 1.0], [given.size, len(droppers)])
        reaches = [np.abs(rows - columns), *(np.ptp(part.dofs, axis=1) for part in parts)]
        self._reach = reach = int(np.concatenate(reaches).max(initial=0))
        free = np.ones(size, dtype=bool)
        free[given] = False
        self._beside = [part.only(~free[part.dofs].all(axis=1)) for part in parts]
        bands = np.zeros((3 * reach + 1, size), order="F")
        for part in parts:
            for first in range(0, len(part.dofs), _AT_ONCE):
                some = part.only(slice(first, first + _AT_ONCE))
                _add(bands, some.dofs, some.matrices[some.kind] * free[some.dofs][:, None])
        np.add.at(bands, (2 * reach + rows - columns, columns), sign)
        self._factors, self._pivots, info = lapack.dgbtrf(bands, reach, reach, overwrite_ab=True)
        if info != 0:
            raise InputError(
                "the line has no static equilibrium: a height is wanted where nothing can give it, "
                f"or nothing holds a wire (a singular matrix, LAPACK {info}); look at supports "
                "with holds, at clamps and at ends"
            )

    def solve(self, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The unknowns (n,) under a load (n,), and the forces (m,) by which given ones are held."""
        known, reach, (ends, masts, rise) = self._known.copy(), self._reach, self._followed
        found = solution = known

        def turn(values: np.ndarray) -> np.ndarray:
            nonlocal found, solution
            known[ends] = values
            right = load - self._pull(known)
            found, _ = lapack.dgbtrs(self._factors, reach, reach, right, self._pivots)
            solution = found.copy()
            solution[self._given] = known[self._given]
            return np.asarray(solution[masts] + rise)

        settled(turn, known[ends])
        return solution, found[self._given]

    def _pull(self, known: np.ndarray) -> np.ndarray:
        """Forces (n,) by given unknowns alone, ``known`` (n,) with zeros elsewhere."""
        total = np.zeros(known.size)
        for part in self._beside:
            own = np.einsum("eij,ej->ei", part.matrices[part.kind], known[part.dofs])
            np.add.at(total, part.dofs, own)
        return total


def _add(bands: np.ndarray, dofs: np.ndarray, matrices: np.ndarray) -> None:
    """Add ``matrices`` (k, m, m) of elements with unknowns ``dofs`` (k, m) to the general ``bands``
    of LAPACK, (3 reach + 1, n) in Fortran's order."""
    depth = bands.shape[0]
    first, last = dofs.min(), dofs.max() + 1
    rows, columns = dofs[:, :, None], dofs[:, None, :]
    place = (depth - 1) // 3 * 2 + rows - columns + depth * (columns - first)
    sums = np.bincount(place.ravel(), matrices.ravel(), minlength=depth * (last - first))
    bands.T.reshape(-1)[depth * first : depth * last] += sums
