"""Tensioned Euler-Bernoulli elements of many lengths at once: by Hermite's functions, and exact.

Unknowns of an element: (w1, theta1, w2, theta2) with theta = dw/dx. In motion elements have Hermite
interpolation. Source: paper, eq. (2.1).

At rest T w'' - EI w'''' = -q has hyperbolic solutions, which bend within sqrt(EI / T) of a load.
With them heights at nodes under point loads and uniform loads are exact, however long an element
is. Source: the stability functions of a beam column, S. P. Timoshenko, J. M. Gere, *Theory of
Elastic Stability* (1961), chapter 1, for tension in place of compression.
"""

from __future__ import annotations

import numpy as np

# Rotation of a wire from rest [rad] at which a march ends: the force of its tension T across the
# track of its rest, T sin(phi), is taken as T phi, and is then wrong by 16 %.
MOST_ROTATION = 1.0
_Place = float | np.ndarray
# A wire that does not bend has slopes of its own at nodes only as the limit of one that does: its
# layer is this share of an element. A kink of 0.02 in an element of 10 m is then off by 5e-6 m.
_THINNEST = 1e-4
# Below this k the series of k coth k - 1 is used: it leaves out 2 k^4 / 315 of the whole, and what
# the difference would lose is EPS / k^2, both 1e-10 at most.
_SERIES = 1e-2
# Matrices of elements of a unit length: bending, tension, mass.
_BENDING = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
_TENSION = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]) / 30
_MASS = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420


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
    bending = _scaled(_BENDING, bending_stiffness / length**3, length)
    return bending + _scaled(_TENSION, tension / length, length)


def mass(length: np.ndarray, mass_per_length: float | np.ndarray) -> np.ndarray:
    """Consistent mass matrices, shape (n, 4, 4), for lengths (n,) [m] and masses per length, of all
    or (n,) of each [kg/m]."""
    return _scaled(_MASS, mass_per_length * length, length)


def _scaled(of_unit: np.ndarray, factor: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Matrices (n, 4, 4) of elements: ``factor`` (n,) times those of a unit length, rotations times
    the ``length`` (n,)."""
    one = np.ones_like(length)
    units = np.stack([one, length, one, length], axis=1)
    return np.asarray(factor[:, None, None] * of_unit * units[:, :, None] * units[:, None, :])


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


def exact_stiffness(
    length: np.ndarray, bending_stiffness: float, tension: np.ndarray
) -> np.ndarray:
    """Element matrices in (w1, theta1, w2, theta2).

    With k = h / 2 sqrt(T / EI) and c = k coth k, ends that turn by a unit against each other need
    the moments 2 EI / h c, ends that turn alike 2 EI / h k^2 / (c - 1).

    Parameters
    ----------
    length : ndarray, shape (n,)
        Lengths of the elements [m].
    bending_stiffness : float
        EI [N m2].
    tension : ndarray, shape (n,)
        Tension of each element, not negative [N].

    Returns
    -------
    ndarray, shape (n, 4, 4)
        Forces [N] and moments [N m] for unit displacements [m] and rotations [rad].
    """
    bending, c, share = _functions(length, bending_stiffness, tension)
    opposite, alike = 2.0 * bending / length * c, 6.0 * bending / length / share
    near, far = 0.5 * (alike + opposite), 0.5 * (alike - opposite)
    # Rotations of both ends against the chord.
    zero, one, slope = np.zeros_like(length), np.ones_like(length), 1.0 / length
    first = np.stack([slope, one, -slope, zero], axis=1)
    second = np.stack([slope, zero, -slope, one], axis=1)
    chord = np.stack([slope, zero, -slope, zero], axis=1)

    def product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return left[:, :, None] * right[:, None, :]

    turned = product(first, first) + product(second, second)
    crossed = product(first, second) + product(second, first)
    return (
        near[:, None, None] * turned
        + far[:, None, None] * crossed
        + (tension * length)[:, None, None] * product(chord, chord)
    )


def moment_share(length: np.ndarray, bending_stiffness: float, tension: np.ndarray) -> np.ndarray:
    """Moments at the ends under a uniform load q over q h^2 / 12, (n,) [-]: 3 (c - 1) / k^2.

    They are 1 without tension. ``length`` (n,) [m], ``bending_stiffness`` [N m2] and ``tension``
    (n,) [N] as in ``exact_stiffness``.
    """
    return _functions(length, bending_stiffness, tension)[2]


def _functions(
    length: np.ndarray, bending_stiffness: float, tension: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """EI of each element [N m2], c = k coth k and 3 (c - 1) / k^2, (n,) each."""
    bending = np.maximum(bending_stiffness, tension * (_THINNEST * length) ** 2)
    stiff = bending > 0.0
    k = 0.5 * length * np.sqrt(np.divide(tension, bending, out=np.zeros_like(length), where=stiff))
    long = np.maximum(k, _SERIES)
    c = np.where(k > _SERIES, long / np.tanh(long), 1.0 + k**2 / 3.0)
    share = np.where(k > _SERIES, 3.0 * (c - 1.0) / long**2, 1.0 - k**2 / 15.0)
    return bending, c, share
