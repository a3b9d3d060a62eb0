"""Least squares and null spaces of small matrices, by QR with pivoting (LAPACK's gelsy and geqp3).

SciPy's defaults find singular values by divide and conquer, which fails on a rare matrix however
well conditioned it is ("SVD did not converge"; seen with 36 equations in 34 unknowns whose singular
values are 0.02 to 3).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg


def least_squares(matrix: np.ndarray, right: np.ndarray, cond: float) -> np.ndarray:
    """The smallest x (n,) or (n, k) for which ``matrix`` (m, n) x is nearest to ``right``.

    Directions in which the matrix is smaller than ``cond`` of its size count as none. By QR with
    pivoting, which iterates nothing.
    """
    return np.asarray(
        linalg.lstsq(matrix, right, cond=cond, lapack_driver="gelsy", check_finite=False)[0]
    )


def null_space(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the null space of ``matrix`` (m, n).

    Products with it are below 1e-8 of the largest row of the matrix. By QR of the rows with
    pivoting: a third of the time of singular values.
    """
    if not matrix.size:
        return np.eye(matrix.shape[1])
    columns, triangle, _ = linalg.qr(matrix.T, pivoting=True, check_finite=False)
    sizes = np.abs(np.diagonal(triangle))
    rank = int((sizes > 1e-8 * sizes.max(initial=0.0)).sum())
    return np.asarray(columns[:, rank:])
