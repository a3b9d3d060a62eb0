"""Laws of the contact between head and wire: a force from the depth and its rate.

    linear      f = k d + c d'
    Hertz       f = K d^n (1 + chi d' / d0')      d0' the speed at which contact was made

with the depth d, by how far the head stands above the wire. The hysteresis factor chi follows from
the coefficient of restitution e:

    Lankarani and Nikravesh   3 (1 - e^2) / 4           (paper eq. 4.1), for e near 1
    Hunt and Crossley         3 (1 - e) / 2             for e near 1
    Flores et al.             8 (1 - e) / (5 e)         for all e, nearly
    Gonthier et al.           (1 + chi) / (1 - chi e) = exp(chi (1 + e))            exact for all e

The kinematic law keeps d = 0 and ends the run when that would take a pull.

Sources: Ambrosio et al., 2012, section 4; H. M. Lankarani, P. E. Nikravesh, J. Mech. Design 112,
1990; K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42, 1975; P. Flores et al., Multibody Syst. Dyn.
25, 2011; Y. Gonthier et al., Multibody Syst. Dyn. 11, 2004.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class LinearLaw:
    """A spring of ``stiffness`` [N/m] and a damper of ``damping`` [N s/m] in the gap."""

    stiffness: float
    damping: float

    @property
    def dissipates(self) -> bool:
        """Whether the force depends on the rate."""
        return self.damping > 0

    def depth(self, force: float) -> float:
        """Depth under a force at rest [N], [m]."""
        return force / self.stiffness if self.stiffness > 0.0 else 0.0

    def without_damping(self) -> LinearLaw:
        """The spring alone."""
        return replace(self, damping=0.0)


@dataclass(frozen=True)
class HertzLaw:
    """A spring K d^n with hysteresis.

    ``stiffness`` K [N/m^n], ``exponent`` n [-], ``hysteresis`` chi [-]. ``least_speed`` [m/s]
    stands for the speed of impact where contact is made more slowly: chi d' / d0' has no limit
    for d0' = 0.
    """

    stiffness: float
    exponent: float
    hysteresis: float
    least_speed: float

    @property
    def dissipates(self) -> bool:
        """Whether the force depends on the rate."""
        return self.hysteresis > 0

    def depth(self, force: float) -> float:
        """Depth under a force at rest [N], [m]."""
        return float((force / self.stiffness) ** (1.0 / self.exponent))

    def without_damping(self) -> HertzLaw:
        """The spring alone."""
        return replace(self, hysteresis=0.0)


@dataclass(frozen=True)
class KinematicLaw:
    """No depth at all: the force is whatever keeps head and wire together."""

    @property
    def dissipates(self) -> bool:
        """Never."""
        return False

    def depth(self, force: float) -> float:
        """Depth under a force at rest [N], [m]."""
        return 0.0

    def without_damping(self) -> KinematicLaw:
        """The same."""
        return self


ContactLaw = LinearLaw | HertzLaw | KinematicLaw


def uses_rate(law: ContactLaw) -> bool:
    """Whether steps with a law need rates: a kinematic contact ends depths through them."""
    return law.dissipates or isinstance(law, KinematicLaw)


def _gonthier(restitution: float) -> float:
    """Hysteresis factor chi by which a body rebounds with exactly ``restitution`` times its speed.

    The equation is chi (1 + e) = log((1 + chi) / (1 - chi e)), the integral of
    m v dv/dd = -K d^n (1 + chi v / v0) for every m, K, n and v0. Besides chi = 0 it has one
    solution.
    """
    e = restitution
    if e == 1.0:
        return 0.0
    from scipy.optimize import brentq  # the one law that needs it

    def excess(chi: float) -> float:
        return float(chi * (1 + e) - np.log1p(chi) + np.log1p(-chi * e))

    # For e near 1 chi is about 1.5 (1 - e) and larger otherwise; it stays below 1 / e.
    return float(brentq(excess, 0.5 * (1 - e), (1 - 1e-15) / e, xtol=1e-15))


HYSTERESIS: dict[str, Callable[[float], float]] = {
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e**2),
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "flores": lambda e: 1.6 * (1 - e) / e,
    "gonthier": _gonthier,
}
"""Hysteresis factor chi of a coefficient of restitution, 0 < e <= 1, by the name of its law."""
