"""Wind as data: mean, profile, exposure and gusts, in SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

# Von Karman's constant of the logarithmic law.
_KARMAN = 0.4
# Variance of Davenport's spectrum over the friction velocity squared.
_DAVENPORT = 6.0


@dataclass(frozen=True)
class Profile:
    """Profile of the mean speed over the height above ground.

    ln(z / ``roughness``) [m], or with an ``exponent`` z to the power of it.
    """

    roughness: float = 0.05
    exponent: float | None = None

    def growth(self, height: float | np.ndarray, reference: float) -> np.ndarray:
        """Speed at a height [m] over that at a ``reference`` [m], shape as ``height``."""
        z = np.asarray(height, dtype=float)
        if self.exponent is not None:
            return np.asarray((z / reference) ** self.exponent)
        return np.asarray(np.log(z / self.roughness) / math.log(reference / self.roughness))


@dataclass(frozen=True)
class Stretch:
    """A part of the line from ``start`` to ``end`` [m] with another exposure.

    ``factor`` of mean and gusts; ``height`` [m] of the wires above ground, with which the mean
    alone grows, None for that elsewhere.
    """

    start: float
    end: float
    factor: float = 1.0
    height: float | None = None


@dataclass(frozen=True)
class Gusts:
    """Turbulence about the mean wind.

    Attributes
    ----------
    friction_velocity : u* [m/s], of which the spectra are multiples
    spectrum : along the mean wind: ``davenport`` or ``von_karman``
    length_scale : of the spectrum of von Karman [m]
    decay : C of the coherence exp(-C n d / U) of points d apart on the line, of the parts along the
        mean wind, across it and upward
    lowest, highest : of its frequencies [Hz]
    spacing : of the points along the line between which the field is linear [m]
    growth : time in which gusts grow from zero [s]
    seed : of the random numbers; the same seed gives the same gusts
    """

    friction_velocity: float
    spectrum: str = "davenport"
    length_scale: float = 100.0
    decay: tuple[float, float, float] = (10.0, 10.0, 10.0)
    lowest: float = 0.005
    highest: float = 5.0
    spacing: float = 5.0
    growth: float = 2.0
    seed: int = 1


@dataclass(frozen=True)
class Wind:
    """Wind over the line.

    Attributes
    ----------
    speed : mean wind speed at ``reference_height`` [m/s]
    direction : direction of the flow: 0 with the train, pi/2 to the left of it, pi against it [rad]
    height : height of the wires above ground [m]
    reference_height : height above ground at which ``speed`` is given [m]
    profile : growth of the mean with the height
    density : density of the air [kg/m3]
    quadratic : whether gusts act with the square of the whole speed, or linearised about the mean
    stretches : stretches of other exposure, which do not overlap
    gusts : None for a steady wind
    """

    speed: float
    direction: float = 0.5 * math.pi
    height: float = 6.0
    reference_height: float = 10.0
    profile: Profile = Profile()
    density: float = 1.225
    quadratic: bool = False
    stretches: tuple[Stretch, ...] = ()
    gusts: Gusts | None = None

    @property
    def mean(self) -> float:
        """Mean speed at the wires outside of the stretches [m/s]."""
        return float(self.speed * self.profile.growth(self.height, self.reference_height))

    @property
    def intensity(self) -> float:
        """Standard deviation of the gusts along the wind over the mean, 0 without gusts."""
        if self.gusts is None:
            return 0.0
        return math.sqrt(_DAVENPORT) * self.gusts.friction_velocity / self.mean

    def with_gusts(self, gusts: Gusts | None) -> Wind:
        """Return this mean wind with other gusts."""
        return replace(self, gusts=gusts)

    @property
    def friction_velocity(self) -> float:
        """u* of the logarithmic law [m/s]; of a power law that of the same roughness."""
        return _KARMAN * self.speed / math.log(self.reference_height / self.profile.roughness)


def friction_velocity_of(intensity: float, mean: float) -> float:
    """u* [m/s] of gusts whose standard deviation is ``intensity`` times the mean [m/s], by the
    variance 6 u*^2 of Davenport's spectrum."""
    return intensity * mean / math.sqrt(_DAVENPORT)
