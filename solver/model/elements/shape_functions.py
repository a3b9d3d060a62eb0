"""Hermite functions of elements: values and slopes at places."""

from __future__ import annotations

import numpy as np

_Place = float | np.ndarray


def shape_values(xi: _Place, length: _Place) -> np.ndarray:
    """Hermite functions N at ``xi`` in [0, 1], shape (4,) or (4, n): w(x) = N @ unknowns [m]."""
    square, cube = xi * xi, xi * xi * xi
    return np.array(
        [
            1 - 3 * square + 2 * cube,
            length * (xi - 2 * square + cube),
            3 * square - 2 * cube,
            length * (cube - square),
        ]
    )


def shape_slopes(xi: _Place, length: _Place) -> np.ndarray:
    """Derivatives N' of the Hermite functions along x, shape (4,) or (4, n): dw/dx = N' @ unknowns
    [-]."""
    square = xi * xi
    return np.array(
        [
            6 * (square - xi) / length,
            1 - 4 * xi + 3 * square,
            6 * (xi - square) / length,
            3 * square - 2 * xi,
        ]
    )
