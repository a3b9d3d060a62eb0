"""Hermite functions of an element as compiled loops take them: values and slopes at a place."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import compiled


@compiled
def shape_values(xi, length):  # type: ignore[no-untyped-def]
    """Hermite functions N at ``xi`` in [0, 1], shape (4,): w(x) = N @ unknowns [m]."""
    square, cube = xi * xi, xi * xi * xi
    return np.array(
        [
            1 - 3 * square + 2 * cube,
            length * (xi - 2 * square + cube),
            3 * square - 2 * cube,
            length * (cube - square),
        ]
    )


@compiled
def shape_slopes(xi, length):  # type: ignore[no-untyped-def]
    """Derivatives N' of the Hermite functions along x, shape (4,): dw/dx = N' @ unknowns [-]."""
    square = xi * xi
    return np.array(
        [
            6 * (square - xi) / length,
            1 - 4 * xi + 3 * square,
            6 * (xi - square) / length,
            3 * square - 2 * xi,
        ]
    )
