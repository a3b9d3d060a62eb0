"""A chain of one to three lumped masses fitted to a measured or computed receptance of a head.

Least squares of the logarithm of the receptances' ratio, magnitude and phase at once, so that
resonances and the quiet range between them count alike. Masses, springs and dampers stay positive.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.lumped_data import LumpedData
from catenary.mbs.response.linearisation import apparent_mass, of_chain
from catenary.mbs.rigid.bodies import Vector

MOST_MASSES = 3
# Bounds of masses [kg], stiffnesses [N/m] and dampings [N s/m]. A lower bound stands for "none".
BOUNDS = ((1e-2, 1e3), (1e-3, 1e8), (1e-6, 1e6))
N_STARTS = 24
# No further start is tried below this rms error.
EXACT = 1e-8


class ChainFit(NamedTuple):
    """A fitted chain, and how far it is from what it was fitted to.

    ``rms_error`` and ``largest_error``: of |H_fit / H - 1| over the ``n_points`` frequencies from
    ``lowest`` to ``highest`` [Hz].
    """

    data: LumpedData
    rms_error: float
    largest_error: float
    lowest: float
    highest: float
    n_points: int

    def receptance(self, frequencies: Vector) -> np.ndarray:
        """Receptance of the fitted chain at its head (n_f,) [m/N]."""
        return of_chain(self.data).receptance(frequencies)


def fit_chain(frequencies: Vector, receptance: np.ndarray, n_masses: int) -> ChainFit:
    """The chain of ``n_masses`` masses whose head's receptance is nearest to the given one.

    A receptance that is not that of springs to the ground at its low end (a lift that pulls harder
    the higher it gets) cannot be met by positive springs there: fit above such frequencies.

    Parameters
    ----------
    frequencies : array_like, shape (n,)
        Frequencies [Hz], positive.
    receptance : ndarray, shape (n,)
        Complex displacement per force, both upward [m/N].
    n_masses : int
        Number of masses, 1 to 3.

    Raises
    ------
    InputError
        Other than one to three masses, too few points for them, or a receptance of zero.
    RunBroken
        No start leads to a fit.
    """
    at, wanted = np.asarray(frequencies, dtype=float), np.asarray(receptance, dtype=complex)
    if not 1 <= n_masses <= MOST_MASSES:
        raise InputError(f"A chain is fitted of 1 to {MOST_MASSES} masses, not of {n_masses}.")
    if len(at) != len(wanted) or 2 * len(at) < 3 * n_masses:
        raise InputError(
            f"{len(at)} frequencies with {len(wanted)} receptances are too few for the "
            f"{3 * n_masses} values of {n_masses} masses."
        )
    if np.any(at <= 0.0) or not np.isfinite(wanted).all() or np.any(wanted == 0.0):
        raise InputError("A chain is fitted to finite receptances at frequencies above zero.")
    lower, upper = np.log(np.repeat(np.array(BOUNDS), n_masses, axis=0)).T
    omega, best = 2.0 * np.pi * at, None
    for start in _starts(at, wanted, n_masses):
        found = least_squares(
            _residuals,
            np.clip(start, lower + 1e-9, upper - 1e-9),
            jac=_slopes,
            bounds=(lower, upper),
            args=(omega, wanted),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=400,
        )
        if np.isfinite(found.cost) and (best is None or found.cost < best.cost):
            best = found
        if best is not None and np.sqrt(2.0 * best.cost / len(at)) < EXACT:
            break
    if best is None:
        raise RunBroken(f"No chain of {n_masses} masses comes near the receptance.")
    data = _chain(best.x)
    error = np.abs(of_chain(data).receptance(at) / wanted - 1.0)
    return ChainFit(
        data,
        float(np.sqrt(np.mean(error**2))),
        float(error.max()),
        float(at.min()),
        float(at.max()),
        len(at),
    )


def _chain(logarithms: np.ndarray) -> LumpedData:
    """Masses, stiffnesses and dampings from the logarithms (3 n,) of all."""
    masses, stiffnesses, dampings = np.exp(logarithms).reshape(3, -1).tolist()
    return LumpedData(tuple(masses), tuple(stiffnesses), tuple(dampings))


def _residuals(logarithms: np.ndarray, omega: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """log |H / H_wanted| and the difference of phases (2 n,)."""
    ratio = np.log(of_chain(_chain(logarithms)).receptance(omega / (2.0 * np.pi)) / wanted)
    return np.concatenate([ratio.real, ratio.imag])


def _slopes(logarithms: np.ndarray, omega: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Derivatives of the residuals to the logarithms (2 n, 3 n_masses).

    With x the motions under a unit force on the head, dH / dp = -x^T (dZ / dp) x.
    """
    data = _chain(logarithms)
    moved = of_chain(data).amplitudes(omega / (2.0 * np.pi))
    # Stretch of each spring, the last one's to the ground.
    stretched = np.diff(moved, axis=1, append=0.0)
    by_stiffness = -(stretched**2)
    columns = np.hstack(
        [omega[:, None] ** 2 * moved**2, by_stiffness, 1j * omega[:, None] * by_stiffness]
    )
    columns *= np.exp(logarithms) / moved[:, :1]
    return np.vstack([columns.real, columns.imag])


def _starts(at: np.ndarray, wanted: np.ndarray, n_masses: int) -> list[np.ndarray]:
    """Logarithms to start from: the head's mass from the highest frequency, the rest scattered.

    Scattered always the same way, so that a fit can be repeated.
    """
    random = np.random.default_rng(1)
    low, high = BOUNDS[0]
    head = float(np.clip(np.abs(apparent_mass(at[-1:], wanted[-1:]))[0], low, high))
    starts = []
    for _ in range(N_STARTS):
        masses = head * np.exp(random.uniform(np.log(0.3), np.log(6.0), n_masses))
        masses[0] = head
        # Springs that make their masses swing within the range.
        swings = np.exp(random.uniform(np.log(at[0]), np.log(at[-1]), n_masses))
        stiffnesses = masses * (2.0 * np.pi * swings) ** 2
        ratios = np.exp(random.uniform(np.log(0.01), np.log(0.5), n_masses))
        dampings = 2.0 * ratios * np.sqrt(masses * stiffnesses)
        starts.append(np.log(np.concatenate([masses, stiffnesses, dampings])))
    return starts
