"""Least squares and null spaces of small matrices, by QR with pivoting (LAPACK's gelsy and geqp3).

SciPy's defaults find singular values by divide and conquer, which fails on a rare matrix however
well conditioned it is ("SVD did not converge"; seen with 36 equations in 34 unknowns whose singular
values are 0.02 to 3).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import linalg
from scipy.linalg import lapack


def least_squares(matrix: np.ndarray, right: np.ndarray, cond: float) -> np.ndarray:
    """The smallest x (n,) or (n, k) for which ``matrix`` (m, n) x is nearest to ``right``.

    Directions in which the matrix is smaller than ``cond`` of its size count as none. By QR with
    pivoting, which iterates nothing.
    """
    matrix, right = np.asarray_chkfinite(matrix), np.asarray_chkfinite(right)
    m, n = matrix.shape
    if 0 in (m, n, right.size):
        return np.zeros((n, *right.shape[1:]))
    columns = right.reshape(m, -1)
    room = np.zeros((max(m, n), columns.shape[1]), order="F")
    room[:m] = columns
    # As `scipy.linalg.lstsq` calls it, which asks for the work space each time.
    _, found, _, _, info = lapack.dgelsy(
        matrix, room, np.zeros(n, dtype=np.int32), cond, _work(m, n, columns.shape[1], cond),
        overwrite_b=True,
    )  # fmt: skip
    assert info == 0
    return np.asarray(found[:n]).reshape(n, *right.shape[1:])


@lru_cache(maxsize=256)
def _work(m: int, n: int, n_right: int, cond: float) -> int:
    """Numbers of work space for equations (m, n) with so many right-hand sides."""
    work, _ = lapack.dgelsy_lwork(m, n, n_right, cond)
    return int(work)


def null_space(matrix: np.ndarray, cond: float = 1e-8) -> np.ndarray:
    """Orthonormal columns (n, k) that ``matrix`` (m, n) turns into nothing.

    That is, into less than ``cond`` of its largest row, by QR of its rows with pivoting: a third of
    the time of singular values.
    """
    if not matrix.size:
        return np.eye(matrix.shape[1])
    columns, triangle, _ = linalg.qr(matrix.T, pivoting=True, check_finite=False)
    sizes = np.abs(np.diagonal(triangle))
    rank = int((sizes > cond * sizes.max(initial=0.0)).sum())
    return np.asarray(columns[:, rank:])
