"""Tensioned Euler-Bernoulli element with Hermite interpolation, for many lengths at once.

Unknowns of an element: (w1, theta1, w2, theta2) with theta = dw/dx. Source: paper, eq. (2.1).
"""

from __future__ import annotations

import numpy as np

# Rotation of a wire from rest [rad] at which a march ends: the force of its tension T across the
# track of its rest, T sin(phi), is taken as T phi, and is then wrong by 16 %.
MOST_ROTATION = 1.0


def stiffness(
    length: np.ndarray, bending_stiffness: float | np.ndarray, tension: float | np.ndarray
) -> np.ndarray:
    """Element matrices K = EI K_L + F K_G of eq. (2.1).

    Parameters
    ----------
    length : ndarray, shape (n,)
        Lengths of the elements [m].
    bending_stiffness : float or ndarray
        EI of all elements or (n,) of each [N m2].
    tension : float or ndarray
        Tension F, positive in tension, of all elements or (n,) of each [N].

    Returns
    -------
    ndarray, shape (n, 4, 4)
        Forces [N] and moments [N m] for unit displacements [m] and rotations [rad].
    """
    one = np.ones_like(length)
    bending = _matrix(
        [12 * one, 6 * length, -12 * one, 6 * length],
        [4 * length**2, -6 * length, 2 * length**2],
        [12 * one, -6 * length],
        [4 * length**2],
    )
    geometric = _matrix(
        [36 * one, 3 * length, -36 * one, 3 * length],
        [4 * length**2, -3 * length, -(length**2)],
        [36 * one, -3 * length],
        [4 * length**2],
    )
    return (bending_stiffness / length**3)[:, None, None] * bending + (tension / (30 * length))[
        :, None, None
    ] * geometric


def mass(length: np.ndarray, mass_per_length: float | np.ndarray) -> np.ndarray:
    """Consistent mass matrices, shape (n, 4, 4), for lengths (n,) [m] and masses per length, of all
    or (n,) of each [kg/m]."""
    one = np.ones_like(length)
    shape = _matrix(
        [156 * one, 22 * length, 54 * one, -13 * length],
        [4 * length**2, 13 * length, -3 * length**2],
        [156 * one, -22 * length],
        [4 * length**2],
    )
    return (mass_per_length * length / 420)[:, None, None] * shape


def uniform_load(length: np.ndarray) -> np.ndarray:
    """Nodal forces and moments of a unit load per length along w, shape (n, 4) [m], [m2]."""
    half = length / 2
    moment = length**2 / 12
    return np.stack([half, moment, half, -moment], axis=1)


def linear_load(length: np.ndarray) -> np.ndarray:
    """Nodal forces and moments of a load per length that falls from one to zero along w, and of one
    that rises from zero to one, shape (n, 4, 2) [m], [m2]."""
    share = np.array([[7.0, 3.0], [3.0, 2.0], [3.0, 7.0], [-2.0, -3.0]])
    share /= np.array([[20.0], [60.0], [20.0], [60.0]])
    powers = np.stack([length, length**2, length, length**2], axis=1)
    return np.asarray(powers[:, :, None] * share)


def _matrix(*upper_rows: list[np.ndarray]) -> np.ndarray:
    """Symmetric matrices, shape (n, 4, 4), from the rows of their upper triangle."""
    n = upper_rows[0][0].shape[0]
    result = np.empty((n, 4, 4))
    for i, row in enumerate(upper_rows):
        for j, entry in enumerate(row, start=i):
            result[:, i, j] = entry
            result[:, j, i] = entry
    return result


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
