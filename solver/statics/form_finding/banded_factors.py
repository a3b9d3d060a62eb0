"""LU factors of a line at rest in its order along the track, in bands.

These are little more than the numbers of the matrix. A sparse matrix of some hundred thousand nodes
takes several times the memory.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import lapack

from catenary.solver.statics.form_finding.sparse_sum import Part


class BandedFactors:
    """Factors of a matrix (n, n) that joins what is close to each other. Not collective.

    The columns of ``given`` unknowns, of which the force is looked for in place of the value, hold
    the numbers of ``forces`` alone.

    Attributes
    ----------
    from_given : (n,) the sum of all parts times the values of the given unknowns

    Parameters
    ----------
    parts : what is summed
    given, values : unknowns (m,) that are given, and their values (m,)
    forces : rows, columns and numbers (k,) of the columns of given unknowns
    size : n

    Raises
    ------
    RuntimeError
        If the matrix is singular.
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
        for dofs, _ in parts:
            reach = max(reach, int(np.ptp(dofs, axis=1).max(initial=0)))
        # Compiled loops are not for a scene that is checked and nothing more.
        from catenary.solver.statics.form_finding.band_kernels import add_elements

        self._reach = reach
        free, known = np.ones(size, dtype=bool), np.zeros(size)
        free[given], known[given] = False, values
        self.from_given = np.zeros(size)
        bands = np.zeros((3 * reach + 1, size), order="F")
        for dofs, matrices in parts:
            add_elements(bands, reach, dofs, matrices, free, known, self.from_given)
        np.add.at(bands, (2 * reach + rows - columns, columns), numbers)
        self._factors, self._pivots, info = lapack.dgbtrf(bands, reach, reach, overwrite_ab=True)
        if info != 0:
            raise RuntimeError(f"the line at rest has a singular matrix (LAPACK {info})")

    def solve(self, right: np.ndarray) -> np.ndarray:
        """The solution (n,) for a right-hand side (n,)."""
        reach = self._reach
        solution, _ = lapack.dgbtrs(self._factors, reach, reach, right, self._pivots)
        return np.asarray(solution)
