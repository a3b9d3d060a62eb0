"""LU factors of a line at rest in its order along the track, in bands.

These are little more than the numbers of the matrix. A sparse matrix of some hundred thousand nodes
takes several times the memory.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import lapack

from catenary.base.errors import InputError
from catenary.solver.statics.form_finding.sparse_sum import Part

# Elements whose matrices are summed at once.
_AT_ONCE = 1 << 10


class BandedFactors:
    """Factors of a matrix (n, n) that joins what is close to each other. Not collective.

    The columns of ``given`` unknowns, of which the force is looked for in place of the value, hold
    the numbers of ``forces`` alone.

    Attributes
    ----------
    from_given : (n,) the sum of all parts times the values of the given unknowns

    Parameters
    ----------
    parts : summands of the matrix
    given, values : unknowns (m,) that are given, and their values (m,)
    forces : rows, columns and numbers (k,) of the columns of given unknowns
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
                "the line finds no rest: a height is wanted where nothing can give it, or nothing "
                f"holds a wire (a singular matrix, LAPACK {info}); look at supports with holds, at "
                "clamps and at ends"
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
