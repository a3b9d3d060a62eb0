"""The inverse of a small matrix, compiled, for loops that make one in each step or station."""

from __future__ import annotations

from catenary.solver.base.kernels.compiled import called


@called
def invert(matrix):
    """Invert in place a matrix (n, n) that needs no exchange of rows.

    Such is a positive definite one, or one whose masses outweigh all else.
    """
    n = matrix.shape[0]
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        matrix[k, k] = 1.0
        for j in range(n):
            matrix[k, j] *= pivot
        for i in range(n):
            if i != k:
                share = matrix[i, k]
                matrix[i, k] = 0.0
                for j in range(n):
                    matrix[i, j] -= share * matrix[k, j]
