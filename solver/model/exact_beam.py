"""Tensioned Euler-Bernoulli element with the exact solutions of its equation at rest.

T w'' - EI w'''' = -q has hyperbolic solutions, which bend within sqrt(EI / T) of a load. With them
heights at nodes under point loads and uniform loads are exact, however long an element is. Source:
the stability functions of a beam column, S. P. Timoshenko, J. M. Gere, *Theory of Elastic
Stability* (1961), chapter 1, for tension in place of compression.
"""

from __future__ import annotations

import numpy as np

# A wire that does not bend has slopes of its own at nodes only as the limit of one that does: its
# layer is this share of an element. A kink of 0.02 in an element of 10 m is then off by 5e-6 m.
_THINNEST = 1e-4
# Below this k the series of k coth k - 1 is used: it leaves out 2 k^4 / 315 of the whole, and what
# the difference would lose is EPS / k^2, both 1e-10 at most.
_SERIES = 1e-2


def stiffness(length: np.ndarray, bending_stiffness: float, tension: np.ndarray) -> np.ndarray:
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
    (n,) [N] as in ``stiffness``.
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
