"""Irregularities of a track as sums of sines whose power follows a published spectrum.

All spectra are one-sided over the wave number Omega [rad/m]; their integral is the variance.

American, FRA classes 4 to 6 (V. K. Garg, R. V. Dukkipati, Dynamics of Railway Vehicle Systems,
1984): S = k A Oc^2 / (Omega^2 (Omega^2 + Oc^2)), k = 0.25, Oc = 0.8245 rad/m.

German, low and high disturbance (H. Claus, W. Schiehlen, Modeling and simulation of railway bogie
structural vibrations, 1998, after ORE B176): S = A Oc^2 / ((Omega^2 + Or^2) (Omega^2 + Oc^2)),
Oc = 0.8246 rad/m, Or = 0.0206 rad/m.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

# Waves of a sum; over a factor of 33 in wavelength each stands for 3 % of it.
N_WAVES = 120


class Spectrum(NamedTuple):
    """Spectrum of a track: one-sided density A Oc^2 / ((O^2 + Or^2) (O^2 + Oc^2)) [m^3/rad].

    ``vertical`` and ``lateral`` are the roughness A of either direction [m rad] (k A), ``corner``
    is Oc and ``low`` Or [rad/m].
    """

    vertical: float
    lateral: float
    corner: float
    low: float

    def variance(self, direction: str, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
        """Integral of the density from wave number ``lowest`` to ``highest`` [rad/m] of a
        ``direction``, "vertical" or "lateral", in closed form [m^2]."""
        roughness = self.vertical if direction == "vertical" else self.lateral
        oc, low = self.corner, self.low

        def primitive(x: np.ndarray) -> np.ndarray:
            # Partial fractions: 1 / (x^2 + Or^2) less 1 / (x^2 + Oc^2), over Oc^2 - Or^2.
            slow = np.arctan(x / low) / low if low > 0.0 else -1.0 / x
            return (slow - np.arctan(x / oc) / oc) / (oc**2 - low**2)

        return roughness * oc**2 * (primitive(highest) - primitive(lowest))


def _fra(vertical: float, lateral: float) -> Spectrum:
    # k = 0.25; published in cm^2 rad/m.
    return Spectrum(0.25e-4 * vertical, 0.25e-4 * lateral, corner=0.8245, low=0.0)


SPECTRA = {
    "fra_4": _fra(0.5376, 0.3027),
    "fra_5": _fra(0.2095, 0.0762),
    "fra_6": _fra(0.0339, 0.0339),
    "german_low": Spectrum(4.032e-7, 2.119e-7, corner=0.8246, low=0.0206),
    "german_high": Spectrum(10.80e-7, 6.125e-7, corner=0.8246, low=0.0206),
}


@dataclass(frozen=True)
class Irregularity:
    """An irregular track.

    ``spectrum`` is a key of ``SPECTRA``; wavelengths from ``shortest`` to ``longest`` [m]; the same
    ``seed`` gives the same track.
    """

    spectrum: str
    shortest: float
    longest: float
    seed: int

    def waves(self, direction: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Amplitudes [m], wave numbers [rad/m] and phases [rad] of the sines, see ``sines``."""
        variance = partial(SPECTRA[self.spectrum].variance, direction)
        return sines(variance, (self.shortest, self.longest), self.seed, direction)


def sines(
    variance: Callable[[np.ndarray, np.ndarray], np.ndarray],
    wavelengths: tuple[float, float],
    seed: int,
    name: str,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Amplitudes [m], wave numbers [rad/m] and phases [rad] of sines, shape (N_WAVES,).

    Each has the power of its part of the spectrum (M. Shinozuka, C.-M. Jan, Digital simulation of
    random processes, J. Sound Vib. 25, 1972). Wave numbers grow by a constant factor: no two have a
    common multiple nearby, so that the sum does not repeat itself.

    Parameters
    ----------
    variance : callable
        Integral of the spectrum between lowest and highest wave numbers, (n,) each [m^2].
    wavelengths : tuple of float
        Shortest and longest wavelength [m].
    seed : int
        Seed of the phases.
    name : str
        Name of what the sum is of; others have other phases.
    """
    shortest, longest = wavelengths
    edges = np.geomspace(2.0 * np.pi / longest, 2.0 * np.pi / shortest, N_WAVES + 1)
    power = variance(edges[:-1], edges[1:])
    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    phases = random.uniform(0.0, 2.0 * np.pi, N_WAVES)
    return np.sqrt(2.0 * power), np.sqrt(edges[:-1] * edges[1:]), phases
